#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <Eigen/Core>

namespace flyball::detail {

/// The power of two in units of which M's entries, and sums of their products, are far from the
/// ends of the doubles' range; 0 where they are already, and where M has no largest entry.
template <class Derived>
[[nodiscard]] int unit_of(const Eigen::MatrixBase<Derived>& M) {
  constexpr int ordinary = 200;
  const double largest = M.size() == 0 ? 0.0 : M.cwiseAbs().maxCoeff();
  if (largest == 0.0 || !std::isfinite(largest)) {
    return 0;
  }
  const int exponent = std::ilogb(largest);
  return std::abs(exponent) > ordinary ? exponent : 0;
}

/// M 2^exponent, also for powers that have no double.
template <class Derived>
[[nodiscard]] typename Derived::PlainObject times_power(const Eigen::MatrixBase<Derived>& M,
                                                        int exponent) {
  const int half = exponent / 2;
  return (M * std::ldexp(1.0, half)) * std::ldexp(1.0, exponent - half);
}

/// M_ij 2^(row_i + column_j + all).
[[nodiscard]] inline Eigen::MatrixXd times_powers(const Eigen::MatrixXd& M,
                                                  const Eigen::VectorXi& row,
                                                  const Eigen::VectorXi& column, int all) {
  Eigen::MatrixXd scaled(M.rows(), M.cols());
  for (Eigen::Index j = 0; j < M.cols(); ++j) {
    for (Eigen::Index i = 0; i < M.rows(); ++i) {
      // Powers beyond those of any two doubles' quotient change nothing more.
      const long power = std::clamp(long{row(i)} + column(j) + all, -9999L, 9999L);
      scaled(i, j) = std::ldexp(M(i, j), static_cast<int>(power));
    }
  }
  return scaled;
}

}  // namespace flyball::detail
