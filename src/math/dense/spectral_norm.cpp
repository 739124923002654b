#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "math/dense/spectral_norm.hpp"

namespace flyball::detail {

double spectral_norm_of_complex(const ComplexMatrixRef& A) {
  if (A.size() == 0) {
    return 0.0;
  }
  if (!A.allFinite()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const double scale = std::max(A.real().cwiseAbs().maxCoeff(), A.imag().cwiseAbs().maxCoeff());
  if (scale == 0.0 || A.size() == 1) {
    return std::abs(A(0, 0));
  }
  Eigen::MatrixXcd unit = A / scale;
  if (A.rows() < A.cols()) {
    unit = Eigen::MatrixXcd(unit.adjoint());
  }
  const Eigen::MatrixXcd square = complex_product(unit.adjoint(), unit);
  // [Re -Im; Im Re] has the same eigenvalues, each twice.
  const Eigen::Index n = square.rows();
  Eigen::MatrixXd doubled(2 * n, 2 * n);
  doubled << square.real(), -square.imag(), square.imag(), square.real();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(doubled, Eigen::EigenvaluesOnly);
  return scale * std::sqrt(std::max(0.0, solver.eigenvalues()(2 * n - 1)));
}

}  // namespace flyball::detail
