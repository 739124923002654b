#pragma once

#include <cmath>

#include <Eigen/Core>

/// Matrices of unevaluated sums hi + lo, about 31 digits. Where a residual is the small difference
/// of large products, forming it here makes Newton's method an iterative refinement.
/// Source: Dekker, Numerische Mathematik 18 (1971); Ogita, Rump and Oishi, SIAM J. Sci. Comput. 26
/// (2005).
namespace flyball::detail {

struct DoubleDouble {
  double hi = 0.0;
  double lo = 0.0;

  void add(double value) noexcept {
    const double sum = hi + value;
    const double part = sum - hi;
    lo += (hi - (sum - part)) + (value - part);
    hi = sum;
  }
  void add_product(double a, double b) noexcept {
    const double product = a * b;
    lo += std::fma(a, b, -product);
    add(product);
  }
};

struct DoubleDoubleMatrix {
  Eigen::MatrixXd hi;
  Eigen::MatrixXd lo;

  DoubleDoubleMatrix() = default;
  explicit DoubleDoubleMatrix(Eigen::MatrixXd value)
      : hi(std::move(value)), lo(Eigen::MatrixXd::Zero(hi.rows(), hi.cols())) {}

  [[nodiscard]] Eigen::Index rows() const { return hi.rows(); }
  [[nodiscard]] Eigen::Index cols() const { return hi.cols(); }
  [[nodiscard]] Eigen::MatrixXd rounded() const { return hi + lo; }
};

/// C + sign·Aᵀ B, where A is double and B and C are sums.
[[nodiscard]] inline DoubleDoubleMatrix add_product(DoubleDoubleMatrix C, double sign,
                                                    const Eigen::MatrixXd& A_transposed,
                                                    const DoubleDoubleMatrix& B) {
  for (Eigen::Index j = 0; j < B.cols(); ++j) {
    for (Eigen::Index i = 0; i < A_transposed.cols(); ++i) {
      DoubleDouble sum{C.hi(i, j), C.lo(i, j)};
      for (Eigen::Index k = 0; k < B.rows(); ++k) {
        const double a = sign * A_transposed(k, i);
        sum.add_product(a, B.hi(k, j));
        sum.lo += a * B.lo(k, j);
      }
      C.hi(i, j) = sum.hi + sum.lo;
      C.lo(i, j) = sum.lo - (C.hi(i, j) - sum.hi);
    }
  }
  return C;
}

}  // namespace flyball::detail
