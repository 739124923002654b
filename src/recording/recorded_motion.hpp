#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <flyball/identification/recording.hpp>

/// What the columns of a recording tell of each other before their units are known.
namespace flyball::recording {

/// The velocity column over the derivative of the position column, both as recorded: the least
/// squares of the position's differences over 0.2 s on the velocity's integral, later or earlier by
/// up to 0.12 s. Nothing if a column is missing they do not move together (correlation < 0.9), or
/// the velocity goes in steps of more than 6 % of the fastest.
[[nodiscard]] std::optional<double> velocity_ratio(
    const std::vector<identification::TestRun>& runs);

/// The speed at 12 V by the fastest motion that was recorded, in position units a second; 0 if
/// nothing moved. @param ratio  Of `velocity_ratio`.
[[nodiscard]] double speed_at_full_voltage(const std::vector<identification::TestRun>& runs,
                                           std::optional<double> ratio);

/// Undoes the wrap of an absolute encoder's angles: values that keep within one turn (1, 2π or 360)
/// and leap by most of it, against the motion before and after. What moves past where it began
/// again then goes on. @return  The leaps.
std::size_t unwrap_turns(std::vector<double>& positions);

}  // namespace flyball::recording
