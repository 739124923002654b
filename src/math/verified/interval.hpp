#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

/// Arithmetic whose results contain the exact ones, in round-to-nearest: what is computed is moved
/// outwards by one unit in the last place, or by a bound on what rounding may have done. Nothing
/// changes the processor's rounding mode, so that no compiler can move an operation out of it.
/// Source: Rump, Zimmermann, Boldo and Melquiond, "Computing predecessor and successor in rounding
/// to nearest", BIT 49 (2009); Higham, "Accuracy and Stability of Numerical Algorithms", chapter 3.
namespace flyball::detail {

/// Half a unit in the last place of 1: |fl(x op y) - (x op y)| <= u |fl(x op y)| + `underflow`.
inline constexpr double unit_roundoff = 0x1p-53;
/// More than all underflow of one quantity's operations.
inline constexpr double underflow = 0x1p-960;
/// A sum of at most 60 terms that are not negative, computed in any order, times this is no less
/// than the exact one.
inline constexpr double inflation = 1.0 + 0x1p-46;

/// No less than any real number that rounds to x.
[[nodiscard]] inline double rounded_up(double x) noexcept {
  constexpr double phi = unit_roundoff * (1.0 + 2.0 * unit_roundoff);
  return x + (phi * std::abs(x) + std::numeric_limits<double>::denorm_min());
}
/// No more than any.
[[nodiscard]] inline double rounded_down(double x) noexcept {
  return -rounded_up(-x);
}

/// A set of numbers, low <= x <= high.
struct Interval {
  double low = 0.0;
  double high = 0.0;

  Interval() = default;
  constexpr Interval(double value) noexcept : low(value), high(value) {}  // NOLINT
  constexpr Interval(double from, double to) noexcept : low(from), high(to) {}

  [[nodiscard]] bool contains(double x) const noexcept { return low <= x && x <= high; }
  [[nodiscard]] double magnitude() const noexcept {
    return std::max(std::abs(low), std::abs(high));
  }
};

[[nodiscard]] inline Interval operator-(const Interval& x) noexcept {
  return {-x.high, -x.low};
}
[[nodiscard]] inline Interval operator+(const Interval& x, const Interval& y) noexcept {
  return {rounded_down(x.low + y.low), rounded_up(x.high + y.high)};
}
[[nodiscard]] inline Interval operator-(const Interval& x, const Interval& y) noexcept {
  return x + -y;
}
[[nodiscard]] inline Interval operator*(const Interval& x, const Interval& y) noexcept {
  const auto [low, high] =
      std::minmax({x.low * y.low, x.low * y.high, x.high * y.low, x.high * y.high});
  return {rounded_down(low), rounded_up(high)};
}
/// @param y  Without zero.
[[nodiscard]] inline Interval operator/(const Interval& x, const Interval& y) noexcept {
  const auto [low, high] =
      std::minmax({x.low / y.low, x.low / y.high, x.high / y.low, x.high / y.high});
  return {rounded_down(low), rounded_up(high)};
}

/// eˣ, by its series on [-1/4, 1/4] and squaring: no library's word is taken for its digits.
[[nodiscard]] inline Interval exp(double x) noexcept {
  constexpr double least = -700.0;
  if (x < least) {
    return {0.0, exp(least).high};
  }
  if (x > -least) {
    return {exp(-least).low, std::numeric_limits<double>::infinity()};
  }
  int halvings = 0;
  double y = x;
  for (; std::abs(y) > 0.25; ++halvings) {
    y *= 0.5;  // exact
  }
  constexpr int terms = 14;
  Interval sum(1.0);
  for (int k = terms; k >= 1; --k) {
    sum = Interval(1.0) + Interval(y) * sum / Interval(static_cast<double>(k));
  }
  // What is left out is below 0.25^15/15! e^0.25.
  sum = sum + Interval(-0x1p-69, 0x1p-69);
  for (; halvings > 0; --halvings) {
    sum = sum * sum;
  }
  return sum;
}

}  // namespace flyball::detail
