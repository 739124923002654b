#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include <flyball/core/expected.hpp>

namespace flyball::app {

/// What each task may take, and how many are worked on at once.
struct Bounds {
  std::size_t processes = 1;
  double seconds = 60.0;         ///< Of processor time; ten times that on the clock.
  std::size_t megabytes = 2048;  ///< Of memory, beside what the program had before.
};

/// How a task ended.
struct Outcome {
  enum class End { answered, too_long, too_much_memory, died };
  End end = End::answered;
  std::string answer{};
  int signal = 0;  ///< What it died of, if by one.
};

/// Works on tasks 0 to `tasks - 1` in processes of their own, so that one that takes too long or
/// too much memory, or crashes, costs its own answer alone. What fails in a process that worked on
/// others before is tried once more in a fresh one: an outcome hangs on its task, not on the order.
///
/// The processes are copies of this one (fork) and serve task after task; they end with it.
/// @param work  Called in them; std::bad_alloc is too_much_memory. It must not touch standard
///              streams.
/// @param take  Called here as tasks end, in any order.
/// @errors MemoryError::not_enough_memory where no process can be made.
[[nodiscard]] Expected<void> work_in_processes(
    std::size_t tasks, const Bounds& bounds, const std::function<std::string(std::size_t)>& work,
    const std::function<void(std::size_t, Outcome)>& take);

/// The processors that this program may run on.
[[nodiscard]] std::size_t usable_processors();

}  // namespace flyball::app
