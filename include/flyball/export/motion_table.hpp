#pragma once

#include <span>
#include <string>
#include <string_view>

#include <flyball/core/expected.hpp>
#include <flyball/core/time_series.hpp>

namespace flyball::exports {

/// A column, and the one of its derivative by the time.
struct MotionRate {
  std::string_view value, rate;
};

/// Those of a trajectory's table (`to_table`): poses go along with velocities, velocities with
/// accelerations.
inline constexpr MotionRate motion_rates[] = {{"x", "vx"},  {"y", "vy"},  {"heading", "omega"},
                                              {"vx", "ax"}, {"vy", "ay"}, {"omega", "alpha"}};

/// A C++20 header with a table's rows as constants and `at(time)`, which gives what is between two
/// rows: of a column with a rate the cubic that has both rows' values and rates, within h⁴/384 of
/// the largest fourth derivative (rows h apart; where the rate's rate jumps by J between two rows
/// within 0.017 h² J), of the others what is in proportion: no allocation, O(log rows), noexcept;
/// before the first row the first, after the last (and for NaN) the nearest. It needs the standard
/// library alone.
/// @param table  Two rows or more, times ascending; its columns' names become members.
/// @param name  Of the namespace, an identifier of C++. @param about  A line on what it is.
/// @param rates  Columns whose derivative is a column, too.
/// @errors ArgumentError::empty (fewer than two rows, no column), malformed (a name that is no
///         identifier), unknown_name (a rate of no column), not_finite. Cost: O(rows · columns).
[[nodiscard]] Expected<std::string> motion_table(const TimeSeries& table, const std::string& name,
                                                 const std::string& about,
                                                 std::span<const MotionRate> rates = {});

}  // namespace flyball::exports
