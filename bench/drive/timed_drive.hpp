#pragma once

#include <algorithm>
#include <chrono>
#include <ctime>
#include <utility>

#include <flyball/planning/drive/optimize_drive.hpp>

namespace bench {

inline double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
inline double processor() {
  timespec at{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
  return static_cast<double>(at.tv_sec) + 1e-9 * static_cast<double>(at.tv_nsec);
}

/// The first run counts as the cold one; the least of several says what the work costs.
struct Timed {
  flyball::DriveSolution solution{};
  double cold = 0.0, least = 1e300, least_processor = 1e300;
};

inline Timed timed(const flyball::DriveProblem& problem, int runs) {
  Timed result;
  for (int i = 0; i < runs; ++i) {
    const double wall = now();
    const double cpu = processor();
    auto solution = flyball::optimize_drive(problem);
    const double took = now() - wall;
    result.least_processor = std::min(result.least_processor, processor() - cpu);
    result.least = std::min(result.least, took);
    if (i == 0) {
      result.cold = took;
      if (solution) {
        result.solution = *std::move(solution);
      } else {
        result.solution.message = to_string(solution.error());
      }
    }
  }
  return result;
}

inline double worst_of(const flyball::DriveSolution& solution) {
  return solution.violations.empty() ? 0.0 : solution.violations.front().share;
}

}  // namespace bench
