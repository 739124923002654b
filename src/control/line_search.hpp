#pragma once

#include <algorithm>
#include <cmath>

namespace flyball::detail {

/// A root of f between a and b, where f changes sign, to the last bits: bisection with secant
/// steps.
template <class F>
double find_root(const F& f, double a, double b, double f_a, double f_b) {
  for (int i = 0; i < 200 && std::abs(b - a) > 4e-16 * std::max(std::abs(a), std::abs(b)); ++i) {
    const double secant = b - f_b * (b - a) / (f_b - f_a);
    const double middle = 0.5 * (a + b);
    // Each third step halves, so that the bracket cannot stay long at one end.
    const bool inside = secant > std::min(a, b) && secant < std::max(a, b);
    const double x = inside && i % 3 != 2 ? secant : middle;
    const double f_x = f(x);
    if (f_x == 0.0) {
      return x;
    }
    if ((f_x > 0.0) == (f_a > 0.0)) {
      a = x;
      f_a = f_x;
    } else {
      b = x;
      f_b = f_x;
    }
  }
  return std::abs(f_a) < std::abs(f_b) ? a : b;
}

/// The place of the smallest f in [a, b], by golden sections.
template <class F>
double find_minimum(const F& f, double a, double b) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  double c = b - ratio * (b - a);
  double d = a + ratio * (b - a);
  double f_c = f(c);
  double f_d = f(d);
  for (int i = 0; i < 60; ++i) {
    if (f_c < f_d) {
      b = d;
      d = c;
      f_d = f_c;
      c = b - ratio * (b - a);
      f_c = f(c);
    } else {
      a = c;
      c = d;
      f_c = f_d;
      d = a + ratio * (b - a);
      f_d = f(d);
    }
  }
  return 0.5 * (a + b);
}

}  // namespace flyball::detail
