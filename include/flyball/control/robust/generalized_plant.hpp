#pragma once

#include <optional>

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// A plant as robust control sees it: from disturbances w and controls u to errors z, which are to
/// stay small, and measurements y, which the controller is given,
///
///   [z; y] = P [w; u],  u = K y.
template <class System = ContinuousSystem<>>
struct GeneralizedPlant {
  System system;                  ///< Inputs [w; u], outputs [z; y].
  Eigen::Index measurements = 0;  ///< y, the last outputs.
  Eigen::Index controls = 0;      ///< u, the last inputs.
};

/// The loop closed, F_l(P, K) = P₁₁ + P₁₂ K (I - P₂₂ K)⁻¹ P₂₁ from w to z. The states are the
/// plant's, then the controller's.
/// @param controller  From y to u; a static gain has no states.
/// @errors ArgumentError for shapes and entries, out_of_range for the counts;
///         SystemError::period_mismatch, algebraic_loop where I - D₂₂ D_K is singular.
/// Cost: O(n³), allocates. Source: Zhou, Doyle and Glover, "Robust and Optimal Control", chapter
/// 10.
[[nodiscard]] Expected<ContinuousSystem<>> lower_fractional(
    const GeneralizedPlant<ContinuousSystem<>>& plant, const ContinuousSystem<>& controller);
[[nodiscard]] Expected<DiscreteSystem<>> lower_fractional(
    const GeneralizedPlant<DiscreteSystem<>>& plant, const DiscreteSystem<>& controller);

/// What a loop is to be good at, as frequency responses: W₁ is large where the error is to be
/// small, W₂ where the input is to be small, W₃ where the output is to follow little. One that is
/// left out does not count; one of a single input and output counts for every channel.
template <class System = ContinuousSystem<>>
struct SensitivityWeights {
  std::optional<System> error{};   ///< W₁, on S.
  std::optional<System> input{};   ///< W₂, on K S.
  std::optional<System> output{};  ///< W₃, on T.
};

/// The generalised plant of the mixed-sensitivity problem, F_l(P, K) = [W₁ S; W₂ K S; W₃ T] with
/// S = (I + GK)⁻¹, T = I - S: w is the reference, y = w - G u the control error. G is in it once.
/// @errors ArgumentError for shapes and entries, empty without a weight;
///         SystemError::period_mismatch. Cost: some products of matrices; allocates.
/// Source: Skogestad and Postlethwaite, "Multivariable Feedback Control", section 9.3.6.
[[nodiscard]] Expected<GeneralizedPlant<ContinuousSystem<>>> mixed_sensitivity_plant(
    const ContinuousSystem<>& plant, const SensitivityWeights<ContinuousSystem<>>& weights);
[[nodiscard]] Expected<GeneralizedPlant<DiscreteSystem<>>> mixed_sensitivity_plant(
    const DiscreteSystem<>& plant, const SensitivityWeights<DiscreteSystem<>>& weights);

}  // namespace flyball
