#pragma once

#include <limits>
#include <optional>

#include <Eigen/Core>

#include "math/dense.hpp"

namespace flyball::detail {

/// X = AᵀXA + C for A inside the unit circle, by the squared Smith iteration
/// X ← X + AᵀXA, A ← A² (Smith, SIAM J. Appl. Math. 16 (1968)); nothing where A's powers do not
/// vanish within 2⁵² steps, which is where A is not inside the circle in double precision.
[[nodiscard]] inline std::optional<Eigen::MatrixXd> solve_stein(Eigen::MatrixXd A,
                                                                Eigen::MatrixXd C) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  Eigen::MatrixXd X = std::move(C);
  for (int k = 0; k < 52; ++k) {
    const Eigen::MatrixXd update = transposed_product(A, product(X, A));
    X += update;
    if (!X.allFinite()) {
      return std::nullopt;
    }
    const double power = A.norm();
    if (power * power < 0.25 * epsilon) {
      return X;
    }
    A = product(A, A);
  }
  return std::nullopt;
}

}  // namespace flyball::detail
