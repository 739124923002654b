// Paths of arms among discs, and over grids: planning times, beside OMPL's RRT-Connect where it is
// installed.
//   bench_planning [PAIRS] [SCENES] [SECONDS]
// By default 20 pairs of valid configurations, 20 scenes, and 0.5 s for a query that is not solved:
// a minute or two. The campaign is 400 20 10. Each scene is told when it is done. Times of ours are
// the processor's.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/planning/configuration/grid_path.hpp>
#include <flyball/planning/configuration/path_planner.hpp>

#include "planning/configuration/scenes.hpp"

#ifdef FLYBALL_HAS_OMPL
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#endif

namespace {

using namespace flyball;
using Clock = std::chrono::steady_clock;

/// µs of the processor.
double used() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

[[maybe_unused]] double since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

std::vector<double> valid_configuration(const ConfigurationSpace& space, Random& random) {
  while (true) {
    std::vector<double> q = test::random_configuration(space, random);
    if (space.valid(q)) {
      return q;
    }
  }
}

double quantile(std::vector<double> times, double share) {
  if (times.empty()) {
    return 0.0;
  }
  std::sort(times.begin(), times.end());
  return times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
}

#ifdef FLYBALL_HAS_OMPL
/// s; negative if it was not solved. Moves are sampled at 0.01, as OMPL does.
double by_ompl(const ConfigurationSpace& space, const std::vector<double>& start,
               const std::vector<double>& goal) {
  namespace ob = ompl::base;
  auto states = std::make_shared<ob::RealVectorStateSpace>(space.dimension());
  ob::RealVectorBounds bounds(static_cast<unsigned>(space.dimension()));
  for (int k = 0; k < space.dimension(); ++k) {
    bounds.setLow(static_cast<unsigned>(k), space.axes()[static_cast<std::size_t>(k)].low);
    bounds.setHigh(static_cast<unsigned>(k), space.axes()[static_cast<std::size_t>(k)].high);
  }
  states->setBounds(bounds);
  ompl::geometric::SimpleSetup setup(states);
  const auto n = static_cast<std::size_t>(space.dimension());
  setup.setStateValidityChecker([&](const ob::State* state) {
    const double* values = state->as<ob::RealVectorStateSpace::StateType>()->values;
    return space.valid(std::span(values, n));
  });
  setup.getSpaceInformation()->setStateValidityCheckingResolution(0.01);
  ob::ScopedState<ob::RealVectorStateSpace> from(states);
  ob::ScopedState<ob::RealVectorStateSpace> to(states);
  for (std::size_t k = 0; k < n; ++k) {
    from[static_cast<unsigned>(k)] = start[k];
    to[static_cast<unsigned>(k)] = goal[k];
  }
  setup.setStartAndGoalStates(from, to);
  setup.setPlanner(std::make_shared<ompl::geometric::RRTConnect>(setup.getSpaceInformation()));
  setup.setup();
  const auto begin = Clock::now();
  const bool solved = setup.solve(0.4) == ob::PlannerStatus::EXACT_SOLUTION;
  const double time = since(begin);
  return solved ? time : -1.0;
}
#endif

void arms(int pairs, int scenes, double seconds, bool points) {
  std::printf("\n%s: µs of solved queries\n", points ? "links of six points" : "links as segments");
  std::printf("%5s %8s %7s %7s %9s | %8s %8s %9s | %8s %8s | %8s %8s %6s\n", "seed", "invalid",
              "solved", "proven", "undecided", "median", "p95", "worst", "baseline", "p95", "OMPL",
              "p95", "solved");
  std::vector<double> all;
  std::vector<double> all_plain;
  int taken = 0;
  for (std::uint32_t seed = 3; taken < scenes; ++seed) {
    const ConfigurationSpace space = test::arm_space(seed, points);
    Random random(seed);
    int invalid = 0;
    constexpr int samples = 20000;
    for (int i = 0; i < samples; ++i) {
      invalid += space.valid(test::random_configuration(space, random)) ? 0 : 1;
    }
    const double share = static_cast<double>(invalid) / samples;
    if (share < 0.4 || share > 0.65) {
      continue;
    }
    ++taken;
    // Planners learn from what they are asked: each is asked the same once, and the least counts.
    std::array<PathPlanner, 4> planners{PathPlanner(space), PathPlanner(space), PathPlanner(space),
                                        PathPlanner(space)};
    std::vector<double> times;
    std::vector<double> plain;
    std::vector<double> peer;
    int solved = 0;
    int proven = 0;
    int undecided = 0;
    double slowest_proof = 0.0;
    for (int i = 0; i < pairs; ++i) {
      const std::vector<double> start = valid_configuration(space, random);
      const std::vector<double> goal = valid_configuration(space, random);
      double best = 1e18;
      double best_plain = 1e18;
      bool found = false;
      for (std::size_t repeat = 0; repeat < 2; ++repeat) {
        for (const bool wide : {true, false}) {
          PathPlanner& planner = planners[2 * repeat + (wide ? 0 : 1)];
          PathSearch search;
          search.seed = static_cast<std::uint64_t>(i);
          search.shorten = false;
          search.wide = wide;
          search.seconds = seconds;
          const double begin = used();
          const auto path = planner.plan(start, goal, search);
          const double time = used() - begin;
          (wide ? best : best_plain) = std::min(wide ? best : best_plain, time);
          found = path.has_value();
          if (!found) {
            (path.error().is(ConfigurationError::no_path) ? proven : undecided) += 1;
            slowest_proof = std::max(slowest_proof, time);
            break;
          }
        }
        if (!found) {
          break;
        }
      }
      if (found) {
        ++solved;
        times.push_back(best);
        plain.push_back(best_plain);
      }
#ifdef FLYBALL_HAS_OMPL
      if (i < 60) {
        const double time = by_ompl(space, start, goal);
        if (time >= 0.0) {
          peer.push_back(time);
        }
      }
#endif
    }
    all.insert(all.end(), times.begin(), times.end());
    all_plain.insert(all_plain.end(), plain.begin(), plain.end());
    std::printf(
        "%5u %8.2f %7d %7d %9d | %8.2f %8.1f %9.0f | %8.2f %8.1f | %8.1f %8.0f %6zu"
        "  slowest answer without a path %.2f s\n",
        seed, share, solved, proven, undecided, quantile(times, 0.5), quantile(times, 0.95),
        quantile(times, 1.0), quantile(plain, 0.5), quantile(plain, 0.95), quantile(peer, 0.5),
        quantile(peer, 0.95), peer.size(), slowest_proof * 1e-6);
    std::fflush(stdout);
  }
  std::printf("all: median %.2f, p95 %.1f; baseline %.2f, %.1f\n", quantile(all, 0.5),
              quantile(all, 0.95), quantile(all_plain, 0.5), quantile(all_plain, 0.95));
}

void grids() {
  constexpr int n = 1000;
  const auto grid_of = [&](const char* kind) {
    OccupancyGrid grid{n, n, std::vector<std::uint8_t>(n * n, 0)};
    Random random(7);
    const std::string name = kind;
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c < n; ++c) {
        bool blocked = false;
        if (name == "random, 30 % blocked") {
          blocked = random.uniform() < 0.3;
        } else if (name == "serpentine, walls of one cell") {
          blocked = r % 2 == 1 && c != (r % 4 == 1 ? n - 1 : 0);
        } else if (name == "serpentine, lanes of ten cells") {
          blocked = r % 11 == 10 && (r % 22 == 10 ? c < n - 10 : c >= 10);
        } else if (name == "cup around the goal") {
          blocked = (c == n - 200 && r > 50) || (r == 50 && c >= n - 200 && c < n - 20);
        }
        grid.blocked[static_cast<std::size_t>(r * n + c)] = blocked ? 1 : 0;
      }
    }
    grid.blocked.front() = 0;
    grid.blocked[static_cast<std::size_t>((n - 2) * n + n - 2)] = 0;
    return grid;
  };
  std::printf("\ngrids of 1000 x 1000: ms\n");
  for (const char* kind : {"empty", "random, 30 % blocked", "serpentine, walls of one cell",
                           "serpentine, lanes of ten cells", "cup around the goal"}) {
    const OccupancyGrid grid = grid_of(kind);
    double best = 1e18;
    double length = 0.0;
    long expanded = 0;
    for (int repeat = 0; repeat < 7; ++repeat) {
      const double begin = used();
      const auto way = grid_path(grid, {0, 0}, {n - 2, n - 2});
      best = std::min(best, used() - begin);
      if (way && *way) {
        length = (*way)->length;
        expanded = (*way)->expanded;
      }
    }
    std::printf("%-32s %7.2f   length %.1f, %ld cells expanded\n", kind, best * 1e-3, length,
                expanded);
  }
}

}  // namespace

int main(int argc, char** argv) {
#ifdef FLYBALL_HAS_OMPL
  ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
#endif
  const int pairs = argc > 1 ? std::atoi(argv[1]) : 20;
  const int scenes = argc > 2 ? std::atoi(argv[2]) : 20;
  const double seconds = argc > 3 ? std::atof(argv[3]) : 0.5;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  grids();
  for (const bool points : {true, false}) {
    arms(pairs, scenes, seconds, points);
  }
  return 0;
}
