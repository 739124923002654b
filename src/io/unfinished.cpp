#include <algorithm>
#include <csignal>
#include <vector>

#include "io/unfinished.hpp"

namespace flyball::io {

namespace {

// Never destroyed, like the mutexes: a thread that ends the process may come later than that.
std::vector<pid_t>& children() {
  static auto& running = *new std::vector<pid_t>;
  return running;
}

}  // namespace

std::recursive_mutex& writing() {
  static auto& mutex = *new std::recursive_mutex;
  return mutex;
}

std::recursive_mutex& starting() {
  static auto& mutex = *new std::recursive_mutex;
  return mutex;
}

RunningChild::RunningChild(pid_t child) : child_(child) {
  const std::lock_guard lock(starting());
  children().push_back(child);
}

RunningChild::~RunningChild() {
  const std::lock_guard lock(starting());
  std::erase(children(), child_);
}

void kill_children() noexcept {
  starting().lock();  // for ever
  for (const pid_t child : children()) {
    ::kill(-child, SIGKILL);
  }
}

}  // namespace flyball::io
