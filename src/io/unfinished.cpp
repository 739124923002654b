#include <algorithm>
#include <cerrno>
#include <csignal>
#include <vector>

#include <sys/wait.h>

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

void expect_child() {
  const std::lock_guard lock(starting());
  children().reserve(children().size() + 1);
}

RunningChild::RunningChild(pid_t child) : child_(child) {
  const std::lock_guard lock(starting());
  children().push_back(child);
}

RunningChild::~RunningChild() {
  if (!ended_) {
    ::kill(-child_, SIGKILL);
    wait();
  }
  const std::lock_guard lock(starting());
  std::erase(children(), child_);
}

int RunningChild::wait() noexcept {
  int status = 0;
  while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  ended_ = true;
  return status;
}

void kill_children() noexcept {
  starting().lock();  // for ever
  for (const pid_t child : children()) {
    ::kill(-child, SIGKILL);
  }
}

}  // namespace flyball::io
