#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include <flyball/core/progress.hpp>

#include "progress_line.hpp"

namespace flyball::app {

namespace {

using LineClock = std::chrono::steady_clock;

struct Line {
  std::mutex mutex;
  std::condition_variable changed;
  bool over = false;
  std::thread thread;
};

Line& line() {
  static Line one;
  return one;
}

std::string words(LineClock::duration elapsed) {
  const Progress now = progress();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(elapsed).count();
  std::string text = now.stage == nullptr ? "works" : now.stage;
  if (now.of > 0) {
    text += fmt::format(", {} of {}", now.done, now.of);
  } else if (now.done > 0) {
    text += fmt::format(", {}", now.done);
  }
  return fmt::format("\r\x1b[Kflyball: {} ({} s)", text, seconds);
}

void show() {
  const auto begin = LineClock::now();
  bool shown = false;
  std::unique_lock lock(line().mutex);
  auto next = std::chrono::milliseconds(1000);
  while (!line().changed.wait_for(lock, next, [] { return line().over; })) {
    try {
      std::fputs(words(LineClock::now() - begin).c_str(), stderr);
      std::fflush(stderr);
      shown = true;
    } catch (const std::bad_alloc&) {  // which would end all from here
    }
    next = std::chrono::milliseconds(250);
  }
  if (shown) {
    std::fputs("\r\x1b[K", stderr);
    std::fflush(stderr);
  }
}

}  // namespace

ProgressLine::ProgressLine() {
  if (::isatty(STDERR_FILENO) == 1) {
    try {
      line().thread = std::thread(show);
    } catch (const std::system_error&) {  // no thread to be had: it works without a word
    }
  }
}

ProgressLine::~ProgressLine() {
  end();
}

void ProgressLine::end() noexcept {
  if (!line().thread.joinable()) {
    return;
  }
  {
    const std::scoped_lock lock(line().mutex);
    line().over = true;
  }
  line().changed.notify_all();
  line().thread.join();
}

}  // namespace flyball::app
