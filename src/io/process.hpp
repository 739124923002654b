#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace flyball::io {

/// How a program ended; private to io.
struct ProcessResult {
  enum class End { exited, signalled, not_found, not_started, timed_out };
  End end = End::exited;
  int code = 0;  ///< Exit status, signal or errno.
  std::string out;
  std::string err;
};

/// Runs a program found in PATH to its end, without a shell.
/// @param arguments  The program's name first. @param input  Its standard input.
/// @param seconds    After which it is killed.
[[nodiscard]] ProcessResult run_process(const std::vector<std::string>& arguments,
                                        std::string_view input, double seconds);

}  // namespace flyball::io
