#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/study/identify.hpp>

/// Many logs, each by itself: a row a log, which can be kept, compared with its log, shared out
/// over machines and put together again.
namespace flyball::study {

/// Why a log has no row of gains though nothing is wrong with it, or rows are no whole.
enum class LogRowsError {
  took_too_long,         ///< More time than a log may take.
  took_too_much_memory,  ///< More memory than a log may take.
  ended_early,           ///< The process that had the log ended without an answer.
  not_rows,              ///< A file that is not of rows.
  rows_differ,           ///< Rows of other logs, options or versions, or two of one log.
  rows_missing,          ///< Not all parts are there.
};
[[nodiscard]] ErrorInfo error_info(LogRowsError code);

/// What is known of one log.
struct LogRow {
  std::string path{};
  std::uint64_t size = 0;  ///< Bytes of the log; 0 if it could not be read.
  std::string checksum{};  ///< Of its bytes, 16 hexadecimal digits; empty if it could not be read.
  std::string settings{};  ///< `settings_of` what it was made with.
  int status = 0;          ///< As the exit status of `flyball identify` of that log.
  /// What a bound on time or memory ended is no fact about the log: it may be tried again.
  bool lasting = true;
  std::string members{};  ///< The row's JSON from "path" on, without the braces.
};

/// A row among those of all logs.
struct NumberedRow {
  std::size_t number = 0;  ///< From 0, in the order of the paths.
  LogRow row{};
};

/// Rows in their order.
struct LogRows {
  std::size_t logs = 0;  ///< Of which these are rows; more than there are rows in a part.
  std::vector<NumberedRow> rows{};
};

/// A short text that differs where rows of the same log may: version and options.
/// @param job  Its selection and what the project file says; not its log.
[[nodiscard]] std::string settings_of(const IdentifyJob& job);

/// The row of a log: read once, identified, its gains with intervals, its verdict, what was noticed
/// or the reason why there are no gains. Everything that can be wrong is in the row.
/// Cost: that of `identify`; allocates, std::bad_alloc comes through.
[[nodiscard]] LogRow identify_row(const IdentifyJob& job);

/// The row of a log that had to be given up.
[[nodiscard]] LogRow refused_row(const IdentifyJob& job, const Error& reason);

/// Whether the row is of this job and the log's bytes are those that it was made of.
[[nodiscard]] bool still_holds(const LogRow& row, const IdentifyJob& job);

/// One object on one line, with the line's end. Schema "flyball.log_row/1".
[[nodiscard]] std::string to_json_line(const NumberedRow& row, std::size_t logs);

/// Reads what `to_json_line` wrote. @param source  The path, for messages.
/// @param cut  Whether a last line that ends early, as a killed process leaves it, is passed over.
/// @errors LogRowsError::not_rows with the line; rows_differ for lines of several wholes.
[[nodiscard]] Expected<LogRows> read_log_rows(std::string_view text, const std::string& source,
                                              bool cut = false);

/// The parts of one whole, put together: what one run over all logs gives, byte by byte.
/// @param paths  Files of rows, or folders with a logs.jsonl.
/// @errors FileError; LogRowsError::not_rows, rows_differ, rows_missing; ArgumentError::empty.
[[nodiscard]] Expected<LogRows> merge_log_rows(std::span<const std::string> paths);

/// A table: a line a log, its columns always the same (docs/schemas.md).
[[nodiscard]] std::string to_csv(const LogRows& rows);

/// How many logs have gains, the table, which errors and warnings there are; logs.csv and
/// logs.jsonl. Schema "flyball.identify_each/1".
/// @param passed_over  Files that are no logs by their names.
[[nodiscard]] Answer answer_of(const LogRows& rows, std::size_t passed_over = 0);

/// The exit status of all: 0 where every log has gains, else that of the worst row.
[[nodiscard]] int status_of(const LogRows& rows);

/// "2/8": the second of eight parts; the logs whose number leaves 1 when divided by 8.
struct Shard {
  std::size_t part = 1;  ///< From 1.
  std::size_t of = 1;    ///< How many there are.
  /// Whether a log, by its number among all, is of this part.
  [[nodiscard]] bool holds(std::size_t number) const { return number % of == part - 1; }
};
/// @errors ArgumentError::malformed, out_of_range.
[[nodiscard]] Expected<Shard> parse_shard(std::string_view text);

}  // namespace flyball::study
