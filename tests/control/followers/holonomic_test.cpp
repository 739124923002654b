#include <flyball/control/followers/holonomic.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>

namespace flyball::holonomic_test {
namespace {

constexpr double pi = std::numbers::pi;

// (8.5): each gain is the discrete LQR gain of x₊ = x + T u.
TEST(Holonomic, GainsAreRegulatorsOfIntegrators) {
  const HolonomicSettings settings{.x_tolerance = 0.03, .period = Time(0.03)};
  const auto follower = HolonomicFollower::create(settings).value();
  const auto gain = [](double x, double u) {
    return lqr(Eigen::MatrixXd::Ones(1, 1), Eigen::MatrixXd::Constant(1, 1, 0.03), bryson({x}),
               bryson({u}))
        .value()
        .K(0, 0);
  };
  EXPECT_NEAR(follower.gains()(0), gain(0.03, 0.5), 1e-12);
  EXPECT_NEAR(follower.gains()(1), gain(0.05, 0.5), 1e-12);
  EXPECT_NEAR(follower.gains()(2), gain(0.1, 1.0), 1e-12);
}

// By hand: the robot looks along y, the reference moves along the field's x at 1 m/s and is 0.1 m
// to the field's y: forward is k·0.1, to the right is 1.
TEST(Holonomic, ByHand) {
  auto follower = HolonomicFollower::create().value();
  const auto command = follower.calculate({0.0, 0.0, pi / 2.0}, {{0.0, 0.1, 0.0}, {1.0, 0.0, 0.2}});
  EXPECT_NEAR(command.speeds.vx, follower.gains()(1) * 0.1, 1e-14);
  EXPECT_NEAR(command.speeds.vy, -1.0, 1e-14);
  EXPECT_NEAR(command.speeds.omega, 0.2 - follower.gains()(2) * pi / 2.0, 1e-13);
}

// From 170° to -170° the way leads over 180°.
TEST(Holonomic, TurnsTheShorterWay) {
  auto follower = HolonomicFollower::create().value();
  const double degree = pi / 180.0;
  const auto command =
      follower.calculate({0.0, 0.0, 170.0 * degree}, {{0.0, 0.0, -170.0 * degree}, {}});
  EXPECT_NEAR(command.speeds.omega, follower.gains()(2) * 20.0 * degree, 1e-12);
}

// With a profile the robot turns from its own heading by the limits; an ideal robot (no error) is
// told exactly the profile, and a turn of 2 rad at 2 rad/s and 4 rad/s² takes 1.5 s.
TEST(Holonomic, HeadingProfile) {
  auto follower = HolonomicFollower::create({.heading_profile = MotionLimits{2.0, 4.0}}).value();
  Pose2d pose(0.0, 0.0, 2.8);
  const TrackingPoint r{{1.0, 0.0, 2.8 + 2.0}, {}};
  double largest = 0.0;
  double before = 0.0;
  int steps = 0;
  while (!(std::abs(pose.rotation().minus(r.pose.rotation())(0)) < 1e-3) && steps < 500) {
    const auto command = follower.calculate(pose, r);
    largest = std::max(largest, std::abs(command.speeds.omega));
    EXPECT_LE(std::abs(command.speeds.omega - before), 0.5);
    before = command.speeds.omega;
    pose = pose * Pose2d::exp({command.speeds.vx * 0.02, command.speeds.vy * 0.02,
                               command.speeds.omega * 0.02});
    ++steps;
  }
  EXPECT_LE(largest, 2.4);
  EXPECT_GE(largest, 1.9);
  EXPECT_GT(steps, 70);
  EXPECT_LT(steps, 110);
  // Turned by hand, it begins from there.
  ASSERT_TRUE(follower.heading().has_value());
  const auto turned = follower.calculate({0.0, 0.0, r.pose.angle() + 3.0}, r);
  EXPECT_LE(std::abs(turned.speeds.omega), 0.6);
  follower.reset();
  EXPECT_FALSE(follower.heading().has_value());
}

TEST(Holonomic, Errors) {
  EXPECT_EQ(
      to_string(HolonomicFollower::create({.heading_profile = MotionLimits{0.0, 1.0}}).error()),
      "HolonomicFollower: heading_profile.velocity is 0 rad/s; it must be greater than zero");
  EXPECT_FALSE(HolonomicFollower::create({.x_tolerance = -1.0}).has_value());
  EXPECT_FALSE(HolonomicFollower::create({.velocity_tolerance = 0.0}).has_value());
  EXPECT_FALSE(HolonomicFollower::create({.period = Time(-0.02)}).has_value());
  EXPECT_FALSE(HolonomicFollower::create({.limits = {.angular_velocity = 0.0}}).has_value());
}

}  // namespace
}  // namespace flyball::holonomic_test
