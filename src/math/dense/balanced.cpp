#include <algorithm>
#include <cmath>
#include <utility>

#include "math/dense/balance_columns.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/pair_scaling.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

BalancedMatrix balanced_far(const MatrixRef& A) {
  const PairScaling scaling = pair_scaling_of(A, MatrixXd(A.rows(), 0));
  return {scaled_A(A, scaling), scaling.states, scaling.time, true};
}

BalancedMatrix balanced_of(const MatrixRef& A) {
  const int unit = unit_of(A);
  const bool finite = A.allFinite();
  const MatrixXd given = unit == 0 ? MatrixXd(A) : times_power(A, -unit);
  if (finite && (is_far(given) || ((given.array() == 0.0) != (A.array() == 0.0)).any())) {
    return balanced_far(A);
  }
  const Eigen::VectorXd d = balance_of(given);
  BalancedMatrix balanced;
  balanced.d.resize(d.size());
  for (Index i = 0; i < d.size(); ++i) {
    balanced.d(i) = std::ilogb(d(i));
    if (std::abs(balanced.d(i)) >= widest_unit && finite) {
      return balanced_far(A);  // a long chain of states
    }
  }
  balanced.M = d.cwiseInverse().asDiagonal() * given * d.asDiagonal();
  const int more = unit_of(balanced.M);
  if (more != 0) {
    balanced.M = times_power(balanced.M, -more);
  }
  balanced.unit = unit + more;
  return balanced;
}

Eigen::VectorXi units_within(const MatrixRef& A, int power, double most) {
  const Index n = A.rows();
  const double largest = std::max(most, cycle_mean_of(A) + power);
  Eigen::VectorXi d = Eigen::VectorXi::Zero(n);
  if (!std::isfinite(largest)) {
    return d;
  }
  const int bound = static_cast<int>(std::ceil(largest)) + 1;
  bool changed = true;
  for (Index round = 0; changed && round < n; ++round) {
    changed = false;
    for (Index j = 0; j < n; ++j) {
      for (Index i = 0; i < n; ++i) {
        if (i == j || A(i, j) == 0.0) {
          continue;
        }
        const int least = d(j) + std::ilogb(A(i, j)) + power - bound;
        if (least > d(i)) {
          d(i) = least;
          changed = true;
        }
      }
    }
  }
  return d;
}

std::optional<BalancedMatrix> far_units_of(const MatrixRef& A, double most) {
  if (!is_far(A)) {
    return std::nullopt;
  }
  BalancedMatrix balanced;
  balanced.d = units_within(A, 0, most);
  if (balanced.d.isZero()) {
    return std::nullopt;
  }
  balanced.M = times_powers(A, -balanced.d, balanced.d, 0);
  balanced.far = true;
  return balanced;
}

}  // namespace flyball::detail
