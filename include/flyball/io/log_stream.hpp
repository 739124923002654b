#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/io/sysid_json.hpp>

namespace flyball {

/// Takes what a log's file tells in the order of the file, for who does not want to hold it.
class LogSink {
 public:
  virtual ~LogSink() = default;
  /// A channel that samples will come of; again where its unit is told later.
  /// @param id  Counts from 0.
  virtual void channel(std::size_t id, const std::string& name, const std::string& unit) = 0;
  /// @param time  s. @param value  Finite.
  virtual void number(std::size_t id, double time, double value) = 0;
  virtual void text(std::size_t id, double time, std::string_view value) = 0;
  /// What comes now is of this test, whose clock is its own (SysId JSON).
  virtual void test(std::string_view name) = 0;
};

/// What is known of a log beside its samples.
struct StreamedLog {
  std::string format{};              ///< "SysId JSON", "WPILOG" or "CSV".
  std::optional<SysIdJson> sysid{};  ///< Of a SysId JSON, without its runs.
  std::size_t samples = 0;           ///< Rows, or records of a WPILOG.
  std::vector<Diagnostic> diagnostics{};
};

/// Reads a log of any size from its beginning to its end, in memory that does not grow with it.
///
/// A SysId JSON has the channels "voltage", "position" and "velocity"; a CSV its columns without
/// that of time; a WPILOG its entries of numbers and texts.
///
/// @return Nothing, and the sink is left with what came so far, for a file that only `read_log`
/// understands: a CSV that is a list, has dates, or whose clock begins anew; a drivetrain's SysId
/// JSON; a WPILOG with frames of URCL; no regular file.
/// @errors FileError, LogError as `read_log`.
/// Cost: one pass; some hundred kB, a WPILOG's longest record (64 MiB at most) and names.
[[nodiscard]] Expected<std::optional<StreamedLog>> stream_log(const std::string& path,
                                                              LogSink& sink);

}  // namespace flyball
