#include <flyball/mechanisms/kinematics/saturation.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/geometry/se2.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::saturation_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double pi = std::numbers::pi;
constexpr double period = 0.02;
const std::array<Vector2d, 4> square{
    Vector2d(0.3, 0.25), {0.3, -0.25}, {-0.3, 0.25}, {-0.3, -0.25}};

template <std::size_t N>
double fastest(const std::array<SwerveModule, N>& modules) {
  double most = 0.0;
  for (const auto& module : modules) {
    most = std::max(most, std::abs(module.speed));
  }
  return most;
}

TEST(ShortestTurn, NeverMoreThanAQuarter) {
  for (double wanted = -3.1; wanted < 3.1; wanted += 0.1) {
    for (double angle = -3.1; angle < 3.1; angle += 0.1) {
      const SwerveModule turned = shortest_turn({2.0, Rotation2d(wanted)}, Rotation2d(angle));
      const double turn = (turned.angle * Rotation2d(angle).inverse()).angle();
      EXPECT_LE(std::abs(turn), 0.5 * pi + 1e-12);
      // The same velocity.
      EXPECT_NEAR(turned.speed * turned.angle.cos(), 2.0 * std::cos(wanted), 1e-15);
      EXPECT_NEAR(turned.speed * turned.angle.sin(), 2.0 * std::sin(wanted), 1e-15);
      // cos of what is to turn, which is never more than a quarter: not backward.
      const SwerveModule scaled = cosine_scaled(turned, Rotation2d(angle));
      EXPECT_NEAR(scaled.speed, turned.speed * std::cos(turn), 1e-14);
      EXPECT_EQ(scaled.angle.angle(), turned.angle.angle());
    }
  }
  EXPECT_EQ(cosine_scaled({2.0, Rotation2d(3.0)}, Rotation2d()).speed, 0.0);
  EXPECT_EQ(shortest_turn({1.0, Rotation2d(0.5 * pi - 1e-9)}, Rotation2d()).speed, 1.0);
  EXPECT_EQ(shortest_turn({1.0, Rotation2d(0.5 * pi + 1e-9)}, Rotation2d()).speed, -1.0);
}

// A velocity of the field is where the period's straight way ends: Exp(twist dt) = (v dt, ω dt).
TEST(HeldTwist, LeadsWhereTheFieldsVelocityLeads) {
  Random random(7332);
  for (int trial = 0; trial < 300; ++trial) {
    const ChassisSpeeds speeds{
        random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0),
        random.uniform(-12.0, 12.0) * std::pow(10.0, -random.uniform(0.0, 9.0))};
    const Vector3d twist = held_twist(speeds, HeldFrame::field, period).vector();
    const Pose2d there = Pose2d::exp(period * twist);
    EXPECT_LE((there.translation() - period * speeds.vector().head<2>()).norm(), 1e-16);
    EXPECT_NEAR(there.angle(), period * speeds.omega, 1e-15);
    EXPECT_LE((period * twist - Pose2d(there).log()).norm(), 1e-15);
    EXPECT_EQ(held_twist(speeds, HeldFrame::robot, period).vector(), speeds.vector());
  }
}

/// Ideal modules hold what they are told for a period: the robot goes along an arc.
Pose2d driven(const Pose2d& pose, const SwerveKinematics<4>& kinematics,
              const std::array<SwerveModule, 4>& modules) {
  return pose * Pose2d::exp(period * kinematics.chassis(modules).vector());
}

struct Away {
  double distance;  ///< m
  double angle;     ///< rad
};
Away apart(const Pose2d& a, const Pose2d& b) {
  const Pose2d between = a.inverse() * b;
  return {between.translation().norm(), std::abs(between.angle())};
}

// Five seconds at full speed with desaturation at work: within 1 mm and 0.1° of the exact arc of
// the twist times the scale that was told. It is far below: 1e-12.
TEST(Saturated, ATwistKeepsItsExactArc) {
  Random random(20);
  const auto kinematics = swerve_kinematics(square).value();
  for (int trial = 0; trial < 50; ++trial) {
    const ChassisSpeeds wanted{random.uniform(3.0, 8.0), random.uniform(-6.0, 6.0),
                               random.uniform(-14.0, 14.0)};
    Pose2d pose;
    double time = 0.0;
    for (int k = 0; k < 250; ++k) {
      const SaturatedMotion motion = saturated(kinematics, wanted, HeldFrame::robot, period, 4.5);
      ASSERT_LE(motion.scale, 1.0);
      const auto modules = kinematics.modules(motion.twist);
      EXPECT_LE(fastest(modules), 4.5 * (1.0 + 1e-15));
      EXPECT_LE((motion.twist.vector() - motion.scale * wanted.vector()).norm(), 1e-13);
      pose = driven(pose, kinematics, modules);
      time += motion.scale * period;
      const Away away = apart(Pose2d::exp(time * wanted.vector()), pose);
      ASSERT_LE(away.distance, 1e-11);
      ASSERT_LE(away.angle, 1e-11);
    }
  }
}

// A velocity of the field while it turns: straight along it, at the ratio of turning to moving that
// was asked for. Discretising first and desaturating the modules then leaves the line.
TEST(Saturated, AFieldVelocityKeepsItsLine) {
  Random random(21);
  const auto kinematics = swerve_kinematics(square).value();
  double drift = 0.0;
  for (int trial = 0; trial < 50; ++trial) {
    const ChassisSpeeds in_field{random.uniform(4.0, 8.0), random.uniform(-6.0, 6.0),
                                 random.uniform(5.0, 14.0)};
    Pose2d pose;
    Pose2d one_after_the_other;
    double time = 0.0;
    for (int k = 0; k < 250; ++k) {
      const SaturatedMotion motion =
          saturated(kinematics, in_field.to_robot(pose.rotation()), HeldFrame::field, period, 4.5);
      const auto modules = kinematics.modules(motion.twist);
      EXPECT_LE(fastest(modules), 4.5 * (1.0 + 1e-15));
      EXPECT_GE(fastest(modules), 4.5 * (1.0 - 2e-9));
      pose = driven(pose, kinematics, modules);
      time += motion.scale * period;
      const Pose2d exact(time * in_field.vx, time * in_field.vy, time * in_field.omega);
      const Away away = apart(exact, pose);
      ASSERT_LE(away.distance, 1e-11);
      ASSERT_LE(away.angle, 1e-11);

      const ChassisSpeeds before = in_field.to_robot(one_after_the_other.rotation());
      const auto slowed =
          desaturated(kinematics.modules(held_twist(before, HeldFrame::field, period)), 4.5);
      one_after_the_other = driven(one_after_the_other, kinematics, slowed.modules);
    }
    // Across the line.
    const Vector2d along = Vector2d(in_field.vx, in_field.vy).normalized();
    const Vector2d t = one_after_the_other.translation();
    drift = std::max(drift, std::abs(along(0) * t(1) - along(1) * t(0)));
  }
  EXPECT_GT(drift, 0.05);
}

TEST(Saturated, OfFixedWheels) {
  const auto mecanum = mecanum_kinematics(square).value();
  const ChassisSpeeds wanted{4.0, -3.0, 6.0};
  const SaturatedMotion motion = saturated(mecanum, wanted, HeldFrame::robot, period, 3.0);
  EXPECT_NEAR(mecanum.wheels(motion.twist).cwiseAbs().maxCoeff(), 3.0, 1e-14);
  EXPECT_LE((motion.twist.vector() - motion.scale * wanted.vector()).norm(), 1e-14);
  const auto [wheels, scale] = desaturated<4>(mecanum.wheels(wanted), 3.0);
  EXPECT_NEAR(scale, motion.scale, 1e-15);
  EXPECT_EQ(wheels.cwiseAbs().maxCoeff(), 3.0);
  EXPECT_EQ((desaturated<4>(wheels, 3.0).second), 1.0);
}

TEST(Desaturated, KeepsTheTwistsDirection) {
  Random random(22);
  const auto kinematics = swerve_kinematics(square).value();
  for (int trial = 0; trial < 300; ++trial) {
    const ChassisSpeeds wanted{random.uniform(-8.0, 8.0), random.uniform(-8.0, 8.0),
                               random.uniform(-20.0, 20.0)};
    auto modules = kinematics.modules(wanted);
    for (auto& module : modules) {  // some backward
      module = shortest_turn(module, Rotation2d(1.0));
    }
    const auto slowed = desaturated(modules, 4.0);
    EXPECT_LE(fastest(slowed.modules), 4.0);
    EXPECT_LE((kinematics.chassis(slowed.modules).vector() - slowed.scale * wanted.vector()).norm(),
              1e-13);
    EXPECT_EQ(slowed.scale < 1.0, fastest(modules) > 4.0);
  }
}

TEST(Saturated, IsWithinTheLimitWhateverComes) {
  const auto kinematics = swerve_kinematics(square).value();
  const double odd[] = {std::numeric_limits<double>::quiet_NaN(),
                        std::numeric_limits<double>::infinity(),
                        1e300,
                        1e99,
                        1e-300,
                        0.0,
                        -3.0,
                        400.0};
  for (const double vx : odd) {
    for (const double omega : odd) {
      for (const HeldFrame frame : {HeldFrame::robot, HeldFrame::field}) {
        for (const double limit : {4.0, 0.0, -1.0, 1e-12}) {
          const auto motion = saturated(kinematics, {vx, 2.0, omega}, frame, period, limit);
          const double speed = fastest(kinematics.modules(motion.twist));
          EXPECT_TRUE(std::isfinite(speed));
          EXPECT_LE(speed, std::max(limit, 0.0) * (1.0 + 1e-14));
          const auto modules = kinematics.modules({vx, 2.0, omega});
          EXPECT_LE(fastest(desaturated(modules, limit).modules), std::max(limit, 0.0));
        }
      }
    }
  }
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (int k = 0; k < 100; ++k) {
    sum += saturated(kinematics, {5.0, 0.1 * k, 3.0}, HeldFrame::field, period, 4.0).scale;
  }
  EXPECT_GT(sum, 0.0);
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
}

}  // namespace
}  // namespace flyball::mechanisms::saturation_test
