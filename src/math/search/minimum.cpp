#include <flyball/math/search/minimum.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/search/search.hpp"

namespace flyball {

namespace {

struct Point {
  double x;
  double value;
};

/// The turning point of the parabola through three points, or not a number.
double turning_point(const Point& x, const Point& w, const Point& v) {
  const double r = (x.x - w.x) * (x.value - v.value);
  const double q = (x.x - v.x) * (x.value - w.value);
  return x.x - ((x.x - v.x) * q - (x.x - w.x) * r) / (2.0 * (q - r));
}

}  // namespace

Expected<Minimum> find_minimum(FunctionRef<double(double)> f, double low, double high,
                               const SearchOptions& options) {
  constexpr std::string_view where = "find_minimum";
  FLYBALL_CHECK(detail::check_search(low, high, options, where));
  if (!(low < high)) {
    return refusal(ArgumentError::out_of_range, where, "the interval")
        .got(detail::format("from {} to {}", low, high))
        .expected("increasing");
  }
  const double relative = std::max(options.relative_tolerance, 1e-12);
  const double section = 2.0 - std::numbers::phi;
  double a = low;
  double b = high;
  Point x{a + section * (b - a), 0.0};  // The best.
  x.value = f(x.x);
  Point w = x;  // The second best.
  Point v = x;  // What was the second best before.
  double moved = 0.0;
  double moved_before = 0.0;
  for (int evaluations = 1;; ++evaluations) {
    if (std::isnan(x.value)) {
      return tl::unexpected(detail::not_a_number(x.x, where));
    }
    const double middle = 0.5 * (a + b);
    const double tolerance =
        std::max(0.5 * (options.absolute_tolerance + relative * std::abs(x.x)), 1e-300);
    if (std::abs(x.x - middle) <= 2.0 * tolerance - 0.5 * (b - a)) {
      return Minimum{x.x, x.value, a, b, evaluations};
    }
    if (evaluations == options.most_evaluations) {
      return tl::unexpected(detail::not_converged(x.x, x.value, a, b, where));
    }
    // A parabola's step, if it stays inside and is less than half the one before last.
    const double turn = turning_point(x, w, v);
    double step = turn - x.x;
    if (turn > a && turn < b && std::abs(moved_before) > tolerance &&
        std::abs(step) < 0.5 * std::abs(moved_before)) {
      if (turn - a < 2.0 * tolerance || b - turn < 2.0 * tolerance) {
        step = std::copysign(tolerance, middle - x.x);
      }
      moved_before = moved;
    } else {
      moved_before = x.x < middle ? b - x.x : a - x.x;
      step = section * moved_before;
    }
    moved = step;
    Point u{x.x + (std::abs(step) >= tolerance ? step : std::copysign(tolerance, step)), 0.0};
    u.value = f(u.x);
    if (std::isnan(u.value)) {
      return tl::unexpected(detail::not_a_number(u.x, where));
    }
    if (u.value <= x.value) {
      (u.x < x.x ? b : a) = x.x;
      v = std::exchange(w, std::exchange(x, u));
    } else {
      (u.x < x.x ? a : b) = u.x;
      if (u.value <= w.value || w.x == x.x) {
        v = std::exchange(w, u);
      } else if (u.value <= v.value || v.x == x.x || v.x == w.x) {
        v = u;
      }
    }
  }
}

}  // namespace flyball
