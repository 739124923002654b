#pragma once

#include <array>

#include "planning/trajectory/interval_program.hpp"

/// Polynomials of an interval through values at points of it.
namespace flyball::detail {

/// c of the cubic Σ B_k c_k through four values at 0, 1/3, 2/3, 1.
template <class Value>
std::array<Value, 4> cubic_through(const Value& f0, const Value& f1, const Value& f2,
                                   const Value& f3) {
  return {f0, (-5.0 * f0 + 18.0 * f1 - 9.0 * f2 + 2.0 * f3) / 6.0,
          (2.0 * f0 - 9.0 * f1 + 18.0 * f2 - 5.0 * f3) / 6.0, f3};
}

inline double cubic_at(const std::array<double, 4>& c, double tau) {
  const double s = 1.0 - tau;
  return s * s * s * c[0] + 3.0 * s * s * tau * c[1] + 3.0 * s * tau * tau * c[2] +
         tau * tau * tau * c[3];
}

/// x at a share of the interval.
inline double parabola(const Bezier2& b, double tau) {
  const double s = 1.0 - tau;
  return s * s * b[0] + 2.0 * s * tau * b[1] + tau * tau * b[2];
}

}  // namespace flyball::detail
