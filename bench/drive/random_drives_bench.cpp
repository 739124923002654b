// Random drives among obstacles: how many are solved, and what they cost.
//   bench_random_drives N            N of them, numbered by their seeds
//   bench_random_drives --seed S     one of them, with its attempts

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include <flyball/planning/drive/optimize_drive.hpp>

#include "random_drives.hpp"
#include "timed_drive.hpp"

namespace {

using bench::Timed;
using bench::timed;
using bench::worst_of;
using namespace flyball;

void tell(unsigned long long seed, const DriveProblem& problem, const DriveSolution& s,
          double seconds) {
  std::printf(
      "%llu %s, %zu waypoints, %zu constraints: %.3f s in %.0f ms, %zu attempts, best %s; "
      "waypoints %.1e m, %s\n",
      seed, std::string(to_string(problem.model.drivetrain)).c_str(), problem.waypoints.size(),
      problem.constraints.size(), s.duration, 1e3 * seconds, s.attempts.size(), s.best.c_str(),
      s.waypoint_error, s.solved ? "solved" : s.message.c_str());
  for (const DriveViolation& v : s.violations) {
    if (v.share > 1e-4) {
      std::printf("    %s: %.2e %s, %.2e of its limit, at %.3f s\n", v.name.c_str(), v.amount,
                  v.unit.c_str(), v.share, v.time);
    }
  }
}

int random_drives(int count) {
  int solved = 0, exceeded = 0, slow = 0;
  double most = 0.0, total = 0.0, worst = 0.0, waypoints = 0.0, driven = 0.0;
  for (int seed = 0; seed < count; ++seed) {
    Random random(static_cast<unsigned long long>(seed));
    const DriveProblem problem = bench::random_drive(random);
    const Timed t = timed(problem, 1);
    const DriveSolution& s = t.solution;
    solved += s.solved ? 1 : 0;
    const bool bad = worst_of(s) > 1e-3 || s.waypoint_error > 1e-3;
    exceeded += bad ? 1 : 0;
    slow += t.least_processor > 0.2 ? 1 : 0;
    most = std::max(most, t.least_processor);
    total += t.least_processor;
    driven += s.duration;
    if (s.solved) {
      worst = std::max(worst, worst_of(s));
      waypoints = std::max(waypoints, s.waypoint_error);
    }
    if (!s.solved || bad || t.least_processor > 0.2) {
      tell(static_cast<unsigned long long>(seed), problem, s, t.least_processor);
    }
  }
  std::printf(
      "%d of %d solved, %d beyond 0.1 %% or 1 mm; of the solved: worst limit %.2e, "
      "waypoints %.2e m; %d above 200 ms; processor %.0f ms each, %.0f at most; %.2f s "
      "driven in all\n",
      solved, count, exceeded, worst, waypoints, slow, 1e3 * total / count, 1e3 * most, driven);
  return solved == count && exceeded == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  if (argc == 3 && std::strcmp(argv[1], "--seed") == 0) {
    const auto seed = std::strtoull(argv[2], nullptr, 10);
    Random random(seed);
    const DriveProblem problem = bench::random_drive(random);
    const Timed t = timed(problem, 1);
    tell(seed, problem, t.solution, t.least_processor);
    for (const DriveAttempt& a : t.solution.attempts) {
      std::printf("    %s: %s %.4f s, %d iterations, %.0f ms\n", a.name.c_str(),
                  a.solved ? "solved" : "not solved", a.duration, a.iterations, 1e3 * a.seconds);
    }
    return 0;
  }
  return random_drives(argc > 1 ? std::max(1, std::atoi(argv[1])) : 20);
}
