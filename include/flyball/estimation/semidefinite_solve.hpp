#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

/// Solves with covariances in the control loop, singular ones included.
namespace flyball::detail {

/// P = L D Lᵀ with L unit lower triangular and D >= 0, written over the lower triangle of P; a
/// pivot that is rounding of its variance counts as zero, as its row and column then do.
template <class Matrix>
void ldl_factorize(Matrix& P) noexcept {
  constexpr double rounding = 8.0 * std::numeric_limits<double>::epsilon();
  const Eigen::Index n = P.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    const double variance = P(j, j);
    double pivot = variance;
    for (Eigen::Index k = 0; k < j; ++k) {
      pivot -= P(j, k) * P(j, k) * P(k, k);
    }
    const bool certain = !(pivot > rounding * static_cast<double>(n) * variance);
    P(j, j) = certain ? 0.0 : pivot;
    for (Eigen::Index i = j + 1; i < n; ++i) {
      double entry = P(i, j);
      for (Eigen::Index k = 0; k < j; ++k) {
        entry -= P(i, k) * P(j, k) * P(k, k);
      }
      P(i, j) = certain ? 0.0 : entry / pivot;
    }
  }
}

/// M <- a solution X of P X = M, whose columns lie in the range of P. @param LDL  As factorised.
template <class Matrix, class Columns>
void ldl_solve(const Matrix& LDL, Columns& M) noexcept {
  const Eigen::Index n = LDL.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j + 1; i < n; ++i) {
      M.row(i) -= LDL(i, j) * M.row(j);
    }
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    M.row(j) *= LDL(j, j) > 0.0 ? 1.0 / LDL(j, j) : 0.0;
  }
  for (Eigen::Index j = n; j-- > 0;) {
    for (Eigen::Index i = j + 1; i < n; ++i) {
      M.row(j) -= LDL(i, j) * M.row(i);
    }
  }
}

/// log N(e; 0, S), S overwritten; NaN where S is singular.
template <class Vector, class Matrix>
[[nodiscard]] double log_normal_density(Vector e, Matrix& S) noexcept {
  constexpr double log_two_pi = 1.8378770664093454836;
  ldl_factorize(S);
  double sum = 0.0;
  for (Eigen::Index j = 0; j < e.size(); ++j) {
    for (Eigen::Index i = j + 1; i < e.size(); ++i) {
      e(i) -= S(i, j) * e(j);
    }
    if (!(S(j, j) > 0.0)) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    sum += e(j) * e(j) / S(j, j) + std::log(S(j, j)) + log_two_pi;
  }
  return -0.5 * sum;
}

}  // namespace flyball::detail
