#include <Eigen/Eigenvalues>

#include "support/oracle.hpp"

namespace flyball::test {

using Eigen::MatrixXd;

Eigen::VectorXcd eigenvalues(const MatrixXd& A) {
  return Eigen::EigenSolver<MatrixXd>(A, false).eigenvalues();
}

Eigen::VectorXd symmetric_eigenvalues(const MatrixXd& S) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

Modes modes_of(const MatrixXd& A) {
  const Eigen::EigenSolver<MatrixXd> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

GeneralizedEigenvalues generalized_eigenvalues(const MatrixXd& A, const MatrixXd& B) {
  const Eigen::GeneralizedEigenSolver<MatrixXd> solver(A, B, false);
  return {solver.alphas(), solver.betas()};
}

}  // namespace flyball::test
