#include <Eigen/Dense>

#include "support/oracle.hpp"

namespace flyball::test {

using Eigen::MatrixXcd;
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

Eigen::VectorXd singular_values(const MatrixXd& A) {
  return Eigen::JacobiSVD<MatrixXd>(A).singularValues();
}

Eigen::VectorXd singular_values(const MatrixXcd& A) {
  return Eigen::JacobiSVD<MatrixXcd>(A).singularValues();
}

MatrixXd inverse(const MatrixXd& A) {
  return Eigen::FullPivLU<MatrixXd>(A).inverse();
}

MatrixXcd inverse(const MatrixXcd& A) {
  return Eigen::FullPivLU<MatrixXcd>(A).inverse();
}

GeneralizedEigenvalues generalized_eigenvalues(const MatrixXd& A, const MatrixXd& B) {
  const Eigen::GeneralizedEigenSolver<MatrixXd> solver(A, B, false);
  return {solver.alphas(), solver.betas()};
}

MatrixXd solve(const MatrixXd& A, const MatrixXd& B) {
  return Eigen::PartialPivLU<MatrixXd>(A).solve(B);
}

MatrixXcd solve(const MatrixXcd& A, const MatrixXcd& B) {
  return Eigen::PartialPivLU<MatrixXcd>(A).solve(B);
}

MatrixXcd response(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C, const MatrixXd& D,
                   std::complex<double> s) {
  MatrixXcd shifted = -A.cast<std::complex<double>>();
  shifted.diagonal().array() += s;
  return C.cast<std::complex<double>>() * solve(shifted, B.cast<std::complex<double>>()) +
         D.cast<std::complex<double>>();
}

}  // namespace flyball::test
