#pragma once

#include <complex>
#include <span>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball {

/// Poles that have something in common, in the s-plane and, sampled, in the z-plane: z = e^{sT}.
struct PlaneCurve {
  double value = 0.0;                   ///< What they have in common: ζ, or ω_n in rad/s.
  std::vector<std::complex<double>> s;  ///< 1/s
  std::vector<std::complex<double>> z;
};

/// The upper halves of the curves of constant damping: rays s = ω_n (-ζ + j√(1 - ζ²)) from the
/// origin up to Nyquist's frequency Im s = π/T, logarithmic spirals from z = 1 to the negative real
/// axis; of ζ = 1 the real axis, up to e⁻²ᵖⁱ.
/// @param damping_ratios  ζ in [0, 1]. @param period  T, s. @param points  On each, 2 at least.
/// @errors ArgumentError::out_of_range, not_positive. Cost: O(curves points), allocates.
/// Source: book, sections 7.1 and E.4; Franklin, Powell and Workman, figure 4.12.
[[nodiscard]] Expected<std::vector<PlaneCurve>> damping_curves(
    std::span<const double> damping_ratios, Time period, int points = 200);

/// The upper halves of the curves of constant natural frequency: arcs s = ω_n e^{jφ}, φ from π/2,
/// or where Im s = π/T, to π; in the z-plane they stand upright on the spirals.
/// @param frequencies  ω_n > 0, rad/s. @errors As above.
[[nodiscard]] Expected<std::vector<PlaneCurve>> frequency_curves(
    std::span<const double> frequencies, Time period, int points = 200);

}  // namespace flyball
