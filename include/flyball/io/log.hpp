#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/io/log_error.hpp>
#include <flyball/io/sysid_json.hpp>

namespace flyball {

/// Text sampled at its own times: a state, a mode, a message.
struct TextSignal {
  std::string name;
  std::vector<double> time;        ///< Seconds.
  std::vector<std::string> value;  ///< As many as `time`.
};

/// A channel that a log holds and Flyball does not decode.
struct SkippedChannel {
  std::string name;
  std::string type;         ///< "struct:Pose2d", "raw", …
  std::size_t records = 0;  ///< How many of it the log holds.
};

/// What a log file holds, whatever its format.
///
/// A WPILOG and a CSV are channels: `signals` and `texts`. A SysId JSON is four tables and stands
/// in `sysid`, with `signals` and `texts` empty. In all of them times ascend and values are finite;
/// what had to be dropped or reordered for that is in `diagnostics`.
struct Log {
  std::string source;  ///< The path, as given.
  std::string format;  ///< "SysId JSON", "WPILOG" or "CSV".
  std::vector<Signal> signals;
  std::vector<TextSignal> texts;
  std::optional<SysIdJson> sysid;  ///< Its diagnostics are in `diagnostics` too.
  std::vector<SkippedChannel> skipped;
  std::map<std::string, std::string> metadata;  ///< Facts beside the data, such as "extra".
  std::vector<Diagnostic> diagnostics;

  /// The first channel of a name, or nullptr.
  [[nodiscard]] const Signal* find_signal(std::string_view name) const noexcept;
  [[nodiscard]] const TextSignal* find_text(std::string_view name) const noexcept;
};

/// Reads a log; the format is told by the contents, the extension only words the error.
/// @param path  A SysId JSON, a WPILOG or a CSV.
/// @errors FileError (not_found, is_a_folder, not_readable, too_large), LogError; each with the
///         path, the place in the file, and what to do.
/// Cost: the file and its decoded samples in memory; 16 bytes a numeric sample.
[[nodiscard]] Expected<Log> read_log(const std::string& path);

/// The same from memory. @param bytes  The file's contents. @param source  The path, for messages
///                                     and for its extension.
[[nodiscard]] Expected<Log> parse_log(std::string_view bytes, const std::string& source);

}  // namespace flyball
