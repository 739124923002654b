#include <cmath>

#include "math/dense/balanced.hpp"
#include "systems/hold_units.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::VectorXi;

HoldUnits hold_units_of(const MatrixRef& A, const MatrixRef& B, double T) {
  // T = t 2^power with t in [1, 2): neither product with 2^power rounds unless it leaves doubles.
  const int power = std::ilogb(T);
  const double t = std::ldexp(T, -power);
  HoldUnits units;
  units.states = units_within(A, power, 0.0);
  const VectorXi& d = units.states;
  units.A = t * times_powers(A, -d, d, power);
  units.inputs = VectorXi::Zero(B.cols());
  for (Index j = 0; j < B.cols(); ++j) {
    if (!B.col(j).isZero(0.0)) {
      units.inputs(j) = -largest_exponent(B.col(j), -d, VectorXi::Zero(1)) - power;
    }
  }
  units.B = t * times_powers(B, -d, units.inputs, power);
  return units;
}

bool needs_hold_units(const MatrixRef& A, const MatrixRef& B, double T) {
  return is_far(A) || is_far(B) || is_far(T);
}

}  // namespace flyball::detail
