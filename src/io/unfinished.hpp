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

/// A process group for a program and what it starts, led by a process that only waits for the end
/// of this one, however that ends: then, as when it goes out of scope, all of the group is killed.
class KeptGroup {
 public:
  /// Where there is no process for its leader the group is nobody's: `id()` is zero.
  KeptGroup();
  KeptGroup(const KeptGroup&) = delete;
  KeptGroup& operator=(const KeptGroup&) = delete;
  ~KeptGroup();

  [[nodiscard]] pid_t id() const { return leader_; }

 private:
  pid_t leader_ = 0;
  int alive_ = -1;  ///< Whose other end the leader reads: it is closed when this process ends.
};

/// A program that runs for this process, until it has ended; what was not waited for is killed.
class RunningChild {
 public:
  /// @param group  That it is in, with what it started.
  RunningChild(pid_t child, pid_t group);
  RunningChild(const RunningChild&) = delete;
  RunningChild& operator=(const RunningChild&) = delete;
  ~RunningChild();

  /// Until it has ended. @return Its status, as of waitpid.
  int wait() noexcept;

 private:
  pid_t child_;
  pid_t group_;
  bool ended_ = false;
};

/// Kills all of them, with what they started; whoever starts another waits for ever.
void kill_children() noexcept;

}  // namespace flyball::io
