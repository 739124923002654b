#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

/// Columns of time as tables have them; private to io.
namespace flyball::io {

/// Whether a column of that name is one of time, and its size in seconds if the name says it:
/// "Timestamp", "t", "time_ms", "timestamp_us", "TimeMicros".
struct TimeName {
  bool is_time = false;
  std::optional<double> seconds{};
};
[[nodiscard]] TimeName time_name(std::string_view name);

/// Seconds of "2025-02-02T05:35:57.123Z", "2025-02-02 05:35:57,123+01:00" (since 1970) or of
/// "05:35:57.123" (since midnight); nothing if it is neither.
[[nodiscard]] std::optional<double> clock_time(std::string_view cell);

/// Where time begins anew, as when each test has a clock of its own: the parts are put one after
/// the other, two seconds apart. Rows out of order are left alone: a part is at least ten rows,
/// begins near where the first did, and there is at most one part in twenty rows.
/// @param time  NaN of a row without one. @return  How often it began anew.
std::size_t join_restarts(std::vector<double>& time);

}  // namespace flyball::io
