// Paths timed: how long it takes, how far from the fastest, and whether limits hold between.
//
//   bench_paths               10 waypoints in 2 and 7 coordinates, 200 paths each, beside the plain
//                             method on grids of 100, 500 and 1000 intervals
//   bench_paths --campaign N  N random paths, checked 100 times finer than their intervals
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/planning/path/build_path.hpp>
#include <flyball/planning/trajectory/path_trajectory.hpp>

#include "planning/trajectory/plain_reachability.hpp"

namespace {

using namespace flyball;

struct Scene {
  Path path;
  CoordinateLimits limits;
};

/// Waypoints U(-1, 1), velocities U(0.5, 1.5), accelerations U(1, 3); natural cubics over 0 to 9.
Scene random_scene(Random& random, int coordinates) {
  Eigen::MatrixXd waypoints(coordinates, 10);
  for (double& value : waypoints.reshaped()) {
    value = random.uniform(-1.0, 1.0);
  }
  CoordinateLimits limits{Eigen::VectorXd(coordinates), Eigen::VectorXd(coordinates)};
  for (int j = 0; j < coordinates; ++j) {
    limits.velocity(j) = random.uniform(0.5, 1.5);
    limits.acceleration(j) = random.uniform(1.0, 3.0);
  }
  return {natural_cubic_path(waypoints, KnotSpacing::uniform).value(), limits};
}

/// µs, the least of several.
template <class Run>
double microseconds(Run&& run) {
  using Clock = std::chrono::steady_clock;
  double best = 1e300;
  for (int pass = 0; pass < 15; ++pass) {
    const auto start = Clock::now();
    run();
    best = std::min(best, std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  return best;
}

/// The largest use of a limit at `count` times, 1 where one is met.
double largest_use(const PathTrajectory& trajectory, const CoordinateLimits& limits,
                   std::size_t count) {
  double most = 0.0;
  for (std::size_t k = 0; k <= count; ++k) {
    const PathSample sample = trajectory.sample(trajectory.total_time() * static_cast<double>(k) /
                                                static_cast<double>(count));
    most = std::max({most, (sample.velocity.array().abs() / limits.velocity.array()).maxCoeff(),
                     (sample.acceleration.array().abs() / limits.acceleration.array()).maxCoeff()});
  }
  return most;
}

void compare(int coordinates) {
  constexpr int paths = 200;
  Random random(42);
  test::PlainReachability plain;
  constexpr int grids[] = {100, 500, 1000};
  double ours = 0.0;
  double gap = 0.0;
  double worst = 0.0;
  double intervals = 0.0;
  double broken = 0.0;
  double sampling = 0.0;
  double theirs[3] = {};
  double their_gap[3] = {};
  double sum = 0.0;
  for (int k = 0; k < paths; ++k) {
    const Scene scene = random_scene(random, coordinates);
    const std::vector<PathConstraint> limits{scene.limits};
    const PathTrajectory best = time_optimal(scene.path, limits, {.tolerance = 1e-6}).value();
    const PathTrajectory trajectory = time_optimal(scene.path, limits).value();
    ours += microseconds([&] { sum += time_optimal(scene.path, limits)->total_time(); }) / paths;
    const double behind = trajectory.total_time() / best.total_time() - 1.0;
    gap += behind / paths;
    worst = std::max(worst, behind);
    intervals += static_cast<double>(trajectory.intervals()) / paths;
    broken =
        std::max(broken, largest_use(trajectory, scene.limits, 100 * trajectory.intervals()) - 1.0);
    constexpr int samples = 2000;
    sampling += microseconds([&] {
                  for (int i = 0; i < samples; ++i) {
                    sum +=
                        trajectory.sample(trajectory.total_time() * ((i * 769) % samples) / samples)
                            .position(0);
                  }
                }) *
                1e3 / samples / paths;
    for (int g = 0; g < 3; ++g) {
      their_gap[g] +=
          (plain(scene.path, scene.limits.velocity, scene.limits.acceleration, grids[g]) /
               best.total_time() -
           1.0) /
          paths;
      theirs[g] +=
          microseconds([&] {
            sum += plain(scene.path, scene.limits.velocity, scene.limits.acceleration, grids[g]);
          }) /
          paths;
    }
  }
  std::printf("%d coordinates, 10 waypoints, %d paths\n", coordinates, paths);
  std::printf(
      "  flyball      %7.1f us  gap mean %.3f %% worst %.3f %%  %.0f intervals  "
      "beyond a limit by %.1e  sample %.0f ns\n",
      ours, 100.0 * gap, 100.0 * worst, intervals, broken, sampling);
  for (int g = 0; g < 3; ++g) {
    std::printf("  plain %5d  %7.1f us  gap mean %.3f %%  (%.1f times flyball's time)\n", grids[g],
                theirs[g], 100.0 * their_gap[g], theirs[g] / ours);
  }
  if (!std::isfinite(sum)) {
    std::printf("not finite\n");
  }
}

int campaign(int count) {
  Random random(2026);
  double worst = 0.0;
  int failed = 0;
  for (int k = 0; k < count; ++k) {
    const int coordinates = 1 + static_cast<int>(random.uniform(0.0, 7.0));
    const Scene scene = random_scene(random, coordinates);
    const auto trajectory = time_optimal(scene.path, std::vector<PathConstraint>{scene.limits});
    if (!trajectory) {
      ++failed;
      std::printf("path %d: %s\n", k, to_string(trajectory.error()).c_str());
      continue;
    }
    const double use = largest_use(*trajectory, scene.limits, 100 * trajectory->intervals());
    worst = std::max(worst, use - 1.0);
    if (!(use <= 1.0 + 1e-9)) {
      ++failed;
      std::printf("path %d: %.3e beyond a limit\n", k, use - 1.0);
    }
  }
  std::printf("%d paths, %d failed, worst %.2e beyond a limit\n", count, failed, worst);
  return failed > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "--campaign") == 0) {
    return campaign(std::atoi(argv[2]));
  }
  compare(2);
  compare(7);
  return 0;
}
