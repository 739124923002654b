#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/process.hpp"
#include "io/unfinished.hpp"

extern char** environ;

namespace flyball::io {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// The two ends of a pipe, closed when they go out of scope.
class Pipe {
 public:
  Pipe() {
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0) {
      ends_ = {-1, -1};
    }
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    close_reader();
    close_writer();
  }
  [[nodiscard]] bool ok() const { return ends_[0] >= 0; }
  [[nodiscard]] int reader() const { return ends_[0]; }
  [[nodiscard]] int writer() const { return ends_[1]; }
  void close_reader() { close(ends_[0]); }
  void close_writer() { close(ends_[1]); }

 private:
  static void close(int& fd) {
    if (fd >= 0) {
      ::close(std::exchange(fd, -1));
    }
  }
  std::array<int, 2> ends_{-1, -1};
};

/// The caller's environment with a fixed locale (points in numbers, UTF-8), and without what steers
/// gnuplot.
std::vector<std::string> clean_environment() {
  std::vector<std::string> result;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    const std::string_view text(*entry);
    if (!text.starts_with("LC_") && !text.starts_with("LANG") && !text.starts_with("GNUPLOT") &&
        !text.starts_with("GNUTERM") && !text.starts_with("GNUFIT")) {
      result.emplace_back(text);
    }
  }
  result.emplace_back("LC_ALL=C.UTF-8");
  return result;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  result.reserve(texts.size() + 1);
  for (std::string& text : texts) {
    result.push_back(text.data());
  }
  result.push_back(nullptr);
  return result;
}

using Clock = std::chrono::steady_clock;

/// Reads both pipes until they close.
ProcessResult::End drain(Pipe& out, Pipe& err, ProcessResult& result, Clock::time_point deadline,
                         std::size_t most_bytes) {
  constexpr std::size_t most_words = 65536;
  std::array<char, 65536> buffer;
  while (out.reader() >= 0 || err.reader() >= 0) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) {
      return ProcessResult::End::timed_out;
    }
    if (result.out.size() > most_bytes) {
      return ProcessResult::End::too_much;
    }
    std::array<pollfd, 2> watched = {pollfd{out.reader(), POLLIN, 0},
                                     pollfd{err.reader(), POLLIN, 0}};
    if (::poll(watched.data(), watched.size(), static_cast<int>(left.count())) < 0 &&
        errno != EINTR) {
      return ProcessResult::End::timed_out;
    }
    for (std::size_t i = 0; i < watched.size(); ++i) {
      if (watched[i].revents == 0) {
        continue;
      }
      const ssize_t got = ::read(watched[i].fd, buffer.data(), buffer.size());
      if (got > 0 && (i == 0 || result.err.size() < most_words)) {
        (i == 0 ? result.out : result.err).append(buffer.data(), static_cast<std::size_t>(got));
      } else if (got == 0 || (got < 0 && errno != EINTR)) {
        (i == 0 ? out : err).close_reader();
      }
    }
  }
  return ProcessResult::End::exited;
}

/// Whether a child has ended; its status is kept for whoever waits for it.
bool has_ended(pid_t child) {
  siginfo_t info{};
  return ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOWAIT | WNOHANG) != 0 ||
         info.si_pid == child;
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& arguments, std::string_view input,
                          const ProcessLimits& limits) {
  ProcessResult result;
  const auto not_started = [&](int error) {
    result.end = error == ENOENT ? ProcessResult::End::not_found : ProcessResult::End::not_started;
    result.code = error;
    return result;
  };
  // The input is an unlinked file: unlike a pipe it cannot fill up or break while nobody reads it.
  const std::unique_ptr<std::FILE, CloseFile> script(std::tmpfile());
  if (!script || std::fwrite(input.data(), 1, input.size(), script.get()) != input.size() ||
      std::fflush(script.get()) != 0 || ::lseek(::fileno(script.get()), 0, SEEK_SET) != 0) {
    return not_started(errno == ENOENT ? EIO : errno);
  }
  std::vector<std::string> words = arguments;
  std::vector<std::string> environment = clean_environment();
  const std::vector<char*> argv = pointers(words);
  const std::vector<char*> envp = pointers(environment);
  // The leader of the group has what is open here: no pipe of this program, nor of another's.
  std::unique_lock start(starting());
  expect_child();
  const KeptGroup group;
  Pipe out;
  Pipe err;
  if (!out.ok() || !err.ok()) {
    return not_started(errno);
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  // Each takes memory.
  int error =
      std::max({posix_spawn_file_actions_adddup2(&actions, ::fileno(script.get()), STDIN_FILENO),
                posix_spawn_file_actions_adddup2(&actions, out.writer(), STDOUT_FILENO),
                posix_spawn_file_actions_adddup2(&actions, err.writer(), STDERR_FILENO)});
  // A group of its own, so that what it starts is killed with it, and both with this process; and
  // the signals that this process may have blocked.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setpgroup(&attributes, group.id());
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  pid_t child = 0;
  if (error == 0) {
    error = ::posix_spawnp(&child, argv.front(), &actions, &attributes, argv.data(), envp.data());
  }
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) {
    return not_started(error);
  }
  out.close_writer();
  err.close_writer();
  const pid_t together = group.id() > 0 ? group.id() : child;
  RunningChild running(child, together);
  start.unlock();
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(limits.seconds));
  result.end = drain(out, err, result, deadline, limits.bytes);
  // Who closes its output need not end.
  while (result.end == ProcessResult::End::exited && !has_ended(child)) {
    result.end =
        Clock::now() < deadline ? ProcessResult::End::exited : ProcessResult::End::timed_out;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (result.end != ProcessResult::End::exited) {
    ::kill(-together, SIGKILL);
  }
  const int status = running.wait();
  if (result.end != ProcessResult::End::exited) {
    result.out.clear();
  } else if (WIFSIGNALED(status)) {
    result.end = ProcessResult::End::signalled;
    result.code = WTERMSIG(status);
  } else {
    result.code = WEXITSTATUS(status);
  }
  return result;
}

}  // namespace flyball::io
