#include <flyball/simulation/mechanism_plant.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::mechanism_plant_test {
namespace {

using mechanisms::FeedforwardGains;
using mechanisms::MechanismKind;

constexpr FeedforwardGains gains{.kS = 0.2, .kV = 1.5, .kA = 0.3, .kG = 0.6, .angle_offset = 0.2};

MechanismPlant plant(MechanismKind kind, const FeedforwardGains& g = gains,
                     double breakaway = 1.0) {
  return MechanismPlant::create(kind, g, breakaway).value();
}

// v(t) = v_end (1 - e^{-t/τ}), x(t) = v_end (t - τ (1 - e^{-t/τ})), v_end = (V - kS)/kV, τ = kA/kV.
TEST(MechanismPlant, FlywheelStep) {
  const double tau = 0.2;
  const double v_end = (6.0 - 0.2) / 1.5;
  for (const double t : {1e-3, 0.1, 2.0}) {
    const auto state = plant(MechanismKind::flywheel).step({}, 6.0, t);
    EXPECT_NEAR(state.velocity, -v_end * std::expm1(-t / tau), 1e-14 * v_end);
    EXPECT_NEAR(state.position, v_end * (t + tau * std::expm1(-t / tau)), 1e-13);
  }
}

TEST(MechanismPlant, SticksWithinFriction) {
  const auto flywheel = plant(MechanismKind::flywheel);
  EXPECT_EQ(flywheel.step({}, 0.19, 10.0).velocity, 0.0);
  EXPECT_EQ(flywheel.acceleration({}, 0.19), 0.0);
  EXPECT_GT(flywheel.step({}, 0.21, 1.0).velocity, 0.0);
  // Gravity 0.6 V: held from 0.4 V to 0.8 V, falling below.
  const auto elevator = plant(MechanismKind::elevator);
  EXPECT_EQ(elevator.step({1.0, 0.0}, 0.45, 10.0).position, 1.0);
  EXPECT_EQ(elevator.step({1.0, 0.0}, 0.75, 10.0).position, 1.0);
  EXPECT_LT(elevator.step({1.0, 0.0}, 0.35, 1.0).position, 1.0);
  EXPECT_GT(elevator.step({1.0, 0.0}, 0.85, 1.0).position, 1.0);
}

TEST(MechanismPlant, BreakawayNeedsMore) {
  const auto sticky = plant(MechanismKind::flywheel, gains, 1.5);
  EXPECT_EQ(sticky.step({}, 0.29, 1.0).velocity, 0.0);
  EXPECT_GT(sticky.step({}, 0.31, 1.0).velocity, 0.0);
  // Once moving, sliding friction is all there is.
  EXPECT_GT(sticky.step({0.0, 0.1}, 0.25, 10.0).velocity, 0.0);
}

// From v at zero volts it stops at t = τ ln(1 + v kV/kS) and stays.
TEST(MechanismPlant, StopsExactly) {
  const double tau = 0.2;
  const double v = 2.0;
  const double t_stop = tau * std::log1p(v * 1.5 / 0.2);
  const auto flywheel = plant(MechanismKind::flywheel);
  EXPECT_GT(flywheel.step({0.0, v}, 0.0, t_stop * (1.0 - 1e-9)).velocity, 0.0);
  const auto stopped = flywheel.step({0.0, v}, 0.0, 3.0);
  EXPECT_EQ(stopped.velocity, 0.0);
  // Its way: v_end t + (v - v_end) τ (1 - e^{-t/τ}) with v_end = -kS/kV.
  const double v_end = -0.2 / 1.5;
  EXPECT_NEAR(stopped.position, v_end * t_stop - (v - v_end) * tau * std::expm1(-t_stop / tau),
              1e-14);
}

// One long step is many short ones, reversals included.
TEST(MechanismPlant, StepsAddUp) {
  Random random(14);
  for (const auto kind : {MechanismKind::flywheel, MechanismKind::elevator}) {
    for (int trial = 0; trial < 200; ++trial) {
      const auto p = plant(kind, gains, trial % 2 == 0 ? 1.0 : 1.3);
      const MechanismState start{random.normal(), 3.0 * random.normal()};
      const double voltage = 4.0 * random.normal();
      const double duration = random.uniform(0.0, 1.0);
      const auto whole = p.step(start, voltage, duration);
      MechanismState parts = start;
      for (int i = 0; i < 64; ++i) {
        parts = p.step(parts, voltage, duration / 64.0);
      }
      ASSERT_NEAR(whole.velocity, parts.velocity, 1e-12);
      ASSERT_NEAR(whole.position, parts.position, 1e-12);
    }
  }
}

// a = (V - kS sgn(v) - kV v - gravity)/kA, and what a short step does to the velocity.
TEST(MechanismPlant, AcceleratesAsItSteps) {
  const MechanismState state{0.4, -1.3};
  const auto elevator = plant(MechanismKind::elevator);
  EXPECT_NEAR(elevator.acceleration(state, 2.0), (2.0 + 0.2 + 1.5 * 1.3 - 0.6) / 0.3, 1e-14);
  constexpr double h = 1e-6;
  for (const auto kind : {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm}) {
    const auto p = plant(kind);
    const double slope = (p.step(state, 2.0, h).velocity - state.velocity) / h;
    EXPECT_NEAR(p.acceleration(state, 2.0), slope, 1e-4);
  }
}

// The exact steps of the arm against a classical Runge-Kutta of order 4 at 1 us steps, away from
// reversals: second order at 0.25 ms leaves about 1e-8.
TEST(MechanismPlant, ArmAgreesWithRungeKutta) {
  const auto arm = plant(MechanismKind::arm);
  const double voltage = 3.0;
  const auto rate = [&](const MechanismState& s) {
    return (voltage - 0.2 - 0.6 * std::cos(s.position + 0.2) - 1.5 * s.velocity) / 0.3;
  };
  MechanismState s{-1.0, 0.5};
  const auto end = arm.step(s, voltage, 0.5);
  const double h = 1e-5;
  for (int i = 0; i < 50000; ++i) {
    const double a1 = rate(s);
    const MechanismState s2{s.position + 0.5 * h * s.velocity, s.velocity + 0.5 * h * a1};
    const double a2 = rate(s2);
    const MechanismState s3{s.position + 0.5 * h * s2.velocity, s.velocity + 0.5 * h * a2};
    const double a3 = rate(s3);
    const MechanismState s4{s.position + h * s3.velocity, s.velocity + h * a3};
    const double a4 = rate(s4);
    s.position += h / 6.0 * (s.velocity + 2.0 * s2.velocity + 2.0 * s3.velocity + s4.velocity);
    s.velocity += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }
  EXPECT_NEAR(end.position, s.position, 3e-8);
  EXPECT_NEAR(end.velocity, s.velocity, 3e-8);
}

// A lightly damped arm swings, and comes to rest where gravity's torque is within friction; there
// it stays.
TEST(MechanismPlant, ArmComesToRest) {
  FeedforwardGains swinging = gains;
  swinging.kV = 0.2;
  const auto arm = plant(MechanismKind::arm, swinging);
  const auto rest = arm.step({0.5, 0.0}, 0.0, 60.0);
  EXPECT_EQ(rest.velocity, 0.0);
  EXPECT_LE(std::abs(0.6 * std::cos(rest.position + 0.2)), 0.2);
  EXPECT_EQ(arm.step(rest, 0.0, 5.0).position, rest.position);
  EXPECT_LT(rest.position, 0.0);
}

// A heavily damped one creeps towards the place where friction holds it, ever more slowly.
TEST(MechanismPlant, DampedArmCreeps) {
  const auto rest = plant(MechanismKind::arm).step({0.5, 0.0}, 0.0, 60.0);
  EXPECT_LT(std::abs(rest.velocity), 1e-9);
  EXPECT_NEAR(0.6 * std::cos(rest.position + 0.2), 0.2, 1e-8);
}

// A kA of zero: the velocity is (V - gravity - kS)/kV at once, and zero within friction.
TEST(MechanismPlant, NoInertia) {
  FeedforwardGains quick = gains;
  quick.kA = 0.0;
  const auto elevator = plant(MechanismKind::elevator, quick);
  const auto up = elevator.step({1.0, -3.0}, 3.0, 0.5);
  EXPECT_DOUBLE_EQ(up.velocity, (3.0 - 0.6 - 0.2) / 1.5);
  EXPECT_DOUBLE_EQ(up.position, 1.0 + 0.5 * up.velocity);
  const auto held = elevator.step({1.0, 2.0}, 0.6, 0.5);
  EXPECT_EQ(held.velocity, 0.0);
  EXPECT_EQ(held.position, 1.0);
}

// A very small kA does not make the arm's steps unstable.
TEST(MechanismPlant, StiffArm) {
  FeedforwardGains stiff = gains;
  stiff.kA = 1e-9;
  const auto state = plant(MechanismKind::arm, stiff).step({}, 3.0, 0.02);
  EXPECT_NEAR(state.velocity, (3.0 - 0.2 - 0.6 * std::cos(state.position + 0.2)) / 1.5, 1e-4);
}

TEST(MechanismPlant, Errors) {
  const auto create = [](FeedforwardGains g, double breakaway) {
    return MechanismPlant::create(MechanismKind::arm, g, breakaway);
  };
  EXPECT_TRUE(create({.kV = 0.0}, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(create({.kV = 1.0, .kA = -1.0}, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create({.kS = -1.0, .kV = 1.0}, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create({.kV = 1.0, .kG = std::nan("")}, 1.0).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(create({.kV = 1.0}, 0.5).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::mechanism_plant_test
