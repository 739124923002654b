#pragma once

#include <optional>
#include <span>

#include <flyball/core/expected.hpp>

namespace flyball {

/// The three kinds of section 2.5.
enum class ResponseType {
  underdamped,        ///< It oscillates around the reference before it settles.
  critically_damped,  ///< It does not, and goes over the reference by at most the tolerance.
  overdamped,         ///< It never passes the reference.
};

/// What a step response is judged by. Times are from the step on, s; nothing where the response
/// does not get there within its samples.
struct ResponseMetrics {
  std::optional<double> rise_time;        ///< To reach the reference first (section 2.5).
  std::optional<double> rise_time_10_90;  ///< From 10 % to 90 % of the step.
  std::optional<double> settling_time;    ///< To be within the tolerance of the reference for good.
  double overshoot = 0.0;                 ///< Past the reference, as a share of the step; >= 0.
  double undershoot = 0.0;                ///< Against the step's direction at first, as a share.
  double peak = 0.0;                      ///< The value farthest in the step's direction.
  double peak_time = 0.0;                 ///< When it is taken first.
  double final_value = 0.0;               ///< The last sample.
  double steady_state_error = 0.0;        ///< reference - final value.
  int crossings = 0;  ///< Of the reference, by more than the tolerance on either side.
  ResponseType type = ResponseType::overdamped;
};

/// Judges a sampled step response. Between samples it is taken for straight.
///
/// @param times  s, increasing; the step happens at the first. @param values  As many.
/// @param reference  What the step asks for, different from the first value.
/// @param tolerance  Share of the step that counts as being there, 2 % unless told.
/// @errors ArgumentError: fewer than two samples, as many times as values, times that do not
///         increase, entries that are not finite, a step of no size, a tolerance not in (0, 1).
/// Cost: O(samples), no allocation. Source: book, section 2.5.
[[nodiscard]] Expected<ResponseMetrics> response_metrics(std::span<const double> times,
                                                         std::span<const double> values,
                                                         double reference, double tolerance = 0.02);

}  // namespace flyball
