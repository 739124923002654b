// Choreo's trajectories solved again from their waypoints: how long they take to find and to
// drive, and what a simulation at 100 instants of each interval says.
//   bench_drive_trajectories [FOLDER]      every .traj and .chor of the folder
//   bench_drive_trajectories --random N    N random drives, numbered by their seeds
//   bench_drive_trajectories --seed S      one of them

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include <flyball/study/optimize.hpp>

#include "random_drives.hpp"

namespace {

using namespace flyball;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double processor() {
  timespec at{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
  return static_cast<double>(at.tv_sec) + 1e-9 * static_cast<double>(at.tv_nsec);
}

/// The first run counts as the cold one; the least of several says what the work costs.
struct Timed {
  DriveSolution solution{};
  double cold = 0.0, least = 1e300, least_processor = 1e300;
};

Timed timed(const DriveProblem& problem, int runs) {
  Timed result;
  for (int i = 0; i < runs; ++i) {
    const double wall = now();
    const double cpu = processor();
    auto solution = optimize_drive(problem);
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

double worst_of(const DriveSolution& solution) {
  return solution.violations.empty() ? 0.0 : solution.violations.front().share;
}

int files(const std::string& folder) {
  std::vector<std::string> paths;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    const std::string end = entry.path().extension().string();
    if (end == ".traj" || end == ".chor") {
      paths.push_back(entry.path().string());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::printf(
      "| file | trajectory | s in the file | s found | change %% | cold ms | least ms | "
      "processor ms | attempts | waypoints mm | worst limit %% | solved |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  bool good = true;
  for (const std::string& path : paths) {
    const auto job = study::optimize_job(path);
    const std::string name = std::filesystem::path(path).filename().string();
    if (!job) {
      std::printf("| %s | not a problem: %s |\n", name.c_str(), to_string(job.error()).c_str());
      continue;
    }
    for (const study::OptimizeTask& task : job->tasks) {
      const Timed t = timed(task.problem, 10);
      const double given = task.given_duration.value_or(0.0);
      std::printf(
          "| %s | %s | %.4f | %.4f | %+.2f | %.0f | %.0f | %.0f | %zu | %.1e | %.1e | %s |\n",
          name.c_str(), task.name.c_str(), given, t.solution.duration,
          given > 0.0 ? 100.0 * (t.solution.duration / given - 1.0) : 0.0, 1e3 * t.cold,
          1e3 * t.least, 1e3 * t.least_processor, t.solution.attempts.size(),
          1e3 * t.solution.waypoint_error, 100.0 * worst_of(t.solution),
          t.solution.solved ? "yes" : t.solution.message.c_str());
      good = good && t.solution.solved && t.least < 0.2 &&
             (given <= 0.0 || t.solution.duration < 1.005 * given);
    }
  }
  return good ? 0 : 1;
}

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
    slow += t.cold > 0.2 ? 1 : 0;
    most = std::max(most, t.least_processor);
    total += t.least_processor;
    driven += s.duration;
    if (s.solved) {
      worst = std::max(worst, worst_of(s));
      waypoints = std::max(waypoints, s.waypoint_error);
    }
    if (!s.solved || bad || t.cold > 1.0) {
      tell(static_cast<unsigned long long>(seed), problem, s, t.cold);
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
  if (argc == 3 && std::strcmp(argv[1], "--random") == 0) {
    return random_drives(std::max(1, std::atoi(argv[2])));
  }
  if (argc == 3 && std::strcmp(argv[1], "--seed") == 0) {
    const auto seed = std::strtoull(argv[2], nullptr, 10);
    Random random(seed);
    const DriveProblem problem = bench::random_drive(random);
    const Timed t = timed(problem, 1);
    tell(seed, problem, t.solution, t.cold);
    for (const DriveAttempt& a : t.solution.attempts) {
      std::printf("    %s: %s %.4f s, %d iterations, %.0f ms\n", a.name.c_str(),
                  a.solved ? "solved" : "not solved", a.duration, a.iterations, 1e3 * a.seconds);
    }
    return 0;
  }
  return files(argc > 1 ? argv[1] : "../shared/data/choreo");
}
