#include <algorithm>
#include <atomic>
#include <chrono>
#include <new>
#include <system_error>
#include <thread>
#include <utility>

#include <flyball/io/plot.hpp>

#include "report/pictures.hpp"

namespace flyball::report {

std::vector<Picture> draw(const std::vector<Figure>& figures, bool png, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  std::vector<Picture> pictures(figures.size());
  for (std::size_t i = 0; i < figures.size(); ++i) {
    pictures[i].figure = figures[i];
  }
  const std::size_t jobs = pictures.size() * (png ? 2 : 1);
  std::vector<std::string> problems(jobs);
  std::atomic<std::size_t> next{0};
  std::atomic<bool> short_of_memory{false};
  const auto draw_all = [&] {
    for (std::size_t job = next++; job < jobs; job = next++) {
      const bool raster = job >= pictures.size();
      Picture& target = pictures[job % pictures.size()];
      const double left = std::max(0.0, std::chrono::duration<double>(end - Clock::now()).count());
      Expected<std::string> picture =
          raster ? render_png(target.figure.plot, left) : render_svg(target.figure.plot, left);
      if (!picture) {
        problems[job] = to_string(picture.error());
      } else if (raster) {
        target.png = *std::move(picture);
      } else {
        target.svg = *std::move(picture);
      }
    }
  };
  const auto work = [&] {
    try {
      draw_all();
    } catch (const std::bad_alloc&) {
      short_of_memory = true;  // A thread that an exception leaves ends the process.
    }
  };
  // Each picture is a process of its own; waiting for one costs nothing.
  std::vector<std::jthread> workers;
  const std::size_t threads =
      std::min<std::size_t>(jobs, std::clamp(std::thread::hardware_concurrency(), 1U, 8U));
  try {
    for (std::size_t i = 1; i < threads; ++i) {
      workers.emplace_back(work);
    }
  } catch (const std::system_error&) {
    // The system has no more threads: those that there are do the work.
  }
  work();
  workers.clear();
  if (short_of_memory) {
    throw std::bad_alloc();
  }
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    pictures[i].problem = !png || !problems[i].empty() ? problems[i] : problems[i + figures.size()];
  }
  return pictures;
}

}  // namespace flyball::report
