#pragma once

#include <array>

#include "math/verified/interval.hpp"

namespace flyball::detail {

/// How many parameters a form can depend on.
inline constexpr int most_parameters = 6;
/// Products of two of them.
inline constexpr int most_squares = most_parameters * (most_parameters + 1) / 2;
/// Where ε_i ε_j, i <= j, stands among them.
[[nodiscard]] constexpr std::size_t square_index(std::size_t i, std::size_t j) noexcept {
  return j * (j + 1) / 2 + i;
}

/// What is known of a quantity over a box of parameters: a Taylor model of second order,
///   x = centre + Σ slope_i ε_i + Σ_{i<=j} square_ij ε_i ε_j + e  for every |ε_i| <= 1,
/// with some |e| <= radius, which holds what is left of products and functions, of the third order,
/// and all rounding.
/// Source: Makino and Berz, "Taylor models and other validated functional inclusion methods", Int.
/// J. Pure Appl. Math. 4 (2003).
struct TaylorForm {
  double centre = 0.0;
  std::array<double, most_parameters> slope{};
  std::array<double, most_squares> square{};
  double radius = 0.0;

  TaylorForm() = default;
  constexpr TaylorForm(double value) noexcept : centre(value) {}  // NOLINT

  /// The i-th parameter itself: middle + half ε_i.
  [[nodiscard]] static TaylorForm parameter(int i, double middle, double half) noexcept {
    TaylorForm x(middle);
    x.slope[static_cast<std::size_t>(i)] = half;
    return x;
  }
  /// Anything between two numbers.
  [[nodiscard]] static TaylorForm between(const Interval& range) noexcept {
    TaylorForm x(0.5 * range.low + 0.5 * range.high);
    x.radius = std::max(rounded_up(range.high - x.centre), rounded_up(x.centre - range.low));
    return x;
  }

  /// Σ |slope_i| and Σ |square_ij|, rounded up.
  [[nodiscard]] double first_order() const noexcept { return sum_of(slope); }
  [[nodiscard]] double second_order() const noexcept { return sum_of(square); }
  /// max |x - centre|.
  [[nodiscard]] double deviation() const noexcept {
    return (first_order() + second_order() + radius) * inflation;
  }
  [[nodiscard]] Interval range() const noexcept {
    const double reach = deviation();
    return {rounded_down(centre - reach), rounded_up(centre + reach)};
  }
  [[nodiscard]] double magnitude() const noexcept {
    return (std::abs(centre) + deviation()) * inflation;
  }
  TaylorForm& widen(double by) noexcept {
    radius = (radius + by) * inflation;
    return *this;
  }

 private:
  template <class Terms>
  [[nodiscard]] static double sum_of(const Terms& terms) noexcept {
    double sum = 0.0;
    for (const double term : terms) {
      sum += std::abs(term);
    }
    return sum * inflation;
  }
};

[[nodiscard]] inline TaylorForm operator-(TaylorForm x) noexcept {
  x.centre = -x.centre;
  for (double& s : x.slope) {
    s = -s;
  }
  for (double& s : x.square) {
    s = -s;
  }
  return x;
}

[[nodiscard]] inline TaylorForm operator+(const TaylorForm& x, const TaylorForm& y) noexcept {
  TaylorForm z(x.centre + y.centre);
  double rounded = std::abs(z.centre);
  for (std::size_t i = 0; i < z.slope.size(); ++i) {
    z.slope[i] = x.slope[i] + y.slope[i];
    rounded += std::abs(z.slope[i]);
  }
  for (std::size_t i = 0; i < z.square.size(); ++i) {
    z.square[i] = x.square[i] + y.square[i];
    rounded += std::abs(z.square[i]);
  }
  z.radius = (x.radius + y.radius + unit_roundoff * rounded + underflow) * inflation;
  return z;
}

[[nodiscard]] inline TaylorForm operator-(const TaylorForm& x, const TaylorForm& y) noexcept {
  return x + -y;
}

[[nodiscard]] inline TaylorForm operator*(const TaylorForm& x, const TaylorForm& y) noexcept {
  TaylorForm z(x.centre * y.centre);
  double rounded = std::abs(z.centre);  // five roundings of each term at most
  for (std::size_t i = 0; i < z.slope.size(); ++i) {
    const double left = x.centre * y.slope[i];
    const double right = x.slope[i] * y.centre;
    z.slope[i] = left + right;
    rounded += std::abs(left) + std::abs(right);
  }
  for (std::size_t j = 0; j < z.slope.size(); ++j) {
    for (std::size_t i = 0; i <= j; ++i) {
      const std::size_t k = square_index(i, j);
      const double left = x.centre * y.square[k];
      const double right = x.square[k] * y.centre;
      const double one = x.slope[i] * y.slope[j];
      const double other = i == j ? 0.0 : x.slope[j] * y.slope[i];
      z.square[k] = (left + right) + (one + other);
      rounded += std::abs(left) + std::abs(right) + std::abs(one) + std::abs(other);
    }
  }
  const double x_1 = x.first_order();
  const double y_1 = y.first_order();
  const double x_2 = x.second_order();
  const double y_2 = y.second_order();
  z.radius = (std::abs(x.centre) * y.radius + x.radius * std::abs(y.centre) +
              x_1 * (y_2 + y.radius) + x_2 * (y_1 + y_2 + y.radius) +
              x.radius * (y_1 + y_2 + y.radius) + 6.0 * unit_roundoff * rounded + underflow) *
             inflation;
  return z;
}

/// x / k. @param k  Not zero.
[[nodiscard]] inline TaylorForm operator/(const TaylorForm& x, double k) noexcept {
  TaylorForm z(x.centre / k);
  double rounded = std::abs(z.centre);
  for (std::size_t i = 0; i < z.slope.size(); ++i) {
    z.slope[i] = x.slope[i] / k;
    rounded += std::abs(z.slope[i]);
  }
  for (std::size_t i = 0; i < z.square.size(); ++i) {
    z.square[i] = x.square[i] / k;
    rounded += std::abs(z.square[i]);
  }
  z.radius = (x.radius / std::abs(k) + unit_roundoff * rounded + underflow) * inflation;
  return z;
}

/// f(x) from enclosures of f, f' and f''/2 at the centre, and no less than a sixth of the third
/// derivative's magnitude over the range.
[[nodiscard]] inline TaylorForm applied(const TaylorForm& x, const Interval& value,
                                        const Interval& derivative, const Interval& half_second,
                                        double third) noexcept {
  TaylorForm offset = x;
  offset.centre = 0.0;
  const double reach = x.deviation();
  TaylorForm result = TaylorForm::between(value) + TaylorForm::between(derivative) * offset +
                      TaylorForm::between(half_second) * (offset * offset);
  return result.widen(rounded_up(rounded_up(rounded_up(reach * reach) * reach) * third));
}

/// 1/x. @param x  Without zero: see `separated_from_zero`.
[[nodiscard]] inline TaylorForm reciprocal(const TaylorForm& x) noexcept {
  const Interval range = x.range();
  const double least = std::min(std::abs(range.low), std::abs(range.high));
  const Interval inverse = Interval(1.0) / Interval(x.centre);
  // 1/x = 1/c - δ/c² + δ²/c³ - δ³/(c³ x), δ = x - c
  const Interval squared = inverse * inverse;
  const Interval cubed = squared * inverse;
  return applied(x, inverse, -squared, cubed, (Interval(cubed.magnitude()) / Interval(least)).high);
}

[[nodiscard]] inline bool separated_from_zero(const TaylorForm& x) noexcept {
  const Interval range = x.range();
  return range.low > 0.0 || range.high < 0.0;
}

/// eˣ.
[[nodiscard]] inline TaylorForm exp(const TaylorForm& x) noexcept {
  const Interval range = x.range();
  const Interval all(exp(range.low).low, exp(range.high).high);
  const Interval at = exp(x.centre);
  TaylorForm curve = applied(x, at, at, Interval(0.5) * at, rounded_up(all.high / 6.0));
  // Where the curve says less than the range, such as for e^(-1/x) near 0, the range is taken.
  const TaylorForm flat = TaylorForm::between(all);
  return curve.radius < flat.radius ? curve : flat;
}

}  // namespace flyball::detail
