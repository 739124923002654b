#pragma once

#include <vector>

#include <flyball/classical/loop_margins.hpp>
#include <flyball/systems/norms.hpp>

namespace flyball::classical {

/// How far a square loop (I + L)⁻¹ is from instability.
struct MimoMargins {
  bool stable = false;
  /// Each channel opened with the others closed: what changes in one alone it bears.
  std::vector<LoopMargins> loop_at_a_time{};
  /// α: all channels may change at once, each by a factor of its own in the disk with the diameter
  /// [(2 - α)/(2 + α), (2 + α)/(2 - α)]; 0 of an unstable loop. It is 2 over the largest
  /// min over diagonal D of σ(D (S - T) D⁻¹), the structured singular value's upper bound, which is
  /// the value itself for three channels at most; the largest over a grid of frequencies, refined.
  double disk_margin = 0.0;
  double disk_frequency = 0.0;  ///< rad/s, where it is.
  /// 2/‖S - T‖∞, for factors that mix the channels too: no frequency is missed.
  double full_disk_margin = 0.0;
  Peak sensitivity{};    ///< σ of S = (I + L)⁻¹, over the frequencies, stable or not.
  Peak complementary{};  ///< σ of T = L(I + L)⁻¹.
};

/// Margins at the output of a plant are those of L = G K, at its input those of L = K G.
/// @param loop  L, as many outputs as inputs.
/// @errors ArgumentError for the system, wrong_shape; SystemError::algebraic_loop where I + D has
/// no inverse; not_stable where a closed-loop pole lies on the axis.
/// Cost: for D at most 150 000 norms of m x m matrices, of m > 4 channels as many as take as long;
/// where the search ends there the margin may be less than it could be. Source: Seiler, Packard and
/// Gahinet, "An introduction to disk margins", IEEE Control Systems Magazine 40 (2020); Blight,
/// Dailey and Gangsaas, Int. J. Control 59 (1994).
[[nodiscard]] Expected<MimoMargins> mimo_margins(const ContinuousSystem<>& loop);
[[nodiscard]] Expected<MimoMargins> mimo_margins(const DiscreteSystem<>& loop);

/// The four functions by which a loop answers what disturbs it, and how much they amplify at most.
struct GangOfFour {
  bool stable = false;             ///< All four: the loop is internally stable.
  Peak sensitivity{};              ///< S = (I + PC)⁻¹: from a disturbance of the output.
  Peak complementary{};            ///< T = PC(I + PC)⁻¹: from the noise to the output.
  Peak disturbance_sensitivity{};  ///< PS: from a disturbance of the input to the output.
  Peak noise_sensitivity{};        ///< CS: from the noise to the input.
};
/// @param plant  P. @param controller  C; u = -C y.
/// @errors ArgumentError for shapes; SystemError::algebraic_loop, period_mismatch; not_stable where
/// a closed-loop pole lies on the axis. Source: Åström and Murray, "Feedback Systems",
/// section 12.1.
[[nodiscard]] Expected<GangOfFour> gang_of_four(const ContinuousSystem<>& plant,
                                                const ContinuousSystem<>& controller);
[[nodiscard]] Expected<GangOfFour> gang_of_four(const DiscreteSystem<>& plant,
                                                const DiscreteSystem<>& controller);

}  // namespace flyball::classical
