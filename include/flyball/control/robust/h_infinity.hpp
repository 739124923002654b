#pragma once

#include <flyball/control/robust/generalized_plant.hpp>

namespace flyball {

/// Why a robust synthesis has no controller, or found none.
enum class SynthesisError {
  not_stabilizable,           ///< A mode that does not decay is moved by no control.
  not_detectable,             ///< A mode that does not decay is seen by no measurement.
  control_without_weight,     ///< D₁₂ has not full column rank: a control costs nothing at high
                              ///< frequencies.
  measurement_without_noise,  ///< D₂₁ has not full row rank: a measurement is exact at high ones.
  control_zero_on_axis,       ///< P₁₂ has an invariant zero on the border of stability.
  measurement_zero_on_axis,   ///< P₂₁ has one.
  level_not_reached,          ///< No controller reaches the γ that was asked for.
  direct_disturbance,         ///< H₂: D₁₁ is not zero, so that white noise has infinite power in z.
  not_verified,               ///< What was computed does not do what it should.
};
[[nodiscard]] ErrorInfo error_info(SynthesisError code);

/// A controller u = K y, and what it does.
template <class System = ContinuousSystem<>>
struct RobustDesign {
  System controller;
  System closed_loop;      ///< F_l(P, K), from w to z.
  Eigen::VectorXcd poles;  ///< Of the closed loop.
  double gamma = 0.0;      ///< Its norm, computed of `closed_loop`: ‖F_l(P, K)‖∞, or ‖·‖₂.
  double frequency = 0.0;  ///< rad/s, where the H∞ norm is reached; ∞ if at infinity, 0 for H₂.
  /// Between these the least γ of all controllers is; of H₂ both are γ, with a γ that was given
  /// the lower one is zero.
  double least_low = 0.0;
  double least_high = 0.0;
};

/// What an H∞ synthesis aims at.
struct HInfinityOptions {
  double gamma = 0.0;       ///< The level to stay under; zero for the least there is.
  double tolerance = 1e-3;  ///< How far above the least the controller's level may be, relative:
                            ///< nearer ones have ever faster poles.
};

/// A controller that stabilises the plant and keeps ‖F_l(P, K)‖∞ below γ: the central one of
/// Glover and Doyle, of as many states as the plant, by two Riccati equations; any D₁₁ and D₂₂
/// (D₁₂ and D₂₁ are brought to units, the loop is shifted by D₂₂). The least γ is found by halving,
/// and the answer's γ is the norm of its closed loop, computed anew. A discrete plant takes the
/// bilinear transform, which keeps norms and stability.
/// @param plant  One measurement and one control at least.
/// @errors ArgumentError; SynthesisError with the mode, the rank or the zero that is in the way, or
///         with the least γ; SystemError::no_image where the bilinear transform has none,
///         algebraic_loop. Cost: some sixty Riccati equations of order n; allocates.
/// Source: Glover and Doyle, Systems & Control Letters 11 (1988); Zhou, Doyle and Glover, "Robust
/// and Optimal Control", chapters 16 and 17.
[[nodiscard]] Expected<RobustDesign<ContinuousSystem<>>> h_infinity_synthesis(
    const GeneralizedPlant<ContinuousSystem<>>& plant, const HInfinityOptions& options = {});
[[nodiscard]] Expected<RobustDesign<DiscreteSystem<>>> h_infinity_synthesis(
    const GeneralizedPlant<DiscreteSystem<>>& plant, const HInfinityOptions& options = {});

/// The controller of the mixed-sensitivity problem, u = K (r - y): ‖[W₁S; W₂KS; W₃T]‖∞ least.
/// @errors As `mixed_sensitivity_plant` and `h_infinity_synthesis`: poles of the weights and of G
/// on the imaginary axis are none that K could move, or zeros of P₂₁; move them a little to the
/// left. Source: Kwakernaak, Automatica 29 (1993); Skogestad and Postlethwaite, section 9.3.
[[nodiscard]] Expected<RobustDesign<ContinuousSystem<>>> mixed_sensitivity(
    const ContinuousSystem<>& plant, const SensitivityWeights<ContinuousSystem<>>& weights,
    const HInfinityOptions& options = {});
[[nodiscard]] Expected<RobustDesign<DiscreteSystem<>>> mixed_sensitivity(
    const DiscreteSystem<>& plant, const SensitivityWeights<DiscreteSystem<>>& weights,
    const HInfinityOptions& options = {});

/// The controller under which white noise w has least power in z: ‖F_l(P, K)‖₂ least. It is an
/// observer and a state feedback, each of a Riccati equation; D₂₂ is shifted away.
/// @param plant  D₁₁ = 0. @errors As `h_infinity_synthesis`; SynthesisError::direct_disturbance.
/// Cost: two Riccati equations; allocates.
/// Source: Zhou, Doyle and Glover, section 14.5; book, section 9.6.5, whose LQG is a case of
/// it.
[[nodiscard]] Expected<RobustDesign<ContinuousSystem<>>> h2_synthesis(
    const GeneralizedPlant<ContinuousSystem<>>& plant);

}  // namespace flyball
