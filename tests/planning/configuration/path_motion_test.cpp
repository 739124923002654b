#include <flyball/planning/configuration/path_motion.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "planning/configuration/scenes.hpp"

namespace flyball::path_motion_test {
namespace {

constexpr double pi = std::numbers::pi;

std::vector<double> row(const ConfigurationSpace& space, const PathMotion& motion, std::size_t i,
                        std::size_t of) {
  std::vector<double> q;
  for (std::size_t k = 0; k < space.axes().size(); ++k) {
    q.push_back(motion.table.columns()[3 * k + of].values[i]);
  }
  return q;
}

/// What is wrong with a motion at its rows.
std::string fault(const ConfigurationSpace& space, const PathMotion& motion,
                  const PathMotionOptions& options, Random& random) {
  for (std::size_t i = 0; i < motion.table.rows(); ++i) {
    const auto q = row(space, motion, i, 0);
    const auto v = row(space, motion, i, 1);
    const auto a = row(space, motion, i, 2);
    for (std::size_t k = 0; k < q.size(); ++k) {
      const MotionLimits all = options.limits[k].both_ways();
      if (v[k] > all.velocity * (1 + 1e-9) || -v[k] > all.reverse_velocity * (1 + 1e-9)) {
        return "too fast";
      }
      if (a[k] > all.acceleration * (1 + 1e-9) || -a[k] > all.deceleration * (1 + 1e-9)) {
        return "too hard";
      }
    }
    for (int n = 0; n < 4; ++n) {
      std::vector<double> off = q;
      for (std::size_t k = 0; k < q.size() && !options.error.empty(); ++k) {
        off[k] += random.uniform(-1.0, 1.0) * options.error[k];
      }
      if (!space.valid(off)) {
        return "not valid when it is off by its error";
      }
    }
  }
  return "";
}

// Figure 16.4's path: three straight moves from rest to rest, each as long as its slowest axis.
TEST(PathMotion, GoesAlongTheLinesOfFigure16_4) {
  const ConfigurationSpace space = test::elevator_arm();
  const std::vector<std::vector<double>> path{
      {-1.0, 0.5}, {-0.25 * pi, 2.0}, {0.25 * pi, 2.0}, {1.0, 0.5}};
  PathMotionOptions options{
      .limits = {{.velocity = 2.0, .acceleration = 4.0}, {.velocity = 1.0, .acceleration = 2.0}}};
  const auto motion = move_along(space, path, options);
  ASSERT_TRUE(motion) << to_string(motion.error());
  // Trapezoids: d/v + v/a.
  const double lift = 1.5 / 1.0 + 1.0 / 2.0;
  const double arm = 0.5 * pi / 2.0 + 2.0 / 4.0;
  EXPECT_NEAR(motion->duration, 2.0 * lift + arm, 1e-9);
  ASSERT_EQ(motion->arrivals.size(), 3U);
  EXPECT_NEAR(motion->arrivals[0], lift, 1e-9);
  // On the line all the time.
  for (std::size_t i = 0; i < motion->table.rows(); ++i) {
    const auto q = row(space, *motion, i, 0);
    if (motion->table.time()[i] < lift) {
      EXPECT_NEAR((q[0] + 1.0) / (1.0 - 0.25 * pi), (q[1] - 0.5) / 1.5, 1e-9);
    }
    EXPECT_TRUE(space.valid(q));
  }
  EXPECT_NEAR(motion->clearance, 0.0, 1e-9);
  // It has no room for an error.
  options.error = {0.02, 0.01};
  const auto refused = move_along(space, path, options);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(ConfigurationError::in_collision));
  EXPECT_NE(to_string(refused.error()).find("waypoint 2 is in breach of chassis"),
            std::string::npos)
      << to_string(refused.error());
}

// With a buffer both traversals keep it, and going on without stops is faster.
TEST(PathMotion, KeepsItsBufferAlongTheWholeMotion) {
  Random random(4);
  int faster = 0;
  int motions = 0;
  for (std::uint32_t seed = 3; seed < 6; ++seed) {
    const ConfigurationSpace space = test::arm_space(seed);
    const std::vector<double> error{0.005, 0.01, 0.01, 0.01};
    const ConfigurationSpace tight = space.with_buffer(error).value();
    PathPlanner planner(tight);
    for (int trial = 0; trial < 40; ++trial) {
      const auto start = test::random_configuration(space, random);
      const auto goal = test::random_configuration(space, random);
      if (!tight.valid(start) || !tight.valid(goal)) {
        continue;
      }
      const auto path =
          planner.plan(start, goal, {.method = PathMethod::rrt_connect, .work = 1000});
      if (!path) {
        continue;
      }
      PathMotionOptions options{
          .limits = {{.velocity = 1.0, .acceleration = 3.0, .jerk = 30.0},
                     {.velocity = 3.0, .acceleration = 10.0, .deceleration = 8.0, .jerk = 100.0},
                     {.velocity = 3.0, .acceleration = 10.0},
                     {.velocity = 4.0, .acceleration = 15.0, .reverse_velocity = 3.0}},
          .error = error};
      double durations[2];
      for (const Traversal traversal : {Traversal::synchronized, Traversal::sequential}) {
        options.traversal = traversal;
        const auto motion = move_along(space, path->waypoints, options);
        ASSERT_TRUE(motion) << to_string(motion.error());
        EXPECT_EQ(fault(space, *motion, options, random), "");
        const auto end = row(space, *motion, motion->table.rows() - 1, 0);
        EXPECT_LT(space.length(space.difference(end, goal)), 1e-6);
        EXPECT_GE(motion->clearance, 0.0);
        durations[traversal == Traversal::sequential ? 1 : 0] = motion->duration;
      }
      ++motions;
      faster += durations[1] < durations[0] - 1e-9 ? 1 : 0;
    }
  }
  EXPECT_GT(motions, 8);
  EXPECT_GT(faster, 2);
}

TEST(PathMotion, WhatCannotBeTimedIsRefused) {
  const ConfigurationSpace space = test::elevator_arm();
  const std::vector<std::vector<double>> path{{-1.0, 0.5}, {1.0, 0.5}};
  const MotionLimits limits{.velocity = 1.0, .acceleration = 1.0};
  EXPECT_TRUE(move_along(space, path, {.limits = {limits}}).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      move_along(space, path, {.limits = {limits, {}}}).error().is(ArgumentError::not_positive));
  const auto blocked = move_along(space, path, {.limits = {limits, limits}});
  ASSERT_FALSE(blocked);
  EXPECT_TRUE(blocked.error().is(ConfigurationError::blocked_move));
  EXPECT_NE(to_string(blocked.error()).find("stopped by chassis"), std::string::npos);
  const std::vector<std::vector<double>> one{{-1.0, 0.5}};
  EXPECT_TRUE(
      move_along(space, one, {.limits = {limits, limits}}).error().is(ArgumentError::empty));
  // Waypoints that coincide, and lie on a line, are no trouble.
  const std::vector<std::vector<double>> still{{-1.0, 0.5}, {-1.0, 0.5}, {-1.0, 1.0}, {-1.0, 1.5}};
  for (const Traversal traversal : {Traversal::synchronized, Traversal::sequential}) {
    const auto motion =
        move_along(space, still, {.limits = {limits, limits}, .traversal = traversal});
    ASSERT_TRUE(motion) << to_string(motion.error());
    EXPECT_EQ(motion->table.columns()[3].values.back(), 1.5);
  }
}

}  // namespace
}  // namespace flyball::path_motion_test
