#include <Eigen/QR>

#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"

namespace flyball::detail {

using Eigen::MatrixXd;

MatrixXd solve_least_squares(const MatrixRef& A, const MatrixRef& B) {
  const int unit = unit_of(A);
  if (unit != 0) {
    return times_power(solve_least_squares(times_power(A, -unit), B), -unit);
  }
  return A.completeOrthogonalDecomposition().solve(B);
}

OrthogonalTriangular full_qr(const MatrixRef& A) {
  if (const int unit = unit_of(A); unit != 0) {
    OrthogonalTriangular qr = full_qr(times_power(A, -unit));
    qr.R = times_power(qr.R, unit);
    return qr;
  }
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  return {qr.householderQ(), qr.matrixQR().triangularView<Eigen::Upper>()};
}

OrthogonalTriangular pivoted_qr(const MatrixRef& A) {
  if (const int unit = unit_of(A); unit != 0) {
    OrthogonalTriangular qr = pivoted_qr(times_power(A, -unit));
    qr.R = times_power(qr.R, unit);
    return qr;
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  return {qr.householderQ(), qr.matrixQR().triangularView<Eigen::Upper>()};
}

}  // namespace flyball::detail
