#pragma once

#include <flyball/core/quantity.hpp>
#include <flyball/core/time_series.hpp>

namespace flyball {

/// The rest-to-rest trapezoid profile as the book tabulates it: the velocity is exact at each
/// period, and the position is its sum (right rectangles), so that a discrete model whose position
/// is that sum can follow it exactly. `TrapezoidProfile` is the exact one.
///
/// @param max_velocity  m/s or rad/s. @param time_to_max_velocity  s, from rest.
/// @param period  s. @param goal  m or rad, >= 0.
/// @return Columns "position", "velocity", "acceleration"; the first row is at rest at zero, the
///         last one is the first at or after the end.
/// @errors ArgumentError::not_positive, not_finite, out_of_range (a negative goal, or more than
///         ten million rows).
/// Source: book, Snippet 15.1.
[[nodiscard]] Expected<TimeSeries> generate_trapezoid_profile(double max_velocity,
                                                              Time time_to_max_velocity,
                                                              Time period, double goal);

}  // namespace flyball
