#include <flyball/control/followers/ltv_drive.hpp>

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/discretize.hpp>

#include "book_drive.hpp"

namespace flyball::ltv_drive_test {
namespace {

using test::book_drive;
using test::book_trackwidth;
using Gain = LtvDriveFollower::Gain;

/// (8.11) with the sides' own accelerations, over a generic scalar.
template <class X>
auto drive_model(const mechanisms::DifferentialDrive& drive, const X& x, const Eigen::Vector2d& u) {
  using Scalar = typename X::Scalar;
  const Scalar v = 0.5 * (x(3) + x(4));
  return Eigen::Vector<Scalar, 5>{
      v * cos(x(2)), v * sin(x(2)), (x(4) - x(3)) / book_trackwidth.si(),
      drive.A(0, 0) * x(3) + drive.A(0, 1) * x(4) + drive.B(0, 0) * u(0) + drive.B(0, 1) * u(1),
      drive.A(1, 0) * x(3) + drive.A(1, 1) * x(4) + drive.B(1, 0) * u(0) + drive.B(1, 1) * u(1)};
}

// (8.14) is the Jacobian of (8.11) at θ = 0, whatever turns.
TEST(LtvDrive, ErrorDynamicsAreTheJacobian) {
  const auto drive = book_drive();
  Random random(3);
  for (int k = 0; k < 50; ++k) {
    const double v = random.uniform(-4.0, 4.0);
    const double turn = random.uniform(-1.0, 1.0);
    const Eigen::Vector<double, 5> x{1.0, 2.0, 0.0, v - turn, v + turn};
    const auto A = jacobian(
        [&](const auto& at) { return drive_model(drive, at, Eigen::Vector2d(3.0, -4.0)); }, x);
    const auto system = drive_error_dynamics(drive, book_trackwidth, v).value();
    EXPECT_LE((system.A - A).norm(), 1e-14 * A.norm());
    EXPECT_EQ(Eigen::Matrix2d(system.B.bottomRows<2>()), drive.B);
    EXPECT_EQ(system.B.topRows<3>().norm(), 0.0);
  }
}

// SciPy 1.10 (expm, solve_discrete_are) with the book's drive, tolerances (0.0625, 0.125, 2.5,
// 0.95, 0.95) and 12 V, 20 ms, at 0.5 and 2 m/s.
TEST(LtvDrive, GainsOfSciPy) {
  const auto follower = LtvDriveFollower::create(book_drive(), book_trackwidth).value();
  Gain expected;
  expected << 91.40344405641802, -51.59288946687046, -13.62599183419613, 8.996310428768393,
      0.03946227524756071, 91.40344405641812, 51.59288946687099, 13.62599183419644,
      0.03946227524755339, 8.996310428768417;
  EXPECT_LE((follower.K(0.5) - expected).norm(), 1e-11 * expected.norm());
  expected << 91.40344405641848, -49.51364314788066, -27.81448485587846, 9.683050196887875,
      -0.647277492871896, 91.40344405641854, 49.51364314787994, 27.81448485587807,
      -0.647277492871884, 9.683050196887836;
  EXPECT_LE((follower.K(2.0) - expected).norm(), 1e-11 * expected.norm());
}

// What the loop solves, and what it interpolates, against `lqr` of the discretised theorem.
TEST(LtvDrive, GainIsTheRegulator) {
  LtvDriveSettings settings;
  Random random(9);
  for (int robot = 0; robot < 8; ++robot) {
    auto drive = book_drive(1 + robot % 4);
    // Sides that are not alike.
    drive.A(0, 0) *= 1.0 + 0.02 * robot;
    drive.B(1, 1) *= 1.0 - 0.03 * robot;
    settings.y_tolerance = random.uniform(0.03, 0.3);
    settings.heading_tolerance = random.uniform(0.2, 3.0);
    settings.period = Time(random.uniform(0.004, 0.03));
    settings.source = GainSource::each_period;
    const auto solving = LtvDriveFollower::create(drive, book_trackwidth, settings).value();
    settings.source = GainSource::schedule;
    const auto scheduled = LtvDriveFollower::create(drive, book_trackwidth, settings).value();
    EXPECT_LT(scheduled.schedule_error(), 5e-3);
    EXPECT_GT(scheduled.schedule_error(), 0.0);
    const Eigen::MatrixXd Q =
        bryson({0.0625, settings.y_tolerance, settings.heading_tolerance, 0.95, 0.95}).value();
    const Eigen::MatrixXd R = bryson({12.0, 12.0}).value();
    for (int k = 0; k < 40; ++k) {
      const double v = (k % 2 == 0 ? 1.0 : -1.0) * random.uniform(0.1, 4.0);
      const auto system = drive_error_dynamics(drive, book_trackwidth, v).value();
      const auto plant = discretize_zoh(system.A, system.B, settings.period).value();
      const Eigen::MatrixXd K = lqr(plant.A, plant.B, Q, R).value().K;
      ASSERT_LE((solving.K(v) - K).norm(), 1e-8 * K.norm()) << v;
      ASSERT_LE((scheduled.K(v) - K).norm(), 1.1 * scheduled.schedule_error() * K.norm()) << v;
    }
  }
}

// Beyond the largest velocity the gain stays, near rest the cross-track column fades.
TEST(LtvDrive, EndsOfTheRange) {
  LtvDriveSettings settings;
  settings.largest_velocity = 3.0;
  const auto follower = LtvDriveFollower::create(book_drive(), book_trackwidth, settings).value();
  EXPECT_EQ(follower.K(3.0), follower.K(1e300));
  EXPECT_EQ(follower.schedule_velocities().front(), 0.1);
  EXPECT_EQ(follower.schedule_velocities().back(), 3.0);
  EXPECT_LE((follower.schedule().back() - follower.K(3.0)).norm(), 1e-9 * follower.K(3.0).norm());
  const Gain slow = follower.K(0.1);
  Gain half = slow;
  half.col(1) *= 0.5;
  EXPECT_LE((follower.K(0.05) - half).norm(), 1e-14 * slow.norm());
  EXPECT_EQ(follower.K(0.0).col(1).norm(), 0.0);
  Gain back = slow;
  back.col(1) *= -1.0;
  EXPECT_EQ(follower.K(-0.1), back);
}

// A drive that turns a million times faster than it drives asks each gain for sixty digits.
// Newton's corrections that shrink no more end an attempt in fewer: with sixty each of seven took
// 440 steps.
TEST(LtvDrive, GainsThatNeedMoreDigitsAreFoundInAFewSteps) {
  const auto drive =
      mechanisms::differential_drive(
          mechanisms::DriveGains{
              .kV_linear = 1e-300, .kA_linear = 100.0, .kV_angular = 5e-324, .kA_angular = 0.02})
          .value();
  const auto model = drive_error_dynamics(drive, Length(1e-6), 0.5).value();
  const auto sampled = discretize_zoh(model.A, model.B, Time(0.7822265625)).value();
  const auto Q = bryson({0.0625, 1.0, 1e-6, 1.0, 1.0}).value();
  const auto R = bryson({0.001, 0.001}).value();
  const auto found = dare(sampled.A, sampled.B, Q, R);
  ASSERT_TRUE(found.has_value()) << to_string(found.error());
  EXPECT_LT(found->residual, 1e-13);
  EXPECT_LT(found->iterations, 250);
}

// The feedforward alone takes the drive from one reference's velocities to the next's, exactly.
TEST(LtvDrive, FeedforwardIsThePlantsInverse) {
  const auto drive = book_drive();
  const auto follower = LtvDriveFollower::create(drive, book_trackwidth).value();
  const auto plant = discretize_zoh(drive.A, drive.B, Time(0.02)).value();
  const DriveState r{{1.0, 2.0, 0.3}, 1.0, 1.2};
  const DriveState next{{1.02, 2.01, 0.31}, 1.05, 1.1};
  const auto command = follower.calculate(r, r, next);
  EXPECT_EQ(command.status, FollowerStatus::tracking);
  const Eigen::Vector2d after =
      plant.A * Eigen::Vector2d(r.left, r.right) + plant.B * command.voltage;
  EXPECT_NEAR(after(0), next.left, 1e-13);
  EXPECT_NEAR(after(1), next.right, 1e-13);
}

// Friction is added in the direction of motion: identified gains have kS.
TEST(DriveVelocityTracker, FollowsTheSides) {
  const auto drive = mechanisms::differential_drive(mechanisms::DriveGains{.kS_left = 0.2,
                                                                           .kS_right = 0.3,
                                                                           .kV_linear = 2.5,
                                                                           .kA_linear = 0.4,
                                                                           .kV_angular = 2.2,
                                                                           .kA_angular = 0.15})
                         .value();
  const auto tracker = DriveVelocityTracker::create(drive).value();
  const auto without = [&](const Eigen::Vector2d& r, const Eigen::Vector2d& next) {
    auto frictionless = drive;
    frictionless.kS_left = frictionless.kS_right = 0.0;
    return DriveVelocityTracker::create(frictionless).value().calculate(r, r, next).voltage;
  };
  const Eigen::Vector2d r(1.0, -1.0);
  EXPECT_LE(
      (tracker.calculate(r, r, r).voltage - without(r, r) - Eigen::Vector2d(0.2, -0.3)).norm(),
      1e-14);
  // 50 V apart are scaled by one factor.
  const auto far = tracker.calculate({0.0, 0.0}, {20.0, 10.0}, {20.0, 10.0});
  EXPECT_EQ(far.status, FollowerStatus::saturated);
  EXPECT_EQ(far.voltage(0), 12.0);
  EXPECT_GT(far.voltage(1), 4.0);
  EXPECT_LT(far.voltage(1), 8.0);
  const double nan = std::nan("");
  EXPECT_EQ(tracker.calculate({nan, 0.0}, r, r).status, FollowerStatus::no_pose);
  EXPECT_EQ(tracker.calculate(r, {nan, 0.0}, r).voltage.norm(), 0.0);
  const auto K = tracker.K();
  const auto book = DriveVelocityTracker::create(book_drive()).value();
  EXPECT_GT(K(0, 0), 0.0);
  // The velocity controller of the book's script for 8.10 to 8.13.
  EXPECT_NEAR(book.K()(0, 0), 7.117323442946075, 1e-11);
  EXPECT_NEAR(book.K()(0, 1), -0.3517865635688203, 1e-11);
}

TEST(LtvDrive, Errors) {
  const auto refused = [](auto change, Length trackwidth = book_trackwidth) {
    LtvDriveSettings s;
    change(s);
    const auto follower = LtvDriveFollower::create(book_drive(), trackwidth, s);
    return follower ? std::string() : to_string(follower.error());
  };
  EXPECT_EQ(refused([](auto& s) { s.voltage_limit = -12.0; }),
            "LtvDriveFollower: voltage_limit is -12 V; it must be greater than zero");
  EXPECT_NE(refused([](auto& s) { s.y_tolerance = 0.0; }), "");
  EXPECT_NE(refused([](auto& s) { s.period = Time(std::nan("")); }), "");
  EXPECT_NE(refused([](auto& s) { s.low_speed.velocity = -0.1; }), "");
  EXPECT_NE(refused([](auto&) {}, Length(0.0)), "");
  EXPECT_EQ(refused([](auto& s) { s.largest_velocity = 0.05; }),
            "LtvDriveFollower: largest_velocity is 0.05 m/s; it must be above low_speed.velocity, "
            "0.1 m/s");
  auto drive = book_drive();
  drive.B.setOnes();
  EXPECT_FALSE(LtvDriveFollower::create(drive, book_trackwidth).has_value());
  drive.B(0, 0) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(LtvDriveFollower::create(drive, book_trackwidth).has_value());
}

}  // namespace
}  // namespace flyball::ltv_drive_test
