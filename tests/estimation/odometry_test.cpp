#include <flyball/estimation/odometry.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

#include "support/allocation_count.hpp"

namespace flyball::odometry_test {
namespace {

using namespace flyball::literals;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double pi = std::numbers::pi;

// A circle of radius 1 to the left, in as many steps as one likes: the exponential closes it.
TEST(Odometry, TheExponentialIsExactOnCircles) {
  for (const int steps : {3, 4, 7, 100}) {
    Odometry odometry;
    const double turn = 2 * pi / steps;
    for (int k = 0; k < steps; ++k) {
      EXPECT_TRUE(odometry.step({turn, 0.0, turn}));
    }
    EXPECT_LE(odometry.pose().translation().norm(), 1e-14) << steps;
    EXPECT_NEAR(odometry.pose().angle(), 0.0, 1e-14);
  }
}

// 10.1 with v T = 2, ω T = 0.3 from (1, 2), 0.5: (1 + 2 cos 0.5, 2 + 2 sin 0.5), 0.8.
TEST(Odometry, ForwardEuler) {
  Odometry odometry(OdometryRule::forward_euler, Pose2d(1.0, 2.0, 0.5));
  EXPECT_TRUE(odometry.step({2.0, 0.0, 0.3}));
  EXPECT_NEAR(odometry.pose().x(), 1.0 + 2.0 * std::cos(0.5), 1e-15);
  EXPECT_NEAR(odometry.pose().y(), 2.0 + 2.0 * std::sin(0.5), 1e-15);
  EXPECT_NEAR(odometry.pose().angle(), 0.8, 1e-15);
}

// Both rules meet as the period shrinks, Euler's error in proportion to it.
TEST(Odometry, EulerConvergesToTheExponential) {
  const Pose2d end = Pose2d::exp({1.0, 0.2, 1.5});
  double last = std::numeric_limits<double>::infinity();
  for (const int steps : {10, 20, 40, 80, 160}) {
    Odometry euler(OdometryRule::forward_euler);
    for (int k = 0; k < steps; ++k) {
      euler.step(Vector3d(1.0, 0.2, 1.5) / steps);
    }
    const double error = (euler.pose().translation() - end.translation()).norm();
    EXPECT_LE(error, 0.51 * last);
    EXPECT_GE(error, 0.05 / steps);
    last = error;
  }
}

// The same motion by three drives: wheel distances in, the same pose out.
TEST(Odometry, OfDifferentialMecanumAndSwerveWheels) {
  const auto differential = mechanisms::differential_kinematics(0.6_m).value();
  const std::array<Eigen::Vector2d, 4> places{
      Eigen::Vector2d(0.3, 0.25), {0.3, -0.25}, {-0.3, 0.25}, {-0.3, -0.25}};
  const auto mecanum = mechanisms::mecanum_kinematics(places).value();
  const auto swerve = mechanisms::swerve_kinematics(places).value();
  Random random(1);
  Odometry a;
  Odometry b;
  Odometry c;
  Pose2d truth;
  for (int k = 0; k < 1000; ++k) {
    const mechanisms::ChassisSpeeds delta{random.uniform(-0.1, 0.1), 0.0,
                                          random.uniform(-0.2, 0.2)};
    truth = truth.plus(delta.vector());
    a.step(differential.twist(differential.wheels(delta)));
    b.step(mecanum.twist(mecanum.wheels(delta)));
    c.step(swerve.twist(swerve.modules(delta)));
  }
  for (const Odometry* odometry : {&a, &b, &c}) {
    EXPECT_LE(odometry->pose().minus(truth).norm(), 1e-12);
  }
}

// The gyro gives the turn, wherever its zero is; what it missed while silent it makes good.
TEST(Odometry, TheGyroGivesTheHeading) {
  Odometry odometry(OdometryRule::pose_exponential, Pose2d(0.0, 0.0, 1.0));
  const Rotation2d zero(-2.5);  // the gyro reads heading - 1 - 2.5 … the first time
  double heading = 1.0;
  Pose2d truth(0.0, 0.0, 1.0);
  for (int k = 0; k < 400; ++k) {
    const double turn = 0.05;
    heading += turn;
    truth = truth.plus(Vector3d(0.1, 0.0, turn));
    // Wheels that slip claim another turn after the first period.
    const double claimed = k == 0 ? turn : 0.3;
    const Rotation2d gyro = zero * Rotation2d(heading);
    ASSERT_TRUE(odometry.step({0.1, 0.0, claimed}, gyro));
  }
  EXPECT_LE(odometry.pose().minus(truth).norm(), 1e-12);
  // Ten periods by wheels alone, which turn too far; then the gyro is back.
  for (int k = 0; k < 10; ++k) {
    odometry.step({0.0, 0.0, 0.02});
    heading += 0.01;
  }
  odometry.step(Vector3d::Zero(), zero * Rotation2d(heading));
  EXPECT_NEAR(odometry.pose().rotation().minus(Rotation2d(heading))(0), 0.0, 1e-13);
  // The wheels' turn does not count where the gyro's does, not even if it is none.
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(odometry.step({0.0, 0.0, nan}, zero * Rotation2d(heading + 0.1)));
  EXPECT_NEAR(odometry.pose().rotation().minus(Rotation2d(heading + 0.1))(0), 0.0, 1e-13);
  // After a reset the zero is found anew.
  odometry.reset(Pose2d(5.0, 5.0, 0.0));
  odometry.step(Vector3d::Zero(), Rotation2d(0.7));
  EXPECT_EQ(odometry.pose().angle(), 0.0);
  odometry.step(Vector3d::Zero(), Rotation2d(0.9));
  EXPECT_NEAR(odometry.pose().angle(), 0.2, 1e-15);
}

// What is no number leaves everything as it is, and says so.
TEST(Odometry, LeavesOutWhatIsNoNumber) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const OdometryRule rule : {OdometryRule::pose_exponential, OdometryRule::forward_euler}) {
    Odometry odometry(rule, Pose2d(1.0, 2.0, 3.0), Matrix3d::Identity());
    ASSERT_TRUE(odometry.step({0.1, 0.2, 0.3}, Rotation2d(0.5), Matrix3d::Identity()));
    const Pose2d pose = odometry.pose();
    const Matrix3d P = odometry.covariance();
    for (const double bad : {std::nan(""), inf, -inf, 1e101, 1e300}) {
      for (int i = 0; i < 3; ++i) {
        EXPECT_FALSE(odometry.step(bad * Vector3d::Unit(i)));
      }
      EXPECT_FALSE(odometry.step(Vector3d::Zero(), bad * Matrix3d::Identity()));
      EXPECT_FALSE(odometry.step(bad * Vector3d::UnitX(), Rotation2d(0.6)));
    }
    EXPECT_FALSE(odometry.step(Vector3d::Zero(), Rotation2d(std::nan(""))));
    EXPECT_EQ(odometry.pose().matrix(), pose.matrix());
    EXPECT_EQ(odometry.covariance(), P);
    // Steps to the end of all numbers: refused before anything overflows.
    for (int k = 0; k < 100; ++k) {
      odometry.step({9e99, 9e99, 1e99}, 1e99 * Matrix3d::Identity());
      ASSERT_TRUE(odometry.pose().matrix().allFinite());
      ASSERT_TRUE(odometry.covariance().allFinite());
    }
  }
}

TEST(Odometry, ANewPlaceIsANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Odometry odometry(OdometryRule::pose_exponential, Pose2d(1.0, 2.0, 0.5));
  EXPECT_FALSE(odometry.reset(Pose2d(nan, 0.0, 0.0)));
  EXPECT_FALSE(odometry.reset(Pose2d(), Matrix3d::Constant(nan)));
  EXPECT_FALSE(odometry.reset(Pose2d(1e300, 0.0, 0.0)));
  EXPECT_EQ(odometry.pose().x(), 1.0);
  EXPECT_TRUE(odometry.reset(Pose2d(3.0, 0.0, 0.0)));
  EXPECT_EQ(odometry.pose().x(), 3.0);
  Odometry lost(OdometryRule::forward_euler, Pose2d(0.0, nan, 0.0));
  EXPECT_EQ(lost.pose().y(), 0.0);
  EXPECT_TRUE(lost.step({1.0, 0.0, 0.0}));
  EXPECT_EQ(lost.pose().x(), 1.0);
}

// The covariance against the spread of 20 000 runs whose twists carry the noise.
TEST(Odometry, CovarianceIsThatOfManyRuns) {
  const Vector3d sigma(0.01, 0.004, 0.008);
  const Matrix3d Q = sigma.cwiseAbs2().asDiagonal();
  for (const OdometryRule rule : {OdometryRule::pose_exponential, OdometryRule::forward_euler}) {
    const auto twist = [](int k) { return Vector3d(0.3, 0.05, k < 10 ? 0.25 : -0.15); };
    Odometry mean(rule, Pose2d(1.0, 2.0, 3.0));
    for (int k = 0; k < 20; ++k) {
      mean.step(twist(k), Q);
    }
    Random random(1);
    constexpr int runs = 20'000;
    Matrix3d spread = Matrix3d::Zero();
    for (int run = 0; run < runs; ++run) {
      Odometry one(rule, Pose2d(1.0, 2.0, 3.0));
      for (int k = 0; k < 20; ++k) {
        one.step(twist(k) + Vector3d(sigma(0) * random.normal(), sigma(1) * random.normal(),
                                     sigma(2) * random.normal()));
      }
      const Vector3d error = one.pose().minus(mean.pose());
      spread += error * error.transpose() / runs;
    }
    // Each entry has a standard deviation of √(2/runs) = 1 %; first order adds as much.
    const Matrix3d& P = mean.covariance();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        EXPECT_NEAR(spread(i, j), P(i, j), 0.04 * std::sqrt(P(i, i) * P(j, j))) << i << ' ' << j;
      }
    }
    EXPECT_EQ(P, P.transpose());
  }
}

TEST(Odometry, AllocatesNothing) {
  Odometry odometry;
  const Matrix3d Q = 1e-4 * Matrix3d::Identity();
  const test::AllocationCounter counter;
  for (int k = 0; k < 1000; ++k) {
    odometry.step({0.1, 0.0, 0.01}, Rotation2d(0.01 * k), Q);
  }
  EXPECT_TRUE(odometry.covariance().allFinite());
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
}

}  // namespace
}  // namespace flyball::odometry_test
