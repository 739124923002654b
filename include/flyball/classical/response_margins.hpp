#pragma once

#include <flyball/classical/frequency_response.hpp>
#include <flyball/classical/loop_margins.hpp>

namespace flyball::classical {

/// `loop_margins` of any loop whose factors are known, a state space of any order and with dead
/// time among them; no polynomial is formed.
///
/// No crossing in the range is missed: between two frequencies ln L moves by no more than the sum
/// over its poles, zeros and delay allows, and where that does not exclude a crossing the interval
/// is halved until the slope keeps its sign on it. The range goes from where the asymptote at ω → 0
/// rules to where |L| stays below one; of a loop with dead time phase crossings are those up to ten
/// times its fastest pole or zero. Peaks are found to 1e-5 by the same bound, and refined.
/// @param loop  L, one input, one output; negative feedback.
/// @errors ArgumentError::wrong_shape for a matrix, empty for a response without factors;
/// SystemError::no_convergence. Cost: some ten thousand evaluations.
[[nodiscard]] Expected<LoopMargins> loop_margins(const FrequencyResponse& loop);

/// What the sampling of a controller does to a loop that was shaped without it: half a period of
/// delay (sections 7.2.1 and E.6).
struct SampleDelayReport {
  LoopMargins without{};               ///< Of L.
  LoopMargins with{};                  ///< Of L e^{-sT/2}.
  std::optional<double> crossover{};   ///< rad/s, the last gain crossing.
  std::optional<double> phase_loss{};  ///< deg, ωT/2 there.
};
/// @param loop  Continuous. @param period  T, s.
/// @errors ArgumentError for the period; TransferError::period_mismatch for a discrete loop; those
/// of `loop_margins`.
[[nodiscard]] Expected<SampleDelayReport> sample_delay_report(const TransferFunction& loop,
                                                              Time period);

}  // namespace flyball::classical
