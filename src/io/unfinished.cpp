#include <algorithm>
#include <cerrno>
#include <csignal>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/unfinished.hpp"

namespace flyball::io {

namespace {

// Groups. Never destroyed, like the mutexes: a thread that ends the process may come later than
// that.
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

KeptGroup::KeptGroup() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    return;
  }
  leader_ = ::fork();
  if (leader_ == 0) {
    ::close(ends[1]);
    sigset_t all;
    sigfillset(&all);
    ::sigprocmask(SIG_BLOCK, &all, nullptr);
    char nothing = 0;
    if (::setpgid(0, 0) == 0) {
      while (::read(ends[0], &nothing, 1) < 0 && errno == EINTR) {
      }
      ::kill(0, SIGKILL);
    }
    ::_exit(0);
  }
  ::close(ends[0]);
  if (leader_ < 0) {
    leader_ = 0;
    ::close(ends[1]);
    return;
  }
  ::setpgid(leader_, leader_);  // whichever of the two comes first
  alive_ = ends[1];
}

KeptGroup::~KeptGroup() {
  if (leader_ > 0) {
    ::kill(-leader_, SIGKILL);
    while (::waitpid(leader_, nullptr, 0) < 0 && errno == EINTR) {
    }
    ::close(alive_);
  }
}

RunningChild::RunningChild(pid_t child, pid_t group) : child_(child), group_(group) {
  const std::lock_guard lock(starting());
  children().push_back(group);
}

RunningChild::~RunningChild() {
  if (!ended_) {
    ::kill(-group_, SIGKILL);
    wait();
  }
  const std::lock_guard lock(starting());
  std::erase(children(), group_);
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
  for (const pid_t group : children()) {
    ::kill(-group, SIGKILL);
  }
}

}  // namespace flyball::io
