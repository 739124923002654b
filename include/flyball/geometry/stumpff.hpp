#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace flyball::detail {

/// 1/(2k + M)!, k = 0, 1, ..., with the signs of the powers of -s.
template <int M, int Terms>
inline constexpr auto stumpff_coefficients = [] {
  std::array<double, Terms> all{};
  double factorial = 1.0;
  for (int i = 2; i <= M; ++i) {
    factorial *= i;
  }
  double sign = 1.0;
  for (int k = 0; k < Terms; ++k) {
    all[static_cast<std::size_t>(k)] = sign / factorial;
    sign = -sign;
    factorial *= (2 * k + M + 1.0) * (2 * k + M + 2.0);
  }
  return all;
}();

/// Below this the functions are their series: the truncation is less than 1e-17 of the value, and
/// above it the closed form loses no more than a few roundings, its derivatives included.
template <int M>
inline constexpr double stumpff_series_below = M <= 2 ? 0.25 : 4.0;

/// The Stumpff function c_M(s) = Σ (-s)^k/(2k + M)! of the square s = θ² >= 0 of an angle. They are
/// everything that exponentials of rotations and poses, and their Jacobians, are made of, and
/// analytic in s, also where θ = √s has no derivative:
///
///     c_0 = cos θ,  c_1 = sin θ/θ,  c_2 = (1 - cos θ)/θ²,  c_3 = (θ - sin θ)/θ³,
///     c_{M+2} = (1/M! - c_M)/s.
///
/// To double precision. Source: Stumpff, "Himmelsmechanik" I (1959), section 41.
template <int M, class Scalar>
[[nodiscard]] Scalar stumpff(const Scalar& s) noexcept {
  static_assert(0 <= M && M <= 5);
  using std::cos, std::sin, std::sqrt;
  if (s < static_cast<Scalar>(stumpff_series_below<M>)) {
    // The first term left out is at most 0.25^7/15! (c_1), 0.25^8/16! (c_0), 4^11/25! (c_3).
    constexpr int terms = M == 0 ? 8 : M <= 2 ? 7 : 11;
    constexpr const auto& a = stumpff_coefficients<M, terms>;
    Scalar sum = static_cast<Scalar>(a[terms - 1]);
    for (int k = terms - 2; k >= 0; --k) {
      sum = sum * s + static_cast<Scalar>(a[static_cast<std::size_t>(k)]);
    }
    return sum;
  }
  if constexpr (M == 0) {
    return cos(sqrt(s));
  } else if constexpr (M == 1) {
    const Scalar theta = sqrt(s);
    return sin(theta) / theta;
  } else if constexpr (M == 2) {
    const Scalar h = sin(sqrt(s) * Scalar(0.5));
    return Scalar(2.0) * h * h / s;  // 1 - cos θ = 2 sin²(θ/2)
  } else {
    return (static_cast<Scalar>(stumpff_coefficients<M - 2, 1>[0]) - stumpff<M - 2>(s)) / s;
  }
}

/// (1 - (θ/2) cot(θ/2))/θ², the coefficient of the inverse Jacobian of rotations; 1/12 at 0.
template <class Scalar>
[[nodiscard]] Scalar inverse_jacobian_coefficient(const Scalar& s) noexcept {
  // (θ/2) cot(θ/2) = c_1/(2 c_2), and 2 c_2 - c_1 = s (c_3 - 2 c_4)
  return (stumpff<3>(s) - Scalar(2.0) * stumpff<4>(s)) / (Scalar(2.0) * stumpff<2>(s));
}

}  // namespace flyball::detail
