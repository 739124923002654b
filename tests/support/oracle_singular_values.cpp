#include <Eigen/QR>
#include <Eigen/SVD>

#include "support/oracle.hpp"

namespace flyball::test {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;

Eigen::VectorXd singular_values(const MatrixXd& A) {
  return Eigen::JacobiSVD<MatrixXd>(A).singularValues();
}

Eigen::VectorXd singular_values(const MatrixXcd& A) {
  return Eigen::JacobiSVD<MatrixXcd>(A).singularValues();
}

Eigen::VectorXd least_squares(const MatrixXd& A, const Eigen::VectorXd& b) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(A).solve(b);
}

MatrixXd pseudo_inverse(const MatrixXd& A) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(A).pseudoInverse();
}

}  // namespace flyball::test
