#pragma once

#include <flyball/classical/delay_system.hpp>
#include <flyball/classical/transfer_function.hpp>

namespace flyball::classical {

/// What a step response is judged by, exact in time: found on the solution, not on samples. Of a
/// response that does not settle (unstable, integrating, oscillating for ever) the final value is
/// infinite or not a number and what hangs on it is absent; rise and overshoot are of the motion
/// from zero to the final value, whatever its sign.
struct StepMetrics {
  double final_value = 0.0;           ///< G(0); ±∞ or NaN where it does not settle.
  std::optional<double> rise_time{};  ///< s, first at 10 % to first at 90 % of the final value.
  /// s, from where on it is within the band; absent where half a million points do not show it, of
  /// which the peak is then.
  std::optional<double> settling_time{};
  std::optional<double> overshoot{};   ///< Share of the final value beyond it.
  std::optional<double> undershoot{};  ///< Share of the final value on the other side of zero.
  /// The value farthest in the final value's direction; farthest from zero where that is zero.
  std::optional<double> peak{};
  std::optional<double> peak_time{};  ///< s; absent where the final value is approached only.
};

/// @param band  Half of it, as a share of the final value.
/// Of a discrete transfer function the samples are the solution.
/// @errors ArgumentError::out_of_range (a band not in (0, 1)); SystemError::no_convergence.
/// Cost: O(n³ + n² points), the points following the fastest and the slowest pole, half a million
/// at most. Source: book, sections 2.5 and E.3.5; conventions of the field: 10-90 %, 2 %.
[[nodiscard]] Expected<StepMetrics> step_metrics(const TransferFunction& transfer,
                                                 double band = 0.02);

/// Of one channel of a system with any inputs and outputs and dead time anywhere, in loops too: by
/// the method of steps (`delay_response.hpp`), whose polynomials are searched for tops, bottoms and
/// crossings; right to about 1e-10 of the largest value.
/// @param output, input  Which, from 0. @param band  As above.
/// @errors ArgumentError::out_of_range (the channel, a band not in (0, 1)); those of
/// `rightmost_poles` and `step_response`. Cost: as those, over 36 of the slowest pole's time
/// constants.
[[nodiscard]] Expected<StepMetrics> step_metrics(const DelaySystem& system, Eigen::Index output,
                                                 Eigen::Index input, double band = 0.02);

}  // namespace flyball::classical
