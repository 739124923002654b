#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <unistd.h>

#include <flyball/io/output_folder.hpp>

#include "commands.hpp"
#include "console.hpp"
#include "session.hpp"

namespace flyball::app {

namespace {

/// Those that would end the process: who ignores one, such as nohup, goes on ignoring it.
sigset_t ending_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction now{};
    if (::sigaction(signal, nullptr, &now) == 0 && now.sa_handler != SIG_IGN) {
      sigaddset(&signals, signal);
    }
  }
  return signals;
}

}  // namespace

void begin_session() {
  for (const int file : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(file, F_GETFD) == -1) {
      // The other way round than it is used, so that reading or writing fails.
      [[maybe_unused]] const int opened =
          ::open("/dev/null", file == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    }
  }
  const sigset_t signals = ending_signals();
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  try {
    std::thread([signals] {
      int signal = 0;
      while (::sigwait(&signals, &signal) != 0) {
      }
      try {
        OutputFolder::abandon_all();
      } catch (const std::exception&) {  // of no memory: the next run sweeps what is left
      }
      std::signal(signal, SIG_DFL);
      ::pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
      ::kill(::getpid(), signal);
    }).detach();
  } catch (const std::system_error&) {
    // There is no thread to be had: a signal ends the process at once, and the next run sweeps.
    ::pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
  }
}

int end_session(int status) {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) {
    return status;
  }
  say("standard output cannot be written" +
      (errno == 0 ? "" : ": " + std::generic_category().message(errno)));
  return status == success ? static_cast<int>(bad_input) : status;
}

}  // namespace flyball::app
