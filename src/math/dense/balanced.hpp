#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

#include "math/dense/ordinary_units.hpp"

/// Matrices in units of their states in which no sum or product that matters leaves the doubles.
namespace flyball::detail {

/// Whether a number that is not zero is beyond 2^300 or 2^-300.
[[nodiscard]] inline bool is_far(double x) {
  constexpr double bound = 0x1p300;
  const double size = std::abs(x);
  const bool beyond = size >= bound;
  const bool below = size <= 1.0 / bound;
  const bool known = (size != 0.0) & (size <= std::numeric_limits<double>::max());
  return (beyond | below) & known;
}

/// Whether an entry is: then products of a few may have no double, nor may the quotients of the
/// units that balance them.
template <class Derived>
[[nodiscard]] bool is_far(const Eigen::DenseBase<Derived>& M) {
  bool far = false;
  for (Eigen::Index j = 0; j < M.cols(); ++j) {
    for (Eigen::Index i = 0; i < M.rows(); ++i) {
      far |= is_far(M(i, j));  // without a branch: as a rule none is
    }
  }
  return far;
}

/// The exponent of the largest M_ij 2^(row_i + column_j) of an M that is not zero.
[[nodiscard]] inline int largest_exponent(const MatrixRef& M, const Eigen::VectorXi& row,
                                          const Eigen::VectorXi& column) {
  int largest = std::numeric_limits<int>::min();
  for (Eigen::Index j = 0; j < M.cols(); ++j) {
    for (Eigen::Index i = 0; i < M.rows(); ++i) {
      if (M(i, j) != 0.0) {
        largest = std::max(largest, std::ilogb(M(i, j)) + row(i) + column(j));
      }
    }
  }
  return largest;
}

/// A = 2^unit D M D⁻¹, D = diag(2^d): rows and columns of M are of like size, and its largest entry
/// is near one or, of ordinary ones, as it was.
struct BalancedMatrix {
  Eigen::MatrixXd M;
  Eigen::VectorXi d;
  int unit = 0;
  bool far = false;  ///< Doubles would not have done as units.

  /// D X D⁻¹ 2^exponent.
  [[nodiscard]] Eigen::MatrixXd back(const Eigen::MatrixXd& X, int exponent = 0) const {
    return times_powers(X, d, -d, exponent);
  }
  /// D⁻¹ X D 2^exponent.
  [[nodiscard]] Eigen::MatrixXd there(const Eigen::MatrixXd& X, int exponent = 0) const {
    return times_powers(X, -d, d, exponent);
  }
};

/// The units do not depend on those that A is given in, other than by rounding to powers of two,
/// where its entries are far; ordinary ones are left as `balance_of` has them.
/// Cost: that of `balance_of`; of far entries that of `pair_scaling_of`.
[[nodiscard]] BalancedMatrix balanced_of(const MatrixRef& A);

/// The same, of any A in units that do not depend on those that it is given in; of states coupled
/// one way, in units in which that counts.
[[nodiscard]] BalancedMatrix balanced_far(const MatrixRef& A);

/// The least d ≥ 0 in units 2^d of which no entry of D⁻¹(2^power A)D is beyond 2^most, where the
/// cycles of A, which no units change, allow it; else beyond their largest mean by 2. So a function
/// f(A) = D f(D⁻¹AD) D⁻¹ is taken where its error beside its largest entry is its error anywhere,
/// and what needs no units keeps those that it has; all of an A without cycles if `most` is -∞.
/// Cost: O(n³). Longest paths by Bellman and Ford.
[[nodiscard]] Eigen::VectorXi units_within(const MatrixRef& A, int power, double most);

/// The units of an A that is far such that no entry is beyond its cycles and 2^most; nothing of
/// another, and of one that is so. Cost: O(n²) comparisons where entries are ordinary.
[[nodiscard]] std::optional<BalancedMatrix> far_units_of(const MatrixRef& A, double most);

}  // namespace flyball::detail
