#pragma once

#include <mutex>

#include <sys/types.h>

/// What a process that is told to end must not leave behind; private to io.
namespace flyball::io {

/// Held while files are being put in place, so that a process does not end in the middle.
[[nodiscard]] std::recursive_mutex& writing();

/// Held while a program is started, until it is known as a RunningChild.
[[nodiscard]] std::recursive_mutex& starting();

/// Before a program is started: the memory to know it, so that none is started without.
void expect_child();

/// A program that runs for this process, until it has ended; what was not waited for is killed.
class RunningChild {
 public:
  explicit RunningChild(pid_t child);
  RunningChild(const RunningChild&) = delete;
  RunningChild& operator=(const RunningChild&) = delete;
  ~RunningChild();

  /// Until it has ended. @return Its status, as of waitpid.
  int wait() noexcept;

 private:
  pid_t child_;
  bool ended_ = false;
};

/// Kills all of them, with what they started; whoever starts another waits for ever.
void kill_children() noexcept;

}  // namespace flyball::io
