#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flyball::io {

/// How a program ended; private to io.
struct ProcessResult {
  enum class End { exited, signalled, not_found, not_started, timed_out, too_much };
  End end = End::exited;
  int code = 0;  ///< Exit status, signal or errno.
  std::string out;
  std::string err;  ///< No more than its beginning.
};

struct ProcessLimits {
  double seconds = 30.0;
  std::size_t bytes = std::size_t{32} << 20;  ///< Of standard output.
};

/// Runs a program found in PATH to its end, without a shell.
/// @param arguments  The program's name first. @param input  Its standard input.
/// @param limits  Beyond which it is killed, with what it started.
[[nodiscard]] ProcessResult run_process(const std::vector<std::string>& arguments,
                                        std::string_view input, const ProcessLimits& limits);

}  // namespace flyball::io
