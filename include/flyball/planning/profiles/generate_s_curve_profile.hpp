#pragma once

#include <flyball/core/quantity.hpp>
#include <flyball/core/time_series.hpp>

namespace flyball {

/// The rest-to-rest S-curve profile as the book tabulates it: velocity and acceleration are exact
/// at each period, and the position is the velocity's sum (right rectangles), so that a discrete
/// model whose position is that sum can follow it exactly. `SCurveProfile` is the exact one.
///
/// Of a motion that is too short for the maximum velocity, the snippet's peak,
/// a(√(d/a - 3t²/4) - t/2), ends short of the goal; here it is a(√(d/a + t²/4) - t/2), and if even
/// the maximum acceleration is not reached, that of four equal phases.
///
/// @param max_velocity  m/s or rad/s. @param max_acceleration  m/s² or rad/s².
/// @param time_to_max_acceleration  s, from none. @param period  s. @param goal  m or rad, >= 0.
/// @return Columns "position", "velocity", "acceleration"; the first row is at rest at zero, the
///         last one is the first at or after the end.
/// @errors ArgumentError::not_positive, not_finite, out_of_range (a negative goal, or more than ten
///         million rows, or numbers beyond 1e30).
/// Source: book, Snippet 15.2.
[[nodiscard]] Expected<TimeSeries> generate_s_curve_profile(double max_velocity,
                                                            double max_acceleration,
                                                            Time time_to_max_acceleration,
                                                            Time period, double goal);

}  // namespace flyball
