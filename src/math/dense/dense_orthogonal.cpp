#include <Eigen/QR>

#include "math/dense/dense.hpp"

namespace flyball::detail {

using Eigen::MatrixXd;

MatrixXd solve_least_squares(const MatrixRef& A, const MatrixRef& B) {
  return A.completeOrthogonalDecomposition().solve(B);
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
