#include <algorithm>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

#include "math/dense.hpp"

namespace flyball::detail {

using Eigen::MatrixXd;

MatrixXd product(const MatrixRef& A, const MatrixRef& B) {
  MatrixXd C(A.rows(), B.cols());
  C.noalias() = A * B;
  return C;
}

MatrixXd transposed_product(const MatrixRef& A, const MatrixRef& B) {
  MatrixXd C(A.cols(), B.cols());
  C.noalias() = A.transpose() * B;
  return C;
}

MatrixXd solve_linear(const MatrixRef& A, const MatrixRef& B, double* rcond) {
  const Eigen::PartialPivLU<MatrixXd> lu(A);
  if (rcond != nullptr) {
    const double smallest = lu.matrixLU().diagonal().cwiseAbs().minCoeff();
    *rcond = smallest > 0.0 ? lu.rcond() : 0.0;
  }
  return lu.solve(B);
}

Eigen::VectorXcd eigenvalues_of(const MatrixRef& A) {
  return Eigen::EigenSolver<MatrixXd>(A, false).eigenvalues();
}

OrthogonalTriangular full_qr(const MatrixRef& A) {
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  return {qr.householderQ(), qr.matrixQR().triangularView<Eigen::Upper>()};
}

OrthogonalTriangular pivoted_qr(const MatrixRef& A) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  return {qr.householderQ(), qr.matrixQR().triangularView<Eigen::Upper>()};
}

}  // namespace flyball::detail
