#include <flyball/control/followers/pure_pursuit.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::pure_pursuit_test {
namespace {

constexpr double pi = std::numbers::pi;

std::vector<PathPoint> straight(double length, int points = 41) {
  std::vector<PathPoint> path;
  for (int i = 0; i < points; ++i) {
    path.push_back({{length * i / (points - 1), 0.0, 0.0}, 0.0});
  }
  return path;
}

/// An eight of two circles: it crosses itself in the middle.
std::vector<PathPoint> eight(double radius) {
  std::vector<PathPoint> path;
  constexpr int steps = 120;
  for (int i = 0; i <= 2 * steps; ++i) {
    const bool first = i <= steps;
    const double turn = 2.0 * pi * (first ? i : i - steps) / steps;
    const double side = first ? 1.0 : -1.0;
    path.push_back({{radius * std::sin(turn), side * radius * (1.0 - std::cos(turn)), side * turn},
                    side / radius});
  }
  return path;
}

struct Way {
  Pose2d end;
  double largest_off = 0.0;  ///< m, from the path.
  double time = 0.0;
  bool arrived = false;
};

Way drive(PurePursuitFollower& follower, Pose2d pose, double until) {
  Way way;
  for (double t = 0.0; t < until && !follower.arrived(); t += 0.02) {
    const auto command = follower.calculate(pose);
    const Eigen::Vector3d twist = 0.02 * command.speeds.vector();
    pose = pose * Pose2d::exp(twist);
    way.largest_off = std::max(way.largest_off, std::abs(follower.cross_track()));
    way.time = t;
  }
  way.end = pose;
  way.arrived = follower.arrived();
  return way;
}

// A target at bearing 45° and distance √2/2: κ = 2 sin α/d = 2, the circle through both.
TEST(PurePursuit, ArcThroughTheTarget) {
  const std::vector<PathPoint> path{{{0.5, 0.5, 0.0}}, {{0.6, 0.5, 0.0}}, {{4.0, 0.5, 0.0}}};
  auto follower = PurePursuitFollower::create(
                      path, {.velocity = 1.0, .least_lookahead = 1e-9, .lookahead_time = 0.0})
                      .value();
  const auto command = follower.calculate({});
  EXPECT_NEAR(follower.curvature(), 2.0, 1e-6);
  EXPECT_NEAR(command.speeds.omega, 2.0 * command.speeds.vx, 1e-6);
  EXPECT_EQ(follower.target(), Eigen::Vector2d(0.5 + 1e-9, 0.5));
}

// The lookahead is time times speed between its bounds; it starts at the least.
TEST(PurePursuit, LookaheadAdapts) {
  auto follower =
      PurePursuitFollower::create(straight(20.0), {.velocity = 2.0, .acceleration = 1.0}).value();
  Pose2d pose;
  EXPECT_GT(follower.calculate(pose).speeds.vx, 0.0);
  EXPECT_EQ(follower.lookahead(), 0.3);
  for (int k = 0; k < 150; ++k) {
    pose = pose * Pose2d::exp({0.02 * follower.calculate(pose).speeds.vx, 0.0, 0.0});
  }
  EXPECT_NEAR(follower.lookahead(), 1.0, 1e-9);
}

TEST(PurePursuit, ComesToThePathAndStopsAtItsEnd) {
  for (const double off : {-0.4, 0.3}) {
    auto follower =
        PurePursuitFollower::create(straight(6.0), {.velocity = 2.0, .acceleration = 3.0}).value();
    const Way way = drive(follower, {0.0, off, 0.5}, 10.0);
    EXPECT_TRUE(way.arrived);
    EXPECT_NEAR(way.end.x(), 6.0, 0.03);
    EXPECT_NEAR(way.end.y(), 0.0, 0.01);
    EXPECT_NEAR(way.end.angle(), 0.0, 0.02);
    // 6 m at 2 m/s and 3 m/s² take 3.67 s.
    EXPECT_LT(way.time, 4.5);
    EXPECT_EQ(follower.calculate(way.end).speeds.vx, 0.0);
  }
}

// Progress is along the path: at the crossing it does not jump to the other circle. The way inside
// a curve of radius R at lookahead L is within L²/(8 R) of it.
TEST(PurePursuit, PathsMayCrossThemselves) {
  auto follower = PurePursuitFollower::create(
                      eight(1.0), {.velocity = 1.0, .acceleration = 2.0, .largest_lookahead = 0.6})
                      .value();
  const Way way = drive(follower, {}, 30.0);
  EXPECT_TRUE(way.arrived);
  EXPECT_NEAR(follower.progress(), follower.length(), 0.03);
  EXPECT_LT(way.largest_off, 0.06);
  EXPECT_GT(way.time, 4.0 * pi - 1.0);
}

TEST(PurePursuit, BacksAlongAPath) {
  std::vector<PathPoint> path;
  for (int i = 0; i <= 40; ++i) {
    path.push_back({{-0.1 * i, 0.0, pi}, 0.0});  // along the path, which leads to -x
  }
  auto follower =
      PurePursuitFollower::create(path, {.reversed = true, .velocity = 1.0, .acceleration = 2.0})
          .value();
  const Way way = drive(follower, {0.0, 0.2, 0.0}, 10.0);
  EXPECT_TRUE(way.arrived);
  EXPECT_NEAR(way.end.x(), -4.0, 0.03);
  EXPECT_NEAR(way.end.y(), 0.0, 0.02);
  EXPECT_NEAR(std::remainder(way.end.angle(), 2.0 * pi), 0.0, 0.03);
}

// A robot that moves in any direction keeps looking the way the path's poses say.
TEST(PurePursuit, AnyDirection) {
  std::vector<PathPoint> path;
  for (int i = 0; i <= 40; ++i) {
    path.push_back({{0.1 * i, 0.0, pi / 2.0 * i / 40.0}, 0.0});
  }
  auto follower =
      PurePursuitFollower::create(
          path, {.drive = PursuitDrive::in_any_direction, .velocity = 1.5, .acceleration = 3.0})
          .value();
  const Way way = drive(follower, {0.0, 0.2, 0.0}, 10.0);
  EXPECT_TRUE(way.arrived);
  EXPECT_NEAR(way.end.x(), 4.0, 0.03);
  EXPECT_NEAR(way.end.y(), 0.0, 0.02);
  EXPECT_NEAR(way.end.angle(), pi / 2.0, 0.12);
}

// One that is set down anywhere, looking anywhere, comes to the end of the path.
TEST(PurePursuit, FromAnywhere) {
  Random random(21);
  for (int k = 0; k < 200; ++k) {
    auto follower =
        PurePursuitFollower::create(straight(12.0), {.velocity = 2.0,
                                                     .acceleration = 3.0,
                                                     .centripetal = 4.0,
                                                     .limits = {.angular_velocity = 5.0}})
            .value();
    const Pose2d start(random.uniform(-2.0, 4.0), random.uniform(-3.0, 3.0),
                       random.uniform(-pi, pi));
    const Way way = drive(follower, start, 30.0);
    ASSERT_TRUE(way.arrived) << k << ": " << start.x() << ", " << start.y() << ", "
                             << start.angle();
    ASSERT_NEAR(way.end.y(), 0.0, 0.05) << k;
  }
}

TEST(PurePursuit, FiniteWhateverComes) {
  const double bad[] = {std::nan(""), std::numeric_limits<double>::infinity(), 1e308, -1e100, 1e99};
  Random random(4);
  auto follower =
      PurePursuitFollower::create(
          eight(1.0), {.velocity = 3.0, .limits = {.velocity = 2.0, .angular_velocity = 3.0}})
          .value();
  for (int k = 0; k < 2000; ++k) {
    double at[] = {random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), random.uniform(-9.0, 9.0)};
    if (k % 3 == 0) {
      at[k % 9 / 3] = bad[k % 5];
    }
    if (k % 400 == 399) {
      follower.reset();
    }
    const auto command = follower.calculate({at[0], at[1], at[2]});
    ASSERT_TRUE(std::isfinite(command.speeds.vx) && std::isfinite(command.speeds.omega));
    ASSERT_LE(std::abs(command.speeds.vx), 2.0);
    ASSERT_LE(std::abs(command.speeds.omega), 3.0);
    ASSERT_TRUE(std::isfinite(follower.progress()));
  }
}

TEST(PurePursuit, Errors) {
  const auto refused = [](const std::vector<PathPoint>& path, const PurePursuitSettings& settings) {
    const auto follower = PurePursuitFollower::create(path, settings);
    return follower ? std::string() : to_string(follower.error());
  };
  const auto path = straight(1.0);
  EXPECT_EQ(refused(path, {}),
            "PurePursuitFollower: velocity is 0 m/s; it must be greater than zero");
  EXPECT_EQ(refused({path.front()}, {.velocity = 1.0}),
            "PurePursuitFollower: path is 1 points; it must be two points or more");
  EXPECT_NE(refused({path[0], path[0]}, {.velocity = 1.0}).find("point 2"), std::string::npos);
  EXPECT_NE(refused({path[0], {{std::nan(""), 0.0, 0.0}}}, {.velocity = 1.0}).find("point 2"),
            std::string::npos);
  EXPECT_NE(refused(path, {.velocity = 1.0, .least_lookahead = 2.0}), "");
  EXPECT_NE(refused(path, {.velocity = 1.0, .acceleration = -1.0}), "");
  EXPECT_NE(refused(path, {.velocity = 1.0, .centripetal = std::nan("")}), "");
  EXPECT_NE(refused(path, {.velocity = 1.0, .tolerance = 0.0}), "");
  EXPECT_NE(
      refused(path, {.drive = PursuitDrive::in_any_direction, .reversed = true, .velocity = 1}),
      "");
}

}  // namespace
}  // namespace flyball::pure_pursuit_test
