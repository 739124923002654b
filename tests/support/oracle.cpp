#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "support/oracle.hpp"

namespace flyball::test {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;

MatrixXd inverse(const MatrixXd& A) {
  return Eigen::FullPivLU<MatrixXd>(A).inverse();
}

MatrixXcd inverse(const MatrixXcd& A) {
  return Eigen::FullPivLU<MatrixXcd>(A).inverse();
}

double determinant(const MatrixXd& A) {
  return Eigen::PartialPivLU<MatrixXd>(A).determinant();
}

MatrixXd cholesky_factor(const MatrixXd& P) {
  return Eigen::LLT<MatrixXd>(P).matrixL();
}

double squared_distance(const MatrixXd& P, const Eigen::VectorXd& e) {
  return e.dot(solve(P, e).col(0));
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
