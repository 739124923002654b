#pragma once

#include <string>

#include <flyball/core/expected.hpp>
#include <flyball/core/time_series.hpp>

namespace flyball::exports {

/// A C++20 header with a table's rows as constants and `at(time)`, which gives what is between two
/// rows in proportion: no allocation, O(log rows), noexcept; before the first row the first, after
/// the last (and for NaN) the nearest. It needs the standard library alone.
/// @param table  Two rows or more, times ascending; its columns' names become members.
/// @param name  Of the namespace, an identifier of C++. @param about  A line on what it is.
/// @errors ArgumentError::empty (fewer than two rows, no column), malformed (a name that is no
///         identifier), not_finite. Cost: O(rows · columns).
[[nodiscard]] Expected<std::string> motion_table(const TimeSeries& table, const std::string& name,
                                                 const std::string& about);

}  // namespace flyball::exports
