#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include <flyball/math/expression/operation.hpp>

#include "math/verified/interval.hpp"

/// Operations of a tape over intervals: whatever number of each operand's interval the operand is,
/// the result is in the result's. What cannot be bounded is everything, -∞ to ∞.
namespace flyball::detail {

/// Every number.
inline constexpr Interval anything{-std::numeric_limits<double>::infinity(),
                                   std::numeric_limits<double>::infinity()};
[[nodiscard]] inline bool is_bounded(const Interval& x) noexcept {
  return std::isfinite(x.low) && std::isfinite(x.high);
}
[[nodiscard]] inline Interval hull(const Interval& x, const Interval& y) noexcept {
  return {std::min(x.low, y.low), std::max(x.high, y.high)};
}
/// x y where nothing infinite meets a zero.
[[nodiscard]] inline Interval product(const Interval& x, const Interval& y) noexcept {
  return is_bounded(x) && is_bounded(y) ? x * y : anything;
}
[[nodiscard]] inline Interval quotient(const Interval& x, const Interval& y) noexcept {
  return is_bounded(x) && is_bounded(y) && !y.contains(0.0) ? x / y : anything;
}
/// x², which is not negative.
[[nodiscard]] inline Interval square(const Interval& x) noexcept {
  const double low = x.contains(0.0) ? 0.0 : std::min(std::abs(x.low), std::abs(x.high));
  const double high = x.magnitude();
  return {std::max(0.0, rounded_down(low * low)), rounded_up(high * high)};
}

/// sin x and cos x of a number, |x| <= 1e5: their distance from the exact ones is below
/// `sine_error`.
///
/// x = k π/2 + r with π/2 in three parts of which the first two times k are exact; then Taylor's
/// series to r¹⁵ and r¹⁶, of which is left out less than 0.8¹⁷/17! = 6e-17, and what each of some
/// twenty roundings of terms below one moves.
inline constexpr double sine_error = 0x1p-48;
inline constexpr double largest_angle = 1e5;
[[nodiscard]] inline std::pair<double, double> sine_and_cosine(double x) noexcept {
  constexpr double first = 0x1.921fb544p+0;
  constexpr double second = 0x1.0b4611a6p-34;
  constexpr double third = 0x1.3198a2e037073p-69;
  const double k = std::nearbyint(x * 0x1.45f306dc9c883p-1);
  const double r = ((x - k * first) - k * second) - k * third;
  const double s = r * r;
  const double sine =
      r * (1.0 +
           s * (-1.0 / 6.0 +
                s * (1.0 / 120.0 + s * (-1.0 / 5040.0 +
                                        s * (1.0 / 362880.0 + s * (-1.0 / 39916800.0 +
                                                                   s * (1.0 / 6227020800.0 -
                                                                        s / 1307674368000.0)))))));
  const double cosine =
      1.0 +
      s * (-0.5 + s * (1.0 / 24.0 +
                       s * (-1.0 / 720.0 +
                            s * (1.0 / 40320.0 +
                                 s * (-1.0 / 3628800.0 +
                                      s * (1.0 / 479001600.0 +
                                           s * (-1.0 / 87178291200.0 + s / 20922789888000.0)))))));
  switch (static_cast<int>(k - 4.0 * std::floor(0.25 * k))) {
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    case 3:
      return {-cosine, sine};
    default:
      return {sine, cosine};
  }
}

/// sin over an interval; `quarters` turns it on by so many right angles (1: cos).
[[nodiscard]] inline Interval sine(const Interval& x, int quarters) noexcept {
  if (!(std::abs(x.low) <= largest_angle) || !(std::abs(x.high) <= largest_angle)) {
    return {-1.0, 1.0};
  }
  const auto at = [&](double angle) {
    const auto [s, c] = sine_and_cosine(angle);
    return quarters == 0 ? s : c;
  };
  const double from = at(x.low);
  const double to = at(x.high);
  Interval range(std::max(-1.0, std::min(from, to) - sine_error),
                 std::min(1.0, std::max(from, to) + sine_error));
  // Tops at π/2 (1 + 4 k), bottoms at π/2 (3 + 4 k), less a quarter for each of `quarters`; one
  // that is met within rounding counts.
  constexpr double quarter = 1.57079632679489661923;
  constexpr double slack = 1e-9;
  const double low = (x.low / quarter) + quarters - slack;
  const double high = (x.high / quarter) + quarters + slack;
  const auto meets = [&](double place) {
    return std::floor((high - place) / 4.0) >= std::ceil((low - place) / 4.0);
  };
  if (meets(1.0)) {
    range.high = 1.0;
  }
  if (meets(3.0)) {
    range.low = -1.0;
  }
  return range;
}

/// Of an increasing function of the C library, which is taken to err by less than eight units in
/// the last place.
template <class Function>
[[nodiscard]] Interval increasing(const Interval& x, const Function& f) noexcept {
  const double low = f(x.low);
  const double high = f(x.high);
  constexpr double error = 16.0 * unit_roundoff;
  const Interval range(low - error * std::abs(low) - underflow,
                       high + error * std::abs(high) + underflow);
  return is_bounded(x) && is_bounded(range) ? range : anything;
}

[[nodiscard]] inline Interval root(const Interval& x) noexcept {
  if (!(x.low >= 0.0) || !is_bounded(x)) {
    return anything;
  }
  return {std::max(0.0, rounded_down(std::sqrt(x.low))), rounded_up(std::sqrt(x.high))};
}
[[nodiscard]] inline Interval exponential(const Interval& x) noexcept {
  const Interval range(exp(x.low).low, exp(x.high).high);
  return is_bounded(x) && is_bounded(range) ? range : anything;
}
[[nodiscard]] inline Interval logarithm(const Interval& x) noexcept {
  return x.low > 0.0 ? increasing(x, [](double y) { return std::log(y); }) : anything;
}
/// Of a truth that is known or not.
[[nodiscard]] inline Interval truth(bool surely, bool possibly) noexcept {
  return {surely ? 1.0 : 0.0, possibly ? 1.0 : 0.0};
}

/// A tape's operation. Operands that it does not have are not looked at.
[[nodiscard]] inline Interval apply_interval(expression::Operation operation, const Interval& a,
                                             const Interval& b, const Interval& c) noexcept {
  using expression::Operation;
  const auto within = [](const Interval& x, double low, double high) {
    return x.low >= low && x.high <= high;
  };
  switch (operation) {
    case Operation::constant:
    case Operation::parameter:
    case Operation::input:
      return a;
    case Operation::add:
      return is_bounded(a) && is_bounded(b) ? a + b : anything;
    case Operation::subtract:
      return is_bounded(a) && is_bounded(b) ? a - b : anything;
    case Operation::multiply:
      return product(a, b);
    case Operation::chain:
      return product(a, b);
    case Operation::divide:
      return quotient(a, b);
    case Operation::negate:
      return -a;
    case Operation::power:
      if (b.low == b.high && b.low == 2.0) {
        return is_bounded(a) ? square(a) : anything;
      }
      return a.low > 0.0 ? exponential(product(b, logarithm(a))) : anything;
    case Operation::sin:
      return sine(a, 0);
    case Operation::cos:
      return sine(a, 1);
    case Operation::tan:
      return quotient(sine(a, 0), sine(a, 1));
    case Operation::asin:
      return within(a, -1.0, 1.0) ? increasing(a, [](double x) { return std::asin(x); }) : anything;
    case Operation::acos:
      return within(a, -1.0, 1.0) ? increasing(-a, [](double x) { return std::acos(-x); })
                                  : anything;
    case Operation::atan:
      return increasing(a, [](double x) { return std::atan(x); });
    case Operation::sinh:
      return increasing(a, [](double x) { return std::sinh(x); });
    case Operation::cosh:
      return root(Interval(1.0) + square(increasing(a, [](double x) { return std::sinh(x); })));
    case Operation::tanh:
      return increasing(a, [](double x) { return std::tanh(x); });
    case Operation::asinh:
      return increasing(a, [](double x) { return std::asinh(x); });
    case Operation::exp:
      return exponential(a);
    case Operation::expm1:
      return increasing(a, [](double x) { return std::expm1(x); });
    case Operation::log:
      return logarithm(a);
    case Operation::log1p:
      return a.low > -1.0 ? increasing(a, [](double x) { return std::log1p(x); }) : anything;
    case Operation::log2:
      return a.low > 0.0 ? increasing(a, [](double x) { return std::log2(x); }) : anything;
    case Operation::log10:
      return a.low > 0.0 ? increasing(a, [](double x) { return std::log10(x); }) : anything;
    case Operation::sqrt:
      return root(a);
    case Operation::cbrt:
      return increasing(a, [](double x) { return std::cbrt(x); });
    case Operation::erf:
      return increasing(a, [](double x) { return std::erf(x); });
    case Operation::abs:
      return {a.contains(0.0) ? 0.0 : std::min(std::abs(a.low), std::abs(a.high)), a.magnitude()};
    case Operation::sign:
      return {a.low > 0.0   ? 1.0
              : a.low < 0.0 ? -1.0
                            : 0.0,
              a.high > 0.0   ? 1.0
              : a.high < 0.0 ? -1.0
                             : 0.0};
    case Operation::floor:
      return {std::floor(a.low), std::floor(a.high)};
    case Operation::ceil:
      return {std::ceil(a.low), std::ceil(a.high)};
    case Operation::round:
      return {std::round(a.low), std::round(a.high)};
    case Operation::hypot:
      return root(square(a) + square(b));
    case Operation::minimum:
      return {std::min(a.low, b.low), std::min(a.high, b.high)};
    case Operation::maximum:
      return {std::max(a.low, b.low), std::max(a.high, b.high)};
    case Operation::less:
      return truth(a.high < b.low, a.low < b.high);
    case Operation::less_equal:
      return truth(a.high <= b.low, a.low <= b.high);
    case Operation::equal:
      return truth(a.low == a.high && b.low == b.high && a.low == b.low,
                   a.low <= b.high && b.low <= a.high);
    case Operation::not_equal:
      return truth(a.high < b.low || b.high < a.low,
                   !(a.low == a.high && b.low == b.high && a.low == b.low));
    case Operation::logical_and:
      return truth(!a.contains(0.0) && !b.contains(0.0),
                   (a.low != 0.0 || a.high != 0.0) && (b.low != 0.0 || b.high != 0.0));
    case Operation::logical_or:
      return truth(!a.contains(0.0) || !b.contains(0.0),
                   a.low != 0.0 || a.high != 0.0 || b.low != 0.0 || b.high != 0.0);
    case Operation::logical_not:
      return truth(a.low == 0.0 && a.high == 0.0, a.contains(0.0));
    case Operation::select:
      return !a.contains(0.0) ? b : a.low == 0.0 && a.high == 0.0 ? c : hull(b, c);
    case Operation::atan2:
      // The angle of (x, y) = (b, a), right of the y axis.
      return b.low > 0.0 ? increasing(quotient(a, b), [](double x) { return std::atan(x); })
                         : Interval(-3.2, 3.2);
    case Operation::acosh:
    case Operation::atanh:
    case Operation::modulo:
    case Operation::remainder:
      return anything;
  }
  return anything;
}

}  // namespace flyball::detail
