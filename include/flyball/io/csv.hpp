#pragma once

#include <string>
#include <string_view>

#include <flyball/core/expected.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/io/log.hpp>

namespace flyball {

/// Reads a table of text: AdvantageScope's exports (table, or list of Timestamp, Key, Value),
/// SysId's ToCSV, spreadsheets.
///
/// Accepted: UTF-8 with or without byte-order mark, Windows-1252; LF, CRLF or CR; comma, semicolon
/// or tab; decimal commas where the comma does not separate; quoted cells; empty lines; lines that
/// begin with '#'; blank cells (no value at that time); units in the header as `Name (unit)` or
/// `Name [unit]`. The time column is the one named Timestamp, Time or t (in the unit that its
/// header says, seconds otherwise), or the first if its numbers ascend. Columns of words become
/// `texts`; true and false become 1 and 0.
///
/// @errors LogError::not_a_log (not a table), no_time, no_data, malformed (an unclosed quote, with
///         its line).
[[nodiscard]] Expected<Log> parse_csv(std::string_view text, const std::string& source);

/// The same of a table whose rows are that far apart, whatever columns it has; the first is at 0.
/// @param period  s, positive and finite.
[[nodiscard]] Expected<Log> parse_csv(std::string_view text, const std::string& source,
                                      double period);

/// A table as CSV: header `time (s),name (unit),…`, one row a line, numbers the shortest that read
/// back to the same double, NaN as a blank cell. UTF-8, LF.
[[nodiscard]] std::string to_csv(const TimeSeries& series);

/// `to_csv` into a file, atomically. @errors FileError.
[[nodiscard]] Expected<void> write_csv(const std::string& path, const TimeSeries& series);

}  // namespace flyball
