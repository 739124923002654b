#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/swerve_drive.hpp>
#include <flyball/mechanisms/turret.hpp>
#include <flyball/mechanisms/velocity_servo.hpp>

#include "mechanisms/expect_model.hpp"

namespace flyball::mechanisms::identified_gains_test {
namespace {

using namespace flyball::literals;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

// Section 14.3: A = -K_v/K_a = -0.12/0.05 = -2.4, B = 1/K_a = 20.
TEST(IdentifiedGains, Flywheel) {
  const Flywheel model = flywheel(FeedforwardGains{.kS = 0.5, .kV = 0.12, .kA = 0.05}).value();
  test::expect_first_order(model, -2.4, 20.0);
  EXPECT_EQ(model.kind, MechanismKind::flywheel);
  EXPECT_EQ(model.nominal_voltage, 12.0);
  EXPECT_EQ(model.gains.kS, 0.5);
}

// Theorem 14.3.1 with K_v = 4, K_a = 0.25: A = [0 1; 0 -16], B = [0; 4].
TEST(IdentifiedGains, ElevatorAndArm) {
  const FeedforwardGains gains{.kS = 0.2, .kV = 4.0, .kA = 0.25, .kG = 0.6, .angle_offset = 0.3};
  const auto check = [&](const Mechanism<2>& model, MechanismKind kind) {
    test::expect_second_order(model, -16.0, 4.0);
    EXPECT_EQ(model.kind, kind);
    EXPECT_EQ(model.gains.kG, 0.6);
  };
  check(elevator(gains).value(), MechanismKind::elevator);
  check(arm(gains).value(), MechanismKind::arm);
  check(turret(gains).value(), MechanismKind::turret);
  check(swerve_steer(gains).value(), MechanismKind::swerve_steer);
  test::expect_first_order(roller(gains).value(), -16.0, 4.0);
  test::expect_first_order(swerve_drive(gains).value(), -16.0, 4.0);
  EXPECT_EQ(swerve_drive(gains)->gains.gravity_voltage(MechanismKind::turret, 0.3), 0.0);
}

// The book's flywheel (K_v 0.011 V s/rad, K_a 0.005515 V s²/rad) and drivetrain (3.02 V s/m,
// 0.642 V s²/m) from identified gains, as its scripts print A and B in full.
TEST(IdentifiedGains, NumbersOfTheBooksScripts) {
  const Flywheel wheel = flywheel(FeedforwardGains{.kV = 0.011, .kA = 0.005515}).value();
  EXPECT_NEAR(wheel.A(0, 0), -1.9945602901178603, 1e-15 * 4);
  EXPECT_NEAR(wheel.B(0, 0), 181.32366273798732, 1e-13);
  const Elevator drive = elevator(FeedforwardGains{.kV = 3.02, .kA = 0.642}).value();
  EXPECT_NEAR(drive.A(1, 1), -4.70404984423676, 1e-14);
  EXPECT_NEAR(drive.B(1, 0), 1.557632398753894, 1e-15 * 4);
}

// A mechanism of known parts and the one identified from its own gains are the same model.
TEST(IdentifiedGains, RoundTripThroughTheTheorems) {
  const Elevator lift =
      elevator({.motor = neo(2), .gearing = 10.0, .mass = 8_kg, .drum_radius = 2.54_cm}).value();
  const Elevator identified = elevator(lift.gains).value();
  EXPECT_EQ(identified.A, lift.A);
  EXPECT_EQ(identified.B, lift.B);
  EXPECT_EQ(identified.gains.kG, lift.gains.kG);
}

// u = K_v v + K_a a must hold of the model's own acceleration, with friction and gravity
// u = K_s sgn v + K_v v + K_a a + gravity.
TEST(IdentifiedGains, TheModelAnswersTheFeedforwardVoltageWithItsAcceleration) {
  {
    const bool holds = rc::check([] {
      const auto between = [](double low, double high) {
        return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1000001);
      };
      const FeedforwardGains gains{.kS = between(0.0, 1.0),
                                   .kV = between(0.001, 10.0),
                                   .kA = between(0.001, 1.0),
                                   .kG = between(-2.0, 2.0),
                                   .angle_offset = between(-3.0, 3.0)};
      const double x = between(-3.0, 3.0);
      const double v = between(-5.0, 5.0);
      const double a = between(-20.0, 20.0);
      const double friction = v > 0.0 ? gains.kS : v < 0.0 ? -gains.kS : 0.0;
      const double free = friction + gains.kV * v + gains.kA * a;
      const auto error = [&](const Mechanism<2>& model, double u) {
        return std::abs(model.A(1, 1) * v + model.B(1, 0) * u + model.disturbance(x, v) - a);
      };
      const double rounding = 1e-13 * (20.0 + (std::abs(free) + 5.0) / gains.kA);
      RC_ASSERT(error(elevator(gains).value(), free + gains.kG) <= rounding);
      RC_ASSERT(error(arm(gains).value(), free + gains.kG * std::cos(x + gains.angle_offset)) <=
                rounding);
      const Flywheel wheel = flywheel(gains).value();
      RC_ASSERT(std::abs(wheel.A(0, 0) * v + wheel.B(0, 0) * free + wheel.disturbance(x, v) - a) <=
                rounding);
    });
    EXPECT_TRUE(holds);
  }
}

TEST(IdentifiedGains, GravityVoltage) {
  const FeedforwardGains gains{.kG = 2.0, .angle_offset = std::numbers::pi / 6.0};
  EXPECT_EQ(gains.gravity_voltage(MechanismKind::flywheel, 0.4), 0.0);
  EXPECT_EQ(gains.gravity_voltage(MechanismKind::elevator, 0.4), 2.0);
  // cos(π/6 + π/6) = 1/2; standing up at π/2 - π/6.
  EXPECT_NEAR(gains.gravity_voltage(MechanismKind::arm, std::numbers::pi / 6.0), 1.0, 1e-15);
  EXPECT_NEAR(gains.gravity_voltage(MechanismKind::arm, std::numbers::pi / 3.0), 0.0, 1e-15);
}

TEST(IdentifiedGains, FrictionOpposesMotionAndLeavesRestAlone) {
  const Elevator lift =
      elevator(FeedforwardGains{.kS = 0.3, .kV = 1.0, .kA = 0.1, .kG = 0.5}).value();
  EXPECT_DOUBLE_EQ(lift.disturbance(0.0, 1.0), -8.0);   // -(0.3 + 0.5)/0.1
  EXPECT_DOUBLE_EQ(lift.disturbance(0.0, -1.0), -2.0);  // -(-0.3 + 0.5)/0.1
  EXPECT_DOUBLE_EQ(lift.disturbance(0.0, 0.0), -5.0);
}

template <class Make>
void expect_refusals(const Make& make) {
  const FeedforwardGains good{.kS = 0.1, .kV = 1.0, .kA = 0.1, .kG = 0.5};
  ASSERT_TRUE(make(good));
  const auto refused = [&](FeedforwardGains gains, ArgumentError code, std::string_view name) {
    const auto result = make(gains);
    return !result && result.error().is(code) && result.error().subject() == name;
  };
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    const ArgumentError code =
        std::isfinite(bad) ? ArgumentError::not_positive : ArgumentError::not_finite;
    FeedforwardGains gains = good;
    gains.kV = bad;
    EXPECT_TRUE(refused(gains, code, "kV")) << bad;
    gains = good;
    gains.kA = bad;
    EXPECT_TRUE(refused(gains, code, "kA")) << bad;
  }
  FeedforwardGains gains = good;
  gains.kS = -0.01;
  EXPECT_TRUE(refused(gains, ArgumentError::out_of_range, "kS"));
  for (const double bad : {nan, infinity, -infinity}) {
    gains = good;
    gains.kS = bad;
    EXPECT_TRUE(refused(gains, ArgumentError::not_finite, "kS")) << bad;
    gains = good;
    gains.kG = bad;
    EXPECT_TRUE(refused(gains, ArgumentError::not_finite, "kG")) << bad;
    gains = good;
    gains.angle_offset = bad;
    EXPECT_TRUE(refused(gains, ArgumentError::not_finite, "angle_offset")) << bad;
  }
  // Two doubles whose quotient is none.
  gains = good;
  gains.kV = 1e300;
  gains.kA = 1e-300;
  EXPECT_FALSE(make(gains));
}

TEST(IdentifiedGains, Errors) {
  expect_refusals([](const FeedforwardGains& gains) { return flywheel(gains); });
  expect_refusals([](const FeedforwardGains& gains) { return elevator(gains); });
  expect_refusals([](const FeedforwardGains& gains) { return arm(gains); });
}

// Theorem 14.3.2: dx/dt = 0 x + 1 u.
TEST(IdentifiedGains, VelocityServo) {
  const ContinuousSystem<1, 1, 1> system = velocity_servo();
  EXPECT_EQ(system.A(0, 0), 0.0);
  EXPECT_EQ(system.B(0, 0), 1.0);
  EXPECT_EQ(system.C(0, 0), 1.0);
  EXPECT_EQ(system.D(0, 0), 0.0);
}

}  // namespace
}  // namespace flyball::mechanisms::identified_gains_test
