// A bound of time is kept, however long a piece of the work takes.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include <flyball/planning/configuration/path_planner.hpp>

#include "planning/configuration/path_search.hpp"

namespace flyball::search_bounds_test {
namespace {

using namespace std::chrono_literals;

TEST(WorkBound, LooksAtTheClockAsOftenAsItsPiecesAreLong) {
  detail::WorkBound bound(1'000'000, 0.05);
  // Short ones first, so that it looks rarely, then long ones.
  for (int i = 0; i < 3000; ++i) {
    ASSERT_TRUE(bound.spend() || bound.late());
  }
  int pieces = 0;
  while (bound.spend()) {
    std::this_thread::sleep_for(200us);
    ++pieces;
  }
  EXPECT_TRUE(bound.late());
  // At most the 256 that it had got to, and after one look some more.
  EXPECT_LE(pieces, 600);
  detail::WorkBound next(1'000'000, 0.05);
  pieces = 0;
  while (next.spend()) {
    std::this_thread::sleep_for(10ms);
    ++pieces;
  }
  EXPECT_LE(pieces, 20);
}

TEST(WorkBound, APartEndsWithTheWhole) {
  detail::WorkBound whole(100, 1e-9);
  std::this_thread::sleep_for(1ms);
  detail::WorkBound part(1'000'000'000, 1000.0, whole);
  long pieces = 0;
  while (part.spend()) {
    ++pieces;
  }
  EXPECT_TRUE(part.late());
  EXPECT_LE(pieces, 16);
}

// A wall across sixteen axes: trees of any number of nodes do not pass it.
TEST(PathPlanner, EndsWhenItsTimeIsOver) {
  std::vector<SpaceAxis> axes;
  for (int k = 0; k < 16; ++k) {
    axes.push_back({.name = "a" + std::to_string(k), .low = 0.0, .high = 1.0});
  }
  auto space = ConfigurationSpace::create(axes).value();
  ASSERT_TRUE(space.forbid("wall", Region::interval(0, 0.4, 0.6)));
  std::vector<double> start(16, 0.5);
  std::vector<double> goal = start;
  start[0] = 0.1;
  goal[0] = 0.9;
  PathSearch search;
  search.seconds = 0.3;
  const auto path = plan_path(space, start, goal, search);
  ASSERT_FALSE(path);
  EXPECT_TRUE(path.error().is(ConfigurationError::undecided));
  EXPECT_NE(to_string(path.error()).find("more seconds"), std::string::npos);
}

}  // namespace
}  // namespace flyball::search_bounds_test
