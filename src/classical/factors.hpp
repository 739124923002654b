#pragma once

#include <vector>

#include <flyball/classical/frequency_response.hpp>

/// What the factors of a transfer function tell of its response without evaluating it.
namespace flyball::classical::detail {

/// A root as a point of the s plane: itself, or ln(z)/T; nothing for z = 0.
[[nodiscard]] std::optional<std::complex<double>> in_s(std::complex<double> root,
                                                       const std::optional<Time>& period);

/// Whether a root is on the axis, or the circle, to rounding.
[[nodiscard]] bool on_axis(std::complex<double> root, const std::optional<Time>& period);

/// How far ln G can move between two frequencies at most, gain and phase together: the sum of
/// ∫dω/|jω - r| over the roots and of what the delay turns. Infinite across a root on the axis.
[[nodiscard]] double variation(const Factors& factors, double from, double to,
                               const std::optional<Time>& period);

/// Of a loop's poles and zeros with the magnitude and the sign of its asymptote at ω → 0,
/// K (jω)^{-integrators}.
struct Asymptote {
  int integrators = 0;
  bool negative = false;
  double log_gain = 0.0;  ///< ln |K|
};
[[nodiscard]] Asymptote low_asymptote(const Factors& factors, const std::optional<Time>& period);

}  // namespace flyball::classical::detail
