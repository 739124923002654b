#pragma once

#include <string_view>

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// How a continuous system becomes a discrete one: what s is as a function of z, or what the input
/// does between samples.
enum class ConversionMethod {
  zoh,             ///< The input is held: exact for a plant behind a digital controller (7.3.3).
  foh,             ///< The input is a straight line between samples: exact for ramps.
  tustin,          ///< Bilinear, s = (2/T)(z - 1)/(z + 1) (Table 7.2); stability is preserved.
  forward_euler,   ///< s = (z - 1)/T (Table 7.2).
  backward_euler,  ///< s = (z - 1)/(T z) (Table 7.2).
  matched,  ///< Poles and zeros map by z = e^{sT}, the gain at s = 0 stays (one input, one output).
};

/// "zoh", "foh", "tustin", "forward-euler", "backward-euler", "matched".
[[nodiscard]] std::string_view to_string(ConversionMethod method);

/// The method of that name. @errors ArgumentError::unknown_name with the nearest name as hint.
[[nodiscard]] Expected<ConversionMethod> parse_conversion_method(std::string_view name);

/// A continuous system as a discrete one of the period T; the transfer functions are
///   zoh             (1 - z⁻¹) Z{G(s)/s}, A_d = e^{AT} and B_d = ∫₀ᵀ e^{Aτ} dτ B; C and D stay
///   foh             (z - 1)²/(T z) Z{G(s)/s²}; the states are x - T φ₂(AT) B u
///   tustin, euler   G(s(z)) exactly
///   matched         zeros e^{zᵢT}, poles e^{pᵢT}, a zero at z = -1 for each zero at infinity but
///                   one, and G_d(1) = G(0) (factors at the origin by z - 1 ≈ s T); its states are
///                   new: first- and second-order sections in series.
///
/// @param system   Continuous. matched: one input, one output.
/// @param period   T, s.
/// @param method   What is to stay exact.
/// @param prewarp  rad/s, tustin alone: the frequency at which G_d(e^{jωT}) = G(jω), by
///                 s = ω/tan(ωT/2) (z - 1)/(z + 1). Zero: none. Below π/T.
/// @return The system of as many states.
/// @errors ArgumentError for shapes, entries, period and prewarp; SystemError::no_image with the
///         eigenvalue where I - A T/2 (tustin) or I - A T (backward Euler) is singular, or with
///         the zero whose image exceeds 1e130 (matched); SystemError::zero_transfer (matched);
///         MatrixExponentialError::overflow.
/// Cost: O(n³), allocates.
/// Source: book, Tables 7.2 and E.3; foh and matched: Franklin, Powell and Workman, "Digital
/// Control of Dynamic Systems", 3rd ed., sections 6.1 and 6.3.
[[nodiscard]] Expected<DiscreteSystem<>> convert_to_discrete(
    const ContinuousSystem<>& system, Time period, ConversionMethod method,
    AngularVelocity prewarp = AngularVelocity(0.0));

/// The continuous system of which `convert_to_discrete` makes this one: its inverse, by the
/// principal logarithm for zoh, foh and matched.
///
/// matched: zeros within rounding of z = -1 count as zeros at infinity.
///
/// @errors ArgumentError as above; MatrixFunctionError::no_real_logarithm (zoh, foh) for an
///         eigenvalue of A on the closed negative real axis, which no real continuous system has;
///         SystemError::no_image for an eigenvalue -1 (tustin), 0 (backward Euler), or a pole or
///         zero on the closed negative real axis (matched).
[[nodiscard]] Expected<ContinuousSystem<>> convert_to_continuous(
    const DiscreteSystem<>& system, ConversionMethod method,
    AngularVelocity prewarp = AngularVelocity(0.0));

/// `convert_to_discrete` of a system of any size; without a method it is zero-order hold
/// (`discretize.hpp`).
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<DiscreteSystem<States, Inputs, Outputs>> discretize(
    const ContinuousSystem<States, Inputs, Outputs>& system, Time period, ConversionMethod method,
    AngularVelocity prewarp = AngularVelocity(0.0)) {
  return convert_to_discrete({system.A, system.B, system.C, system.D}, period, method, prewarp)
      .map([](const DiscreteSystem<>& d) {
        return DiscreteSystem<States, Inputs, Outputs>{d.A, d.B, d.C, d.D, d.period};
      });
}

/// `convert_to_continuous` of a system of any size.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<ContinuousSystem<States, Inputs, Outputs>> undiscretize(
    const DiscreteSystem<States, Inputs, Outputs>& system, ConversionMethod method,
    AngularVelocity prewarp = AngularVelocity(0.0)) {
  return convert_to_continuous({system.A, system.B, system.C, system.D, system.period}, method,
                               prewarp)
      .map([](const ContinuousSystem<>& c) {
        return ContinuousSystem<States, Inputs, Outputs>{c.A, c.B, c.C, c.D};
      });
}

}  // namespace flyball
