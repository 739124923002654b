#pragma once

#include <flyball/io/log.hpp>

namespace flyball::io {

/// Makes a log's promise true: drops samples that are not finite, sorts each channel by time, and
/// tells both in the diagnostics. Channels that lose all their samples are removed.
void tidy(Log& log);

/// An error with what was told on the way to it as evidence.
[[nodiscard]] Error with_diagnostics(Error error, const std::vector<Diagnostic>& diagnostics);

}  // namespace flyball::io
