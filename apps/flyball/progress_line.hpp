#pragma once

namespace flyball::app {

/// Shows on standard error, where that is a terminal, what long work is at: a line that comes after
/// a second and is gone with the first output, or with this object.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Takes the line away for good: what is said now stands alone.
  static void end() noexcept;
};

}  // namespace flyball::app
