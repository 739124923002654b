// Choreo's trajectories solved again from their waypoints: how long they take to find and to
// drive, and what a simulation at 100 instants of each interval says.
//   bench_drive_trajectories [FOLDER]   every .traj and .chor of the folder

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <flyball/study/optimize.hpp>

#include "timed_drive.hpp"

namespace {

using namespace flyball;

using bench::Timed;
using bench::timed;
using bench::worst_of;

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

}  // namespace

int main(int argc, char** argv) {
  return files(argc > 1 ? argv[1] : "../shared/data/choreo");
}
