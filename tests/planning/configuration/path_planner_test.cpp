#include <flyball/planning/configuration/path_planner.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/planning/configuration/grid_path.hpp>

#include "planning/configuration/scenes.hpp"

namespace flyball::path_planner_test {
namespace {

constexpr double pi = std::numbers::pi;

/// What is wrong with a path, judged with doubles along each move and at 400 samples of it.
std::string fault(const ConfigurationSpace& space, const ConfigurationPath& path,
                  const std::vector<double>& start, const std::vector<double>& goal) {
  if (path.waypoints.size() < 2 || path.waypoints.front() != start) {
    return "it does not begin at the start";
  }
  if (space.length(space.difference(path.waypoints.back(), goal)) > 1e-12) {
    return "it does not end at the goal";
  }
  double length = 0.0;
  for (std::size_t i = 0; i + 1 < path.waypoints.size(); ++i) {
    std::vector<double> by = path.waypoints[i + 1];
    for (std::size_t k = 0; k < by.size(); ++k) {
      by[k] -= path.waypoints[i][k];
    }
    length += space.length(by);
    const MoveCheck move = space.check_move(path.waypoints[i], by);
    if (!move.free) {
      return move.constraint + " stops it at " + std::to_string(move.at) + " of move " +
             std::to_string(i + 1);
    }
    for (int n = 0; n <= 400; ++n) {
      std::vector<double> q = path.waypoints[i];
      for (std::size_t k = 0; k < q.size(); ++k) {
        q[k] += by[k] * n / 400.0;
      }
      if (!space.valid(q)) {
        return "a sample is not valid";
      }
    }
  }
  return std::abs(length - path.length) > 1e-9 * (1.0 + length) ? "its length is another" : "";
}

// Figure 16.4: the shortest way from x to r goes around both corners of the chassis.
TEST(PathPlanner, GoesAroundTheCornersOfFigure16_4) {
  const ConfigurationSpace space = test::elevator_arm();
  const std::vector<double> x{-1.0, 0.5};
  const std::vector<double> r{1.0, 0.5};
  const auto path = plan_path(space, x, r);
  ASSERT_TRUE(path) << to_string(path.error());
  EXPECT_EQ(path->method, PathMethod::corners);
  const std::vector<std::vector<double>> book{x, {-0.25 * pi, 2.0}, {0.25 * pi, 2.0}, r};
  EXPECT_EQ(path->waypoints, book);
  EXPECT_EQ(fault(space, *path, x, r), "");
}

TEST(PathPlanner, EveryMethodFindsTheWayOfFigure16_4) {
  const ConfigurationSpace space = test::elevator_arm();
  const std::vector<double> x{-1.0, 0.5};
  const std::vector<double> r{1.0, 0.5};
  const double shortest = plan_path(space, x, r)->length;
  for (const PathMethod method :
       {PathMethod::corners, PathMethod::grid, PathMethod::rrt_connect, PathMethod::rrt_star,
        PathMethod::roadmap, PathMethod::decomposition}) {
    const PathSearch search{.method = method};
    const auto path = plan_path(space, x, r, search);
    ASSERT_TRUE(path) << to_string(method) << ": " << to_string(path.error());
    EXPECT_EQ(path->method, method);
    EXPECT_EQ(fault(space, *path, x, r), "") << to_string(method);
    EXPECT_LT(path->length, 1.6 * shortest) << to_string(method);
    EXPECT_GE(path->length, shortest * (1.0 - 1e-12)) << to_string(method);
    EXPECT_EQ(plan_path(space, x, r, search)->waypoints, path->waypoints) << to_string(method);
    EXPECT_EQ(parse_path_method(to_string(method)).value(), method);
  }
  const auto straight = plan_path(space, x, r, {.method = PathMethod::straight});
  ASSERT_FALSE(straight);
  EXPECT_TRUE(straight.error().is(ConfigurationError::blocked_move));
  EXPECT_NE(to_string(straight.error()).find("chassis"), std::string::npos);
}

// Arms among discs: what is found is valid in doubles, too; what is not found is said.
TEST(PathPlanner, PathsOfArmsAreValid) {
  for (const bool wide : {true, false}) {
    int found = 0;
    for (std::uint32_t seed = 3; seed < 6; ++seed) {
      const ConfigurationSpace space = test::arm_space(seed, seed == 4);
      PathPlanner planner(space);
      Random random(seed);
      for (int trial = 0; trial < 30; ++trial) {
        const std::vector<double> start = test::valid_configuration(space, random);
        const std::vector<double> goal = test::valid_configuration(space, random);
        const PathSearch search{.method = PathMethod::rrt_connect,
                                .seed = static_cast<std::uint64_t>(trial),
                                .work = 300,
                                .shorten = trial % 2 == 0,
                                .wide = wide};
        const auto path = planner.plan(start, goal, search);
        if (!path) {
          EXPECT_TRUE(path.error().is(ConfigurationError::undecided));
          continue;
        }
        ++found;
        EXPECT_EQ(fault(space, *path, start, goal), "");
      }
    }
    EXPECT_GT(found, 50);
  }
}

// A turret without stops goes the short way around; with a cable in the way the long one.
TEST(PathPlanner, AnglesThatWrapGoEitherWay) {
  auto space = ConfigurationSpace::create(
                   {{.name = "turret", .unit = "rad", .low = -pi, .high = pi, .wraps = true},
                    {.name = "hood", .unit = "rad", .low = 0.0, .high = 1.0}})
                   .value();
  const std::vector<double> start{3.0, 0.5};
  const std::vector<double> goal{-3.0, 0.5};
  const auto around = plan_path(space, start, goal);
  ASSERT_TRUE(around);
  EXPECT_NEAR(around->waypoints.back()[0], -3.0 + 2.0 * pi, 1e-12);
  test::must(space.forbid("cable", Region::interval(0, 3.1, 3.2)));
  const auto back = plan_path(space, start, goal);
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_EQ(fault(space, *back, start, goal), "");
  EXPECT_NEAR(back->waypoints.back()[0], -3.0, 1e-9);
  test::must(space.forbid("other cable", Region::interval(0, 0.0, 0.1)));
  const auto none = plan_path(space, start, goal);
  ASSERT_FALSE(none);
  EXPECT_TRUE(none.error().is(ConfigurationError::no_path)) << to_string(none.error());
}

// A wall without a gap is proven; one with a gap of a tenth of a percent is passed.
TEST(PathPlanner, WallsAreProvenAndGapsAreFound) {
  for (const double gap : {0.0, 1e-3}) {
    auto space = ConfigurationSpace::create({{.name = "x", .unit = "m", .low = 0.0, .high = 1.0},
                                             {.name = "y", .unit = "m", .low = 0.0, .high = 1.0},
                                             {.name = "z", .unit = "m", .low = 0.0, .high = 1.0}})
                     .value();
    test::must(
        space.forbid("wall", Region::interval(0, 0.45, 0.55) & Region::interval(1, gap, 2.0)));
    const std::vector<double> start{0.2, 0.3, 0.4};
    const std::vector<double> goal{0.8, 0.5, 0.6};
    const auto path = plan_path(space, start, goal);
    if (gap == 0.0) {
      ASSERT_FALSE(path);
      EXPECT_TRUE(path.error().is(ConfigurationError::no_path)) << to_string(path.error());
    } else {
      ASSERT_TRUE(path) << to_string(path.error());
      EXPECT_EQ(fault(space, *path, start, goal), "");
    }
  }
}

// Regions that touch leave no way between them.
TEST(PathPlanner, NoWayLeadsBetweenRegionsThatTouch) {
  auto space = test::elevator_arm();
  test::must(space.forbid("mast", Region::box({-0.25 * pi, 2.0}, {0.25 * pi, 6.0})));
  const auto path = plan_path(space, std::vector{-1.0, 0.5}, std::vector{1.0, 0.5});
  ASSERT_FALSE(path);
  EXPECT_TRUE(path.error().is(ConfigurationError::no_path)) << to_string(path.error());
}

TEST(PathPlanner, BadQueriesAreExplained) {
  const ConfigurationSpace space = test::elevator_arm();
  const std::vector<double> x{-1.0, 0.5};
  const auto in_chassis = plan_path(space, x, std::vector{0.0, 1.5});
  ASSERT_FALSE(in_chassis);
  EXPECT_EQ(to_string(in_chassis.error()),
            "plan: the goal is in breach of chassis by 0.5 rad or m; it must be a configuration "
            "that breaks no "
            "constraint (configuration = [0, 1.5])");
  EXPECT_TRUE(plan_path(space, x, std::vector{0.0}).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      plan_path(space, std::vector{std::nan(""), 0.0}, x).error().is(ArgumentError::not_finite));
  EXPECT_FALSE(plan_path(space, x, x, {.seconds = 0.0}));
  EXPECT_FALSE(plan_path(space, x, x, {.work = 0}));
  EXPECT_FALSE(plan_path(space, x, x, {.cells = 3}));
  EXPECT_FALSE(plan_path(space, x, x, {.clearance = -1.0}));
  EXPECT_FALSE(parse_path_method("teleport"));
  const auto still = plan_path(space, x, x);
  ASSERT_TRUE(still);
  EXPECT_EQ(still->length, 0.0);
  const auto arm = test::arm_space(3);
  EXPECT_FALSE(plan_path(arm, std::vector{0.5, -1.57, 0.0, 0.0}, std::vector{0.5, 2.5, 0.0, 0.0},
                         {.method = PathMethod::corners}));
}

OccupancyGrid empty_grid(int size) {
  return {
      size, size,
      std::vector<std::uint8_t>(static_cast<std::size_t>(size) * static_cast<std::size_t>(size))};
}

// In the open the way is the straight line; behind a wall that leaves one cell it bends there.
TEST(GridPath, GoesStraightAndAroundWalls) {
  OccupancyGrid grid = empty_grid(50);
  auto way = grid_path(grid, {3, 4}, {45, 20});
  ASSERT_TRUE(way && *way);
  EXPECT_EQ((*way)->cells.size(), 2U);
  EXPECT_NEAR((*way)->length, std::hypot(42.0, 16.0), 1e-12);
  for (int r = 0; r < 49; ++r) {
    grid.blocked[static_cast<std::size_t>(r * 50 + 25)] = 1;
  }
  way = grid_path(grid, {3, 4}, {45, 4});
  ASSERT_TRUE(way && *way);
  EXPECT_NEAR((*way)->length, std::hypot(21.0, 45.0) + 2.0 + std::hypot(19.0, 45.0), 1e-9);
  grid.blocked[49 * 50 + 25] = 1;
  way = grid_path(grid, {3, 4}, {45, 4});
  ASSERT_TRUE(way);
  EXPECT_FALSE(*way);
  EXPECT_FALSE(grid_path(grid, {25, 3}, {3, 4}));
  EXPECT_FALSE(grid_path(grid, {3, 4}, {50, 4}));
  grid.rows = 49;
  EXPECT_FALSE(grid_path(grid, {3, 4}, {4, 4}));
}

// Cost against breadth-first reachability, and every line sampled.
TEST(GridPath, FindsAWayExactlyWhereThereIsOne) {
  Random random(4);
  int found = 0;
  for (int trial = 0; trial < 300; ++trial) {
    constexpr int n = 40;
    OccupancyGrid grid = empty_grid(n);
    for (auto& cell : grid.blocked) {
      cell = random.uniform() < 0.38 ? 1 : 0;
    }
    const auto at = [&](int c, int r) -> std::uint8_t& {
      return grid.blocked[static_cast<std::size_t>(r * n + c)];
    };
    at(1, 1) = 0;
    at(n - 2, n - 2) = 0;
    const auto way = grid_path(grid, {1, 1}, {n - 2, n - 2});
    ASSERT_TRUE(way);
    // What four steps reach is what eight do when diagonals need both sides.
    std::vector<int> open{n + 1};
    std::vector<bool> seen(static_cast<std::size_t>(n * n), false);
    seen[static_cast<std::size_t>(n + 1)] = true;
    while (!open.empty()) {
      const int i = open.back();
      open.pop_back();
      for (const auto& [dc, dr] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const int c = i % n + dc;
        const int r = i / n + dr;
        if (c >= 0 && r >= 0 && c < n && r < n && at(c, r) == 0 &&
            !seen[static_cast<std::size_t>(r * n + c)]) {
          seen[static_cast<std::size_t>(r * n + c)] = true;
          open.push_back(r * n + c);
        }
      }
    }
    ASSERT_EQ(way->has_value(), seen[static_cast<std::size_t>((n - 2) * n + n - 2)]);
    if (!*way) {
      continue;
    }
    ++found;
    const auto& cells = (*way)->cells;
    for (std::size_t i = 0; i + 1 < cells.size(); ++i) {
      for (int k = 0; k <= 500; ++k) {
        const double s = (k + 0.5) / 502.0;
        const double x = cells[i][0] + s * (cells[i + 1][0] - cells[i][0]);
        const double y = cells[i][1] + s * (cells[i + 1][1] - cells[i][1]);
        const int c = static_cast<int>(std::floor(x + 0.5));
        const int r = static_cast<int>(std::floor(y + 0.5));
        ASSERT_EQ(at(c, r), 0) << c << " " << r;
      }
    }
  }
  EXPECT_GT(found, 40);
}

// Discs within reach of the first link part the space of the arm into an upper and a lower side:
// boxes prove it, and never of ends that random trees join.
TEST(PathPlanner, ProvesThatDiscsPartTheSpaceOfAnArm) {
  int proven = 0;
  int joined = 0;
  for (const std::uint32_t seed : {9U, 16U}) {
    const ConfigurationSpace space = test::arm_space(seed, true);
    PathPlanner planner(space);
    Random random(seed);
    for (int i = 0; i < 8; ++i) {
      const std::vector<double> start = test::valid_configuration(space, random);
      const std::vector<double> goal = test::valid_configuration(space, random);
      PathSearch trees;
      trees.method = PathMethod::rrt_connect;
      trees.work = 2000;
      trees.shorten = false;
      const bool found = planner.plan(start, goal, trees).has_value();
      PathSearch boxes;
      boxes.method = PathMethod::decomposition;
      boxes.work = 20'000;
      boxes.shorten = false;
      boxes.wide = i % 2 == 0;
      const auto path = planner.plan(start, goal, boxes);
      joined += found ? 1 : 0;
      if (path) {
        EXPECT_EQ(fault(space, *path, start, goal), "") << "seed " << seed << ", pair " << i;
      } else if (path.error().is(ConfigurationError::no_path)) {
        EXPECT_FALSE(found) << "seed " << seed << ", pair " << i;
        ++proven;
      }
    }
  }
  EXPECT_GE(proven, 4);
  EXPECT_GE(joined, 5);
}

// What a planner has learnt of a space changes no verdict, and proves the next query sooner.
TEST(PathPlanner, KeepsWhatBoxesProve) {
  const ConfigurationSpace space = test::arm_space(16, true);
  Random random(4);
  PathPlanner keeps(space);
  int proven = 0;
  int proven_at_once = 0;
  for (int i = 0; i < 30; ++i) {
    const std::vector<double> start = test::valid_configuration(space, random);
    const std::vector<double> goal = test::valid_configuration(space, random);
    PathSearch search;
    search.seed = static_cast<std::uint64_t>(i);
    search.seconds = 60.0;
    const auto kept = keeps.plan(start, goal, search);
    const auto fresh = plan_path(space, start, goal, search);
    ASSERT_EQ(kept.has_value(), fresh.has_value()) << i;
    if (kept) {
      EXPECT_EQ(fault(space, *kept, start, goal), "") << i;
      continue;
    }
    ASSERT_TRUE(kept.error().is(ConfigurationError::no_path)) << to_string(kept.error());
    ASSERT_TRUE(fresh.error().is(ConfigurationError::no_path)) << to_string(fresh.error());
    ++proven;
    // Either way between the ends.
    const auto back = keeps.plan(goal, start, search);
    ASSERT_FALSE(back);
    proven_at_once += back.error().is(ConfigurationError::no_path) ? 1 : 0;
  }
  EXPECT_GE(proven, 3);
  EXPECT_EQ(proven_at_once, proven);
}

// Paths that were found lead the next query: valid along their whole length, the same in the same
// order of queries, and no query loses its path.
TEST(PathPlanner, LearnsFromThePathsThatItFinds) {
  const ConfigurationSpace space = test::arm_space(5, true);
  Random random(9);
  PathPlanner learns(space);
  PathPlanner again(space);
  int by_known_moves = 0;
  long moves_of_known = 0;
  for (int i = 0; i < 60; ++i) {
    const std::vector<double> start = test::valid_configuration(space, random);
    const std::vector<double> goal = test::valid_configuration(space, random);
    PathSearch search;
    search.seed = static_cast<std::uint64_t>(i);
    search.seconds = 60.0;
    search.shorten = i % 2 == 0;
    const auto path = learns.plan(start, goal, search);
    ASSERT_TRUE(path) << to_string(path.error());
    EXPECT_EQ(fault(space, *path, start, goal), "") << i;
    EXPECT_EQ(again.plan(start, goal, search).value().waypoints, path->waypoints) << i;
    EXPECT_TRUE(plan_path(space, start, goal, search)) << i;
    if (path->method == PathMethod::roadmap) {
      ++by_known_moves;
      moves_of_known += search.shorten ? 0 : path->moves;
    }
  }
  EXPECT_GE(by_known_moves, 15);
  EXPECT_LE(moves_of_known, 13 * by_known_moves);  // the straight one, and six from either end
}

}  // namespace
}  // namespace flyball::path_planner_test
