#include <flyball/planning/trajectory/trajectory.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support/allocation_count.hpp"

namespace flyball::trajectory_test {
namespace {

std::vector<PathPoint> reference_path() {
  const std::vector<Pose2d> waypoints{{1.330117, 13.0, 0.0}, {10.17, 18.0, 0.0}};
  return sample_path(quintic_spline(waypoints).value()).value();
}

// book_reference.json, figures.10.1.expected.trajectory: WPILib's spline and time parameterisation.
TEST(TimePath, OfFigures10) {
  const auto path = reference_path();
  const Trajectory trajectory = time_path(path, {.velocity = 3.5, .acceleration = 3.5}).value();
  ASSERT_EQ(trajectory.points().size(), 129U);
  EXPECT_NEAR(trajectory.total_time(), 4.107284417230947, 1e-13);
  struct Row {
    std::size_t k;
    double t, v, a, x, y, theta, kappa;
  };
  const Row rows[] = {
      {1, 0.23323361312695348, 0.8163176459443373, 3.5, 1.425313354095204, 13.000023563334253,
       0.0007398975058646684, 0.015434976064760617},
      {16, 0.9176240026439484, 3.2116840092538204, 3.5, 2.7997798653247656, 13.08026123046875,
       0.1619104428519742, 0.2174441567056353},
      {48, 1.6639876832385159, 3.5, 0.0, 4.979105448070582, 14.37603759765625, 0.8902199914116361,
       0.17978306078024042},
      {112, 3.189660414586998, 3.2116840092538195, -3.5, 8.70033713467523, 17.91973876953125,
       0.16191044285197445, -0.2174441567056359},
      {128, 4.107284417230947, 0.0, -3.5, 10.17, 18.0, 0.0, 0.0},
  };
  for (const Row& row : rows) {
    const TrajectoryPoint& point = trajectory.points()[row.k];
    EXPECT_NEAR(point.time, row.t, 1e-13);
    EXPECT_NEAR(point.velocity, row.v, 1e-13);
    EXPECT_NEAR(point.acceleration, row.a, 1e-12);
    EXPECT_NEAR(point.pose.x(), row.x, 1e-13);
    EXPECT_NEAR(point.pose.y(), row.y, 1e-13);
    EXPECT_NEAR(point.pose.angle(), row.theta, 1e-13);
    EXPECT_NEAR(point.curvature, row.kappa, 1e-12);
  }
}

// Straight over 4 m with v = 2, a = 1: 2 s up, 0, 2 s down; over 1 m: the peak 1 after 1 s.
TEST(TimePath, StraightLines) {
  for (const auto& [length, time] : {std::pair{4.0, 4.0}, {1.0, 2.0}, {8.0, 6.0}}) {
    std::vector<PathPoint> path;
    for (int i = 0; i <= 2000; ++i) {
      path.push_back({Pose2d(length * i / 2000.0, 0.0, 0.0), 0.0});
    }
    const Trajectory trajectory = time_path(path, {.velocity = 2.0, .acceleration = 1.0}).value();
    EXPECT_NEAR(trajectory.total_time(), time, 1e-9);
    EXPECT_NEAR(trajectory.sample(0.5 * time).pose.x(), 0.5 * length, 1e-9);
    EXPECT_NEAR(trajectory.sample(0.5).pose.x(), 0.125, 1e-9);
    EXPECT_NEAR(trajectory.sample(0.5).velocity, 0.5, 1e-6);
  }
}

// Limits hold everywhere, and one of them is met everywhere: nothing is faster.
TEST(TimePath, SomeLimitIsMetEverywhere) {
  const std::vector<Pose2d> waypoints{{0.0, 0.0, 0.0}, {3.0, 2.0, 1.5}, {2.0, 5.0, 3.0}};
  const auto path = sample_path(quintic_spline(waypoints).value()).value();
  const PathLimits limits{.velocity = 3.0,
                          .acceleration = 2.0,
                          .centripetal = 1.5,
                          .start_velocity = 0.5,
                          .end_velocity = 0.2};
  const Trajectory trajectory = time_path(path, limits).value();
  const auto& points = trajectory.points();
  EXPECT_EQ(points.front().velocity, 0.5);
  EXPECT_EQ(points.back().velocity, 0.2);
  const auto cap = [&](const TrajectoryPoint& p) {
    return std::min(limits.velocity, std::sqrt(limits.centripetal / std::abs(p.curvature)));
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LE(points[i].velocity, cap(points[i]) * (1.0 + 1e-12));
    EXPECT_LE(std::abs(points[i].acceleration), limits.acceleration * (1.0 + 1e-9));
    if (i > 0 && i + 1 < points.size()) {
      const double slack = std::min({cap(points[i]) - points[i].velocity,
                                     limits.acceleration - std::abs(points[i].acceleration),
                                     limits.acceleration - std::abs(points[i - 1].acceleration)});
      EXPECT_LE(slack, 1e-9) << i;
    }
  }
  // It is what it integrates to: v = ds/dt on each arc.
  for (double t = 0.0; t + 1e-4 < trajectory.total_time(); t += 0.0137) {
    const TrajectoryPoint a = trajectory.sample(t);
    const TrajectoryPoint b = trajectory.sample(t + 1e-4);
    EXPECT_NEAR(b.pose.minus(a.pose).head<2>().norm(), 0.5e-4 * (a.velocity + b.velocity), 1e-7);
  }
}

TEST(TimePath, TwoPointsFromRestToRest) {
  const std::vector<PathPoint> path{{Pose2d(0.0, 0.0, 0.0), 0.0}, {Pose2d(1.0, 0.0, 0.0), 0.0}};
  const Trajectory trajectory = time_path(path, {.velocity = 5.0, .acceleration = 1.0}).value();
  EXPECT_NEAR(trajectory.total_time(), 2.0, 1e-15);
  EXPECT_NEAR(trajectory.sample(1.0).velocity, 1.0, 1e-15);
}

TEST(TimePath, SamplesOutsideAreTheEnds) {
  const Trajectory trajectory =
      time_path(reference_path(), {.velocity = 3.5, .acceleration = 3.5}).value();
  const double inf = std::numeric_limits<double>::infinity();
  const test::AllocationCounter counter;
  for (const double t : {-1.0, 0.0, -inf, std::nan("")}) {
    EXPECT_EQ(trajectory.sample(t).pose.x(), 1.330117);
    EXPECT_EQ(trajectory.sample(t).velocity, 0.0);
  }
  for (const double t : {4.2, 1e300, inf}) {
    EXPECT_NEAR(trajectory.sample(t).pose.x(), 10.17, 1e-13);
    EXPECT_EQ(trajectory.sample(t).time, trajectory.total_time());
  }
  for (const TrajectoryPoint& point : trajectory.points()) {
    EXPECT_LE(trajectory.sample(point.time).pose.minus(point.pose).norm(), 1e-14);
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
}

TEST(TimePath, Refusals) {
  const auto path = reference_path();
  const auto error = [&](const PathLimits& limits) {
    return to_string(time_path(path, limits).error());
  };
  EXPECT_EQ(error({.velocity = 0.0, .acceleration = 1.0}),
            "time_path: limits.velocity is 0 m/s; it must be greater than zero");
  EXPECT_EQ(error({.velocity = 1.0, .acceleration = 1.0, .centripetal = -1.0}),
            "time_path: limits.centripetal is -1 m/s²; it must be positive, or infinite");
  EXPECT_EQ(error({.velocity = 1.0, .acceleration = 1.0, .start_velocity = 2.0}),
            "time_path: limits.start_velocity is 2 m/s; it must be at most 1 m/s under the limits");
  // √(2 · 0.001 · the sum of the chords, 10.43 m) = 0.144 m/s
  EXPECT_EQ(error({.velocity = 1.0, .acceleration = 1e-3, .end_velocity = 1.0}).substr(0, 42),
            "time_path: limits.end_velocity is 1 m/s; i");
  EXPECT_FALSE(time_path(path, {.velocity = 1.0, .acceleration = 1e-3, .start_velocity = 1.0}));
  EXPECT_TRUE(time_path(std::vector{path[0]}, {.velocity = 1.0, .acceleration = 1.0})
                  .error()
                  .is(ArgumentError::empty));
  EXPECT_EQ(to_string(time_path(std::vector{path[0], path[1], path[1]},
                                {.velocity = 1.0, .acceleration = 1.0})
                          .error()),
            "time_path: point 3 is where the one before it is; it must be somewhere else");
  auto nan = path;
  nan[5].curvature = NAN;
  EXPECT_TRUE(
      time_path(nan, {.velocity = 1.0, .acceleration = 1.0}).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::trajectory_test
