#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/geometry/se2.hpp>

#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace flyball::mechanisms::wheel_kinematics_test {
namespace {

using namespace flyball::literals;

constexpr double pi = std::numbers::pi;

ChassisSpeeds random_speeds(Random& random) {
  return {random.uniform(-4.0, 4.0), random.uniform(-4.0, 4.0), random.uniform(-9.0, 9.0)};
}

// book_reference.json, diff_drive_kinematics_11.5.
TEST(DifferentialKinematics, OfTheBook) {
  const auto kinematics = differential_kinematics(0.59055_m).value();
  const Eigen::Vector2d first = kinematics.wheels({3.0, 0.0, 0.5});
  EXPECT_NEAR(first(0), 2.8523625, 1e-15);
  EXPECT_NEAR(first(1), 3.1476375, 1e-15);
  const Eigen::Vector2d second = kinematics.wheels({-1.0, 0.0, 2.0});
  EXPECT_NEAR(second(0), -1.59055, 1e-15);
  EXPECT_NEAR(second(1), -0.40945, 1e-15);
  const ChassisSpeeds back = kinematics.chassis(second);
  EXPECT_NEAR(back.vx, -1.0, 1e-15);
  EXPECT_EQ(back.vy, 0.0);
  EXPECT_NEAR(back.omega, 2.0, 1e-14);
}

// About its left wheels: they stand, the right ones go the whole way round.
TEST(DifferentialKinematics, AboutAnotherCentre) {
  const auto kinematics = differential_kinematics(0.6_m).value();
  const Eigen::Vector2d wheels = kinematics.wheels({0.0, 0.0, 2.0}, {0.0, 0.3});
  EXPECT_NEAR(wheels(0), 0.0, 1e-16);
  EXPECT_NEAR(wheels(1), 1.2, 1e-15);
}

TEST(DifferentialKinematics, RefusesNoTrack) {
  EXPECT_EQ(to_string(differential_kinematics(0_m).error()),
            "differential_kinematics: trackwidth is 0 m; it must be greater than zero");
  EXPECT_FALSE(differential_kinematics(Length(-1.0)));
  EXPECT_TRUE(differential_kinematics(Length(NAN)).error().is(ArgumentError::not_finite));
}

// book_reference.json, mecanum_11.6: its speeds are 1/√2 of the wheels'.
TEST(MecanumKinematics, OfTheBook) {
  const std::array<Eigen::Vector2d, 4> places{
      Eigen::Vector2d(0.3, 0.25), {0.3, -0.25}, {-0.3, 0.25}, {-0.3, -0.25}};
  const auto kinematics = mecanum_kinematics(places).value();
  const Eigen::Vector4d wheels = kinematics.wheels({1.2, -0.4, 0.7});
  const Eigen::Vector4d book(0.8591347391416551, 0.8379215357060588, 0.29344931419241715,
                             1.4036069606552966);
  EXPECT_LE((wheels - std::sqrt(2.0) * book).norm(), 1e-15);
  // Straight ahead all wheels roll as fast as the robot goes.
  EXPECT_LE((kinematics.wheels({1.0, 0.0, 0.0}) - Eigen::Vector4d::Ones()).norm(), 1e-15);
  EXPECT_LE((kinematics.wheels({0.0, 1.0, 0.0}) - Eigen::Vector4d(-1.0, 1.0, 1.0, -1.0)).norm(),
            1e-15);
}

// Forward of inverse is the identity; of wheels that contradict each other it is least squares, as
// Eigen's orthogonal decomposition finds it.
TEST(WheelKinematics, ForwardIsTheLeastSquaresInverse) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    std::array<WheelMount, 5> mounts;
    for (WheelMount& mount : mounts) {
      mount = {{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)},
               random.uniform(-pi, pi),
               random.uniform(-1.0, 1.0)};
    }
    const auto kinematics = wheel_kinematics(mounts);
    ASSERT_TRUE(kinematics) << to_string(kinematics.error());
    const auto& M = kinematics->to_wheels();
    const double condition = M.norm() * kinematics->to_chassis().norm();
    const ChassisSpeeds speeds = random_speeds(random);
    const ChassisSpeeds back = kinematics->chassis(kinematics->wheels(speeds));
    EXPECT_LE((back.vector() - speeds.vector()).norm(), 1e-15 * 10 * condition);
    const Eigen::MatrixXd pseudo_inverse = test::pseudo_inverse(M);
    EXPECT_LE((kinematics->to_chassis() - pseudo_inverse).norm(),
              1e-14 * condition * pseudo_inverse.norm());
    const Eigen::Vector<double, 5> variances = Eigen::Vector<double, 5>::Random().cwiseAbs();
    EXPECT_LE((kinematics->twist_covariance(variances) -
               pseudo_inverse * variances.asDiagonal() * pseudo_inverse.transpose())
                  .norm(),
              1e-13 * condition * pseudo_inverse.squaredNorm());
  }
}

// A wheel's contact moves with v + ω × r; what of it is along the rollers' axis is the wheel's.
TEST(WheelKinematics, TheGroundHoldsTheRollersAxis) {
  // Three omni wheels around a circle of 0.2 m, each along the tangent: turning rolls all alike.
  std::array<WheelMount, 3> kiwi;
  for (int i = 0; i < 3; ++i) {
    const double at = 2 * pi / 3 * i;
    kiwi[static_cast<std::size_t>(i)] = {{0.2 * std::cos(at), 0.2 * std::sin(at)}, at + pi / 2};
  }
  const auto kinematics = wheel_kinematics(kiwi).value();
  EXPECT_LE((kinematics.wheels({0.0, 0.0, 3.0}) - Eigen::Vector3d::Constant(0.6)).norm(), 1e-15);
  // The wheel at (0.2, 0) rolls to the left: forward motion is across it.
  EXPECT_NEAR(kinematics.wheels({1.0, 0.0, 0.0})(0), 0.0, 1e-16);
  EXPECT_NEAR(kinematics.wheels({0.0, 1.0, 0.0})(0), 1.0, 1e-16);
}

TEST(WheelKinematics, RefusesWheelsInOnePlace) {
  EXPECT_EQ(to_string(mecanum_kinematics(
                          {Eigen::Vector2d(0.3, 0.25), {0.3, -0.25}, {0.3, 0.25}, {-0.3, -0.25}})
                          .error()),
            "mecanum_kinematics: wheel 3 is at (0.3 m, 0.25 m), where wheel 1 is; it must be in a "
            "place of its own");
}

TEST(WheelKinematics, RefusesWhatSeesNotEveryMotion) {
  // All forward, on one line across: vy turns nothing.
  const auto parallel = wheel_kinematics(
      std::array{WheelMount{{0.0, 0.3}}, WheelMount{{0.0, 0.0}}, WheelMount{{0.0, -0.3}}});
  EXPECT_EQ(to_string(parallel.error()),
            "wheel_kinematics: the layout is one that lets some motion of the robot go without any "
            "wheel's turning; it must be wheels that see every motion: of three directions or "
            "places (least of the singular values over the largest = 0)");
  // All rolling lines through (0, 0), about which it turns across them, and through (0.4, 0.1).
  const auto through = wheel_kinematics(std::array{
      WheelMount{{0.3, 0.0}, 0.0}, WheelMount{{0.0, 0.3}, pi / 2}, WheelMount{{0.0, 0.0}, 1.0}});
  ASSERT_FALSE(through);
  const auto elsewhere = wheel_kinematics(std::array{
      WheelMount{{0.7, 0.1}, 0.0}, WheelMount{{0.4, 0.4}, pi / 2}, WheelMount{{0.4, 0.1}, 1.0}});
  EXPECT_FALSE(elsewhere);
  EXPECT_TRUE(through.error().is(ArgumentError::out_of_range));
  const Eigen::Vector2d point(0.3, 0.2);
  EXPECT_FALSE(mecanum_kinematics({point, point, point, point}));
  EXPECT_EQ(to_string(wheel_kinematics(std::array{WheelMount{{0.3, 0.0}, 0.0, pi / 2}, WheelMount{},
                                                  WheelMount{}})
                          .error()),
            "wheel_kinematics: wheel 1 is with rollers 1.571 rad from its rolling direction; it "
            "must be one whose rollers' axis is not across that direction");
  EXPECT_TRUE(wheel_kinematics(std::array{WheelMount{{NAN, 0.0}}, WheelMount{}, WheelMount{}})
                  .error()
                  .is(ArgumentError::not_finite));
}

// A layout in millimetres or in kilometres is the same layout.
TEST(WheelKinematics, OfAnySize) {
  for (const double size : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    const auto kinematics = mecanum_kinematics(
        {Eigen::Vector2d(0.3, 0.25) * size, Eigen::Vector2d(0.3, -0.25) * size,
         Eigen::Vector2d(-0.3, 0.25) * size, Eigen::Vector2d(-0.3, -0.25) * size});
    ASSERT_TRUE(kinematics) << size;
    const ChassisSpeeds back = kinematics->chassis(kinematics->wheels({1.2, -0.4, 0.7 / size}));
    EXPECT_NEAR(back.vx, 1.2, 1e-14);
    EXPECT_NEAR(back.vy, -0.4, 1e-14);
    EXPECT_NEAR(back.omega * size, 0.7, 1e-14);
  }
}

TEST(ChassisSpeeds, PointsAndFrames) {
  const ChassisSpeeds speeds{1.0, 2.0, 3.0};
  // v + ω k × (x i + y j) = (vx - ω y, vy + ω x)
  const ChassisSpeeds there = speeds.at({0.5, -0.25});
  EXPECT_DOUBLE_EQ(there.vx, 1.75);
  EXPECT_DOUBLE_EQ(there.vy, 3.5);
  EXPECT_EQ(there.omega, 3.0);
  // Facing left, forward of the robot is +y of the field.
  const ChassisSpeeds field = ChassisSpeeds{1.0, 0.0, 0.5}.to_field(Rotation2d(pi / 2));
  EXPECT_NEAR(field.vx, 0.0, 1e-15);
  EXPECT_NEAR(field.vy, 1.0, 1e-15);
  EXPECT_NEAR(field.to_robot(Rotation2d(pi / 2)).vx, 1.0, 1e-15);
}

TEST(WheelKinematics, AllocatesNothing) {
  const auto drive = differential_kinematics(0.6_m).value();
  const test::AllocationCounter counter;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 100; ++k) {
    sum += drive.twist(drive.wheels({1.0, 0.0, 0.1 * k}));
  }
  EXPECT_TRUE(sum.allFinite());
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
}

}  // namespace
}  // namespace flyball::mechanisms::wheel_kinematics_test
