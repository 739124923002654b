#pragma once

#include <Eigen/Core>

namespace flyball {

/// The largest number that a run-time object takes for one, in the unit of whatever it is.
///
/// Nothing that a robot measures or is told comes near it. What is beyond it counts as not finite,
/// as NaN does: it is left out before it can overflow a product, and no state that is kept from one
/// period to the next is ever beyond it.
inline constexpr double largest_signal = 1e100;

/// Whether |value| <= largest_signal; false for NaN.
[[nodiscard]] constexpr bool is_signal(double value) noexcept {
  return __builtin_fabs(value) <= largest_signal;
}
/// Whether that holds for every entry.
template <class Derived>
[[nodiscard]] bool is_signal(const Eigen::MatrixBase<Derived>& values) noexcept {
  bool all = true;
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      all = all & is_signal(values(i, j));
    }
  }
  return all;
}

namespace detail {

/// The value, or zero for what is not a signal.
[[nodiscard]] constexpr double signal_or_zero(double value) noexcept {
  return is_signal(value) ? value : 0.0;
}
/// Entries that are not signals become zero.
template <class Derived>
void keep_signals(Eigen::MatrixBase<Derived>& values) noexcept {
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    values(i) = signal_or_zero(values(i));
  }
}

/// The value cut to a signal; NaN is zero.
[[nodiscard]] constexpr double cut(double value) noexcept {
  return value > largest_signal    ? largest_signal
         : value < -largest_signal ? -largest_signal
         : value == value          ? value
                                   : 0.0;
}

/// An input within its limits, of which infinite ones count as largest_signal; NaN is the one
/// nearest to zero.
[[nodiscard]] constexpr double limited(double value, double low, double high) noexcept {
  const double within = value < low ? low : value > high ? high : value;
  if (is_signal(within)) {
    return within;
  }
  const double wanted = cut(value);
  return wanted < low ? low : wanted > high ? high : wanted;
}

}  // namespace detail

}  // namespace flyball
