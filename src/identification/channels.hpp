#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <flyball/identification/preparation.hpp>

/// What the position and velocity columns are made of: refresh rate, resolution, scale, signs.
namespace flyball::identification {

/// Smallest step of a column over all runs (robust against a few odd ones); 0 if it never changes.
[[nodiscard]] double column_quantum(const std::vector<PreparedRun>& runs,
                                    std::vector<double> TestRun::* column);

/// Median time between new values where the column changes fastest, s; 0 if it never changes.
[[nodiscard]] double refresh_period(const std::vector<PreparedRun>& runs,
                                    std::vector<double> TestRun::* column);

/// Rows that carry a new value: those that change, and, where the value stays the same for longer
/// than a refresh takes, the row at which each further refresh was due.
[[nodiscard]] std::vector<std::size_t> fresh_rows(std::span<const double> time,
                                                  std::span<const double> values, double period);

/// Share of the rows that repeat both position and velocity of the row before.
[[nodiscard]] double repeated_share(const std::vector<PreparedRun>& runs);

/// s, on each side, over which a velocity is derived from the position.
inline constexpr double smoothing_half_width = 0.035;

/// Fills `fresh_position`, `fresh_velocity` and `smoothed_velocity` of every run.
void refresh_derived_columns(PreparedRecording& prepared);

/// Removes the sign errors that voltage, position and velocity show against each other, and says
/// so.
void mend_signs(PreparedRecording& prepared);

/// Takes out the jumps of the position that the velocity does not show, and says so. Needs
/// `top_speed` and which runs moved.
void mend_slips(PreparedRecording& prepared);

/// Gives up a velocity column that is truncated to a few steps where the position is finer.
void drop_coarse_velocity(PreparedRecording& prepared);

/// Compares the velocity column with the derivative of the position.
void check_velocity_scale(PreparedRecording& prepared);

}  // namespace flyball::identification
