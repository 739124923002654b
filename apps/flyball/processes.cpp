#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "lacks_memory.hpp"
#include "processes.hpp"
#ifdef __linux__
#include <sched.h>
#include <sys/prctl.h>
#endif

#include <flyball/core/errors.hpp>

namespace flyball::app {

namespace {

using ProcessClock = std::chrono::steady_clock;
using End = Outcome::End;

constexpr int out_of_memory = 3;  // a process's exit status

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool reserves_everything = true;  // a sanitizer's shadow memory
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool reserves_everything = true;
#else
constexpr bool reserves_everything = false;
#endif
#else
constexpr bool reserves_everything = false;
#endif

bool send_all(int fd, const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t sent = ::send(fd, at, size, MSG_NOSIGNAL);
    if (sent < 0 && errno != EINTR) {
      return false;
    }
    at += std::max<ssize_t>(sent, 0);
    size -= static_cast<std::size_t>(std::max<ssize_t>(sent, 0));
  }
  return true;
}

bool receive_all(int fd, void* data, std::size_t size) {
  char* at = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = ::recv(fd, at, size, 0);
    if (got == 0 || (got < 0 && errno != EINTR)) {
      return false;
    }
    at += std::max<ssize_t>(got, 0);
    size -= static_cast<std::size_t>(std::max<ssize_t>(got, 0));
  }
  return true;
}

/// What this process has reserved so far.
rlim_t address_space() {
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%lu", &pages) != 1) {
      pages = 0;
    }
    std::fclose(file);
  }
  return static_cast<rlim_t>(pages) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

template <class Resource>
void lower(Resource resource, rlim_t most) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) == 0) {
    limit.rlim_cur = std::min(most, limit.rlim_max);
    ::setrlimit(resource, &limit);
  }
}

/// From now on; SIGXCPU ends what takes longer.
void allow_processor_time(double seconds) {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  const double so_far = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
                        1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
  lower(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(so_far + seconds)));
}

/// The life of a process: tasks come in, answers go out.
[[noreturn]] void serve(int fd, const Bounds& bounds,
                        const std::function<std::string(std::size_t)>& work) {
  lower(RLIMIT_CORE, 0);
  if (!reserves_everything) {
    lower(RLIMIT_AS, address_space() + (static_cast<rlim_t>(bounds.megabytes) << 20));
  }
  std::uint64_t task = 0;
  while (receive_all(fd, &task, sizeof task)) {
    allow_processor_time(bounds.seconds);
    try {
      const std::string answer = work(static_cast<std::size_t>(task));
      const std::uint64_t size = answer.size();
      if (!send_all(fd, &size, sizeof size) || !send_all(fd, answer.data(), answer.size())) {
        break;
      }
    } catch (const std::exception& problem) {
      ::_exit(lacks_memory(problem) ? out_of_memory : EXIT_FAILURE);
    }
  }
  ::_exit(0);
}

class Process {
 public:
  Process(pid_t pid, int fd) : pid_(pid), fd_(fd) {}
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    ::close(fd_);
    if (pid_ > 0) {
      // It waits for a task, or nobody waits for its answer any more.
      ::kill(pid_, SIGKILL);
      wait();
    }
  }

  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool idle() const { return !task_; }
  [[nodiscard]] bool fresh() const { return fresh_; }
  [[nodiscard]] std::size_t task() const { return *task_; }
  [[nodiscard]] ProcessClock::time_point begun() const { return begun_; }

  /// What cannot be sent is found out when its answer is waited for.
  void give(std::size_t task) {
    task_ = task;
    begun_ = ProcessClock::now();
    const std::uint64_t number = task;
    static_cast<void>(send_all(fd_, &number, sizeof number));
  }

  void kill_for_time() {
    timed_out_ = true;
    ::kill(pid_, SIGKILL);
  }

  /// Takes what has come. @return The outcome, once it is whole.
  std::optional<Outcome> read() {
    char chunk[1 << 16];
    const ssize_t got = ::recv(fd_, chunk, sizeof chunk, 0);
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) {
      return std::nullopt;
    }
    if (got <= 0) {
      return ended();
    }
    bytes_.append(chunk, static_cast<std::size_t>(got));
    std::uint64_t size = 0;
    if (bytes_.size() < sizeof size) {
      return std::nullopt;
    }
    std::memcpy(&size, bytes_.data(), sizeof size);
    if (bytes_.size() < sizeof size + size) {
      return std::nullopt;
    }
    Outcome outcome{End::answered, bytes_.substr(sizeof size), 0};
    bytes_.clear();
    fresh_ = false;
    task_.reset();
    return outcome;
  }

 private:
  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = 0;
    return status;
  }

  Outcome ended() {
    const int status = wait();
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    if (timed_out_ || signal == SIGXCPU) {
      return {End::too_long, {}, signal};
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == out_of_memory) {
      return {End::too_much_memory, {}, 0};
    }
    return {End::died, {}, signal};
  }

  pid_t pid_;
  int fd_;
  std::optional<std::size_t> task_{};
  ProcessClock::time_point begun_{};
  std::string bytes_{};
  bool fresh_ = true;
  bool timed_out_ = false;
};

class Pool {
 public:
  Pool(std::size_t tasks, const Bounds& bounds, const std::function<std::string(std::size_t)>& work,
       const std::function<void(std::size_t, Outcome)>& take)
      : tasks_(tasks), bounds_(bounds), work_(work), take_(take) {}

  Expected<void> run() {
    const std::size_t most = std::clamp<std::size_t>(bounds_.processes, 1, tasks_);
    while (ended_ < tasks_) {
      while (processes_.size() < most && next_ < tasks_ && start()) {
      }
      if (processes_.empty()) {
        return tl::unexpected(not_enough_memory("a process of its own for each log"));
      }
      for (const auto& process : processes_) {
        if (process->idle() && next_ < tasks_) {
          process->give(next_++);
        }
      }
      wait();
    }
    return {};
  }

 private:
  /// @return Whether there is one more.
  bool start() {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      return false;
    }
    std::fflush(nullptr);
    const pid_t parent = ::getpid();
    const pid_t pid = ::fork();
    if (pid == 0) {
      ::close(ends[0]);
      for (const auto& other : processes_) {
        ::close(other->fd());
      }
#ifdef __linux__
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
      if (::getppid() != parent) {
        ::_exit(0);
      }
      // The thread that waits for signals is the parent's.
      sigset_t none;
      sigemptyset(&none);
      ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
      serve(ends[1], bounds_, work_);
    }
    ::close(ends[1]);
    if (pid < 0) {
      ::close(ends[0]);
      return false;
    }
    processes_.push_back(std::make_unique<Process>(pid, ends[0]));
    return true;
  }

  void wait() {
    std::vector<pollfd> watched;
    for (const auto& process : processes_) {
      watched.push_back({process->fd(), POLLIN, 0});
    }
    constexpr int look_again = 500;  // ms
    ::poll(watched.data(), watched.size(), look_again);
    std::vector<std::size_t> again;
    for (std::size_t i = processes_.size(); i-- > 0;) {
      Process& process = *processes_[i];
      if (process.idle()) {
        continue;
      }
      const std::size_t task = process.task();
      if (watched[i].revents != 0) {
        if (auto outcome = process.read()) {
          end(i, task, *std::move(outcome), again);
        }
      } else if (ProcessClock::now() - process.begun() >
                 std::chrono::duration<double>(10.0 * bounds_.seconds)) {
        process.kill_for_time();
      }
    }
    for (const std::size_t task : again) {
      if (start()) {
        processes_.back()->give(task);
      } else {
        finish(task, {End::died, {}, 0});
      }
    }
  }

  void end(std::size_t index, std::size_t task, Outcome outcome, std::vector<std::size_t>& again) {
    if (outcome.end != End::answered) {
      const bool fresh = processes_[index]->fresh();
      processes_.erase(processes_.begin() + static_cast<std::ptrdiff_t>(index));
      if (!fresh) {
        again.push_back(task);
        return;
      }
    }
    finish(task, std::move(outcome));
  }

  void finish(std::size_t task, Outcome outcome) {
    ++ended_;
    take_(task, std::move(outcome));
  }

  std::size_t tasks_;
  const Bounds& bounds_;
  const std::function<std::string(std::size_t)>& work_;
  const std::function<void(std::size_t, Outcome)>& take_;
  std::vector<std::unique_ptr<Process>> processes_{};
  std::size_t next_ = 0;
  std::size_t ended_ = 0;
};

}  // namespace

Expected<void> work_in_processes(std::size_t tasks, const Bounds& bounds,
                                 const std::function<std::string(std::size_t)>& work,
                                 const std::function<void(std::size_t, Outcome)>& take) {
  return tasks == 0 ? Expected<void>{} : Pool(tasks, bounds, work, take).run();
}

std::size_t usable_processors() {
#ifdef __linux__
  cpu_set_t set;
  if (::sched_getaffinity(0, sizeof set, &set) == 0) {
    return static_cast<std::size_t>(std::max(1, CPU_COUNT(&set)));
  }
#endif
  return std::max(1U, std::thread::hardware_concurrency());
}

}  // namespace flyball::app
