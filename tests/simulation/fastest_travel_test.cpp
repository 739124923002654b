#include <flyball/simulation/fastest_travel.hpp>

#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include <flyball/core/errors.hpp>
#include <flyball/mechanisms/gravity.hpp>

namespace flyball::fastest_travel_test {
namespace {

using mechanisms::MechanismKind;
using mechanisms::standard_gravity;

/// A wheel on a motor, on a battery that does not sag.
TravelJob wheel(double J) {
  TravelJob job;
  job.load = {
      .kind = MechanismKind::flywheel, .motor = mechanisms::neo(1), .gearing = 1.0, .inertia = J};
  job.load.motor_friction = job.load.motor.Kt * job.load.motor.free_current;
  job.limits.battery = {.open_circuit_voltage = 12.0};
  job.speed = true;
  return job;
}

// J dω/dt = K_t (V - ω/K_v)/R - K_t I_free: ω(t) = ω_free (1 - e^{-t/τ}), τ = J R K_v/K_t.
TEST(FastestTravel, AMotorWithoutLoadGoesToItsFreeSpeed) {
  TravelJob job = wheel(1e-3);
  const auto& motor = job.load.motor;
  const double tau = job.load.inertia * motor.R * motor.Kv / motor.Kt;
  for (const double share : {0.1, 0.5, 0.9, 0.99}) {
    job.end = share * motor.free_speed;
    const auto travel = fastest_travel(job);
    ASSERT_TRUE(travel) << to_string(travel.error());
    // An error of the speed is one of the time over how fast it still rises.
    EXPECT_NEAR(travel->time, -tau * std::log1p(-share), 1e-9 * tau / (1.0 - share)) << share;
    EXPECT_NEAR(travel->peak_current, motor.stall_current, 1e-9);
    EXPECT_EQ(travel->switching_time, travel->time);
  }
  // Backwards is the same.
  job.end = -0.5 * motor.free_speed;
  EXPECT_NEAR(fastest_travel(job).value().time, -tau * std::log(0.5), 1e-8 * tau);
  // And beyond the free speed it does not go.
  job.end = 1.001 * motor.free_speed;
  const auto beyond = fastest_travel(job);
  ASSERT_FALSE(beyond);
  EXPECT_TRUE(beyond.error().is(TravelError::never_there)) << to_string(beyond.error());
}

// From a speed to another: t = τ ln((ω_free - ω_0)/(ω_free - ω_1)).
TEST(FastestTravel, RecoversFromADip) {
  TravelJob job = wheel(2e-3);
  const auto& motor = job.load.motor;
  const double tau = job.load.inertia * motor.R * motor.Kv / motor.Kt;
  job.start = 0.6 * motor.free_speed;
  job.end = 0.8 * motor.free_speed;
  EXPECT_NEAR(fastest_travel(job).value().time, tau * std::log(0.4 / 0.2), 1e-8 * tau);
}

// Under a current limit alone the torque is constant: half the way up, half down,
// t = 2 √(θ (J + G² J_r)/(G τ)); it is least at G = √(J/J_r).
TEST(FastestTravel, UnderConstantTorqueTheBestRatioMatchesTheInertias) {
  TravelJob job;
  job.load = {.kind = MechanismKind::turret,
              .motor = mechanisms::kraken_x60(1),
              .inertia = 0.5,
              .rotor_inertia = 2e-4};
  job.limits = {.voltage = 1e4, .stator_current = 40.0};
  job.limits.battery = {.open_circuit_voltage = 1e4};
  job.end = 2.0;
  const double torque = 40.0 * job.load.motor.Kt;
  const double best = std::sqrt(0.5 / 2e-4);
  double least = INFINITY;
  for (const double factor : {0.5, 0.9, 0.99, 1.0, 1.01, 1.1, 2.0}) {
    job.load.gearing = factor * best;
    const double G = job.load.gearing;
    const double t = 2.0 * std::sqrt(2.0 * (0.5 + G * G * 2e-4) / (G * torque));
    const auto travel = fastest_travel(job);
    ASSERT_TRUE(travel) << to_string(travel.error());
    EXPECT_NEAR(travel->time, t, 1e-9 * t) << factor;
    EXPECT_NEAR(travel->switching_time, 0.5 * t, 1e-9 * t);
    if (factor == 1.0) {
      least = travel->time;
    }
  }
  for (const double factor : {0.99, 1.01}) {
    job.load.gearing = factor * best;
    EXPECT_GT(fastest_travel(job).value().time, least);
  }
}

TravelJob lift() {
  TravelJob job;
  job.load = {.kind = MechanismKind::elevator,
              .motor = mechanisms::neo(2),
              .gearing = 6.0,
              .radius = 0.0254,
              .inertia = 20.0,
              .rotor_inertia = 6e-4,
              .gravity = 20.0 * standard_gravity,
              .friction = 15.0,
              .efficiency = 0.9};
  job.load.motor_friction = job.load.motor.Kt * job.load.motor.free_current;
  job.limits = {.voltage = 12.0, .stator_current = 80.0, .supply_current = 50.0};
  job.limits.battery = {.open_circuit_voltage = 12.5, .resistance = 0.020};
  job.winding.heat_capacity = 40.0;
  job.end = 1.2;
  return job;
}

// SciPy 1.10, solve_ivp (RK45, rtol 1e-11, max_step 2 ms) with the greatest current found by
// bisection of the limits, and brentq for the instant of the brake:
//   ts 0.9050060909721127, T 1.0430188203857702, warmth 3.2765793573606947 K,
//   taken 518.9770441357575 J, returned 9.896940083454243 J, heat 262.12634858885554 J,
//   top speed 1.8203784962109593 m/s; holding current 33.53119942307691 A.
TEST(FastestTravel, AgreesWithAnIndependentIntegration) {
  const TravelJob job = lift();
  const auto travel = fastest_travel(job);
  ASSERT_TRUE(travel) << to_string(travel.error());
  EXPECT_NEAR(travel->time, 1.0430188203857702, 1e-8);
  EXPECT_NEAR(travel->switching_time, 0.9050060909721127, 1e-8);
  EXPECT_NEAR(travel->top_speed, 1.8203784962109593, 1e-7);
  EXPECT_NEAR(travel->temperature, 25.0 + 3.2765793573606947, 1e-6);
  EXPECT_NEAR(travel->energy, 518.9770441357575, 1e-5);
  EXPECT_NEAR(travel->returned, 9.896940083454243, 1e-5);
  EXPECT_NEAR(travel->heat, 262.12634858885554, 1e-5);
  EXPECT_NEAR(job.load.holding_current(0.0, 1.2), 33.53119942307691, 1e-9);
  EXPECT_NEAR(travel->peak_current, 80.0, 1e-9);
  EXPECT_LE(travel->peak_supply, 50.0 + 1e-9);
  // The rail at 50 A.
  EXPECT_NEAR(travel->least_rail, 12.5 - 0.020 * 50.0, 1e-6);
  EXPECT_NEAR(std::accumulate(travel->bound_time.begin(), travel->bound_time.end(), 0.0),
              travel->time, 1e-12);
}

// From rest to rest all that was taken from the rail is heat, height and friction. What the motor
// turns into work is e I = K_t I ω/(K_t K_v): a datasheet's K_t and K_v need not be of one motor.
TEST(FastestTravel, EnergyIsConserved) {
  TravelJob job = lift();
  job.load.efficiency = 1.0;
  const auto travel = fastest_travel(job).value();
  const double k = job.load.ratio();
  const double height = job.load.gravity * job.end;
  const double friction = (job.load.friction + k * job.load.motor_friction) * job.end;
  EXPECT_NEAR(travel.energy - travel.returned,
              travel.heat + (height + friction) / (job.load.motor.Kt * job.load.motor.Kv),
              1e-8 * travel.energy);
}

// An arm, there and back: the way up and the way down are not alike, the way mirrored is.
TEST(FastestTravel, AnArmUpAndDown) {
  TravelJob job = lift();
  job.load.kind = MechanismKind::arm;
  job.load.radius = 1.0;
  job.load.gearing = 60.0;
  job.load.inertia = 2.0;
  job.load.gravity = 6.0 * standard_gravity * 0.4;
  job.load.friction = 1.0;
  job.start = -0.5 * std::numbers::pi;
  job.end = 0.5 * std::numbers::pi;
  const double up = fastest_travel(job).value().time;
  std::swap(job.start, job.end);
  const double down = fastest_travel(job).value().time;
  EXPECT_LT(down, up);
  // cos is even about level: mirrored left to right it is the same way up.
  job.start = 1.5 * std::numbers::pi;
  job.end = 0.5 * std::numbers::pi;
  EXPECT_NEAR(fastest_travel(job).value().time, up, 1e-7 * up);
}

// A sprint does not stop; with little grip it is t = √(2 d/(μ g)).
TEST(FastestTravel, ASprintWithoutGripIsBoundByIt) {
  TravelJob job = lift();
  job.load.kind = MechanismKind::swerve_drive;
  job.load.gravity = 0.0;
  job.load.friction = 0.0;
  job.load.gearing = 20.0;
  job.load.grip = 0.1 * 20.0 * standard_gravity;
  job.stops = false;
  job.end = 0.2;
  const auto travel = fastest_travel(job);
  ASSERT_TRUE(travel) << to_string(travel.error());
  EXPECT_NEAR(travel->time, std::sqrt(2.0 * 0.2 / (0.1 * standard_gravity)), 1e-8);
  EXPECT_NEAR(travel->bound_time[static_cast<std::size_t>(mechanisms::PowerBound::grip)],
              travel->time, 1e-12);
}

TEST(FastestTravel, TheRecordIsTheMotion) {
  const TravelJob job = lift();
  const auto travel = fastest_travel(job).value();
  const auto series = record_travel(job, 101);
  ASSERT_TRUE(series) << to_string(series.error());
  EXPECT_EQ(series->rows(), 101u);
  EXPECT_NEAR(series->time().back(), travel.time, 1e-9);
  EXPECT_NEAR(series->find("position")->back(), 1.2, 1e-8);
  EXPECT_NEAR(series->find("velocity")->back(), 0.0, 1e-7);
  EXPECT_NEAR(series->find("energy")->back(), travel.energy - travel.returned, 1e-6);
  EXPECT_NEAR(series->find("temperature")->back(), travel.temperature, 1e-7);
  for (std::size_t i = 0; i < series->rows(); ++i) {
    EXPECT_LE(std::abs((*series->find("current"))[i]), 80.0 + 1e-9);
    EXPECT_LE((*series->find("supply_current"))[i], 50.0 + 1e-9);
    EXPECT_LE((*series->find("voltage"))[i], 12.0 + 1e-9);
  }
}

TEST(FastestTravel, WhatCannotBeDoneIsToldWithItsNumbers) {
  TravelJob heavy = lift();
  heavy.load.gearing = 1.0;
  const auto held = fastest_travel(heavy);
  ASSERT_FALSE(held);
  EXPECT_TRUE(held.error().is(TravelError::cannot_hold));
  EXPECT_NE(to_string(held.error()).find("201.2 A of 2 motors"), std::string::npos)
      << to_string(held.error());

  TravelJob stuck = lift();
  stuck.load.friction = 2000.0;
  EXPECT_TRUE(fastest_travel(stuck).error().is(TravelError::cannot_start));

  TravelJob slow = lift();
  slow.load.gearing = 10000.0;
  const auto late = fastest_travel(slow);
  ASSERT_FALSE(late);
  EXPECT_TRUE(late.error().is(TravelError::too_long)) << to_string(late.error());

  TravelJob nowhere = lift();
  nowhere.end = nowhere.start;
  EXPECT_TRUE(fastest_travel(nowhere).error().is(ArgumentError::out_of_range));
  TravelJob unknown = lift();
  unknown.end = NAN;
  EXPECT_TRUE(fastest_travel(unknown).error().is(ArgumentError::not_finite));
  TravelJob backwards = wheel(1e-3);
  backwards.start = 100.0;
  backwards.end = 50.0;
  EXPECT_TRUE(fastest_travel(backwards).error().is(ArgumentError::out_of_range));
}

// An arm that sets off and stays below the level: gravity is stronger there than the motors.
TEST(FastestTravel, AnArmThatGetsStuckIsToldWhere) {
  TravelJob job = lift();
  job.load.kind = MechanismKind::arm;
  job.load.radius = 1.0;
  job.load.gearing = 20.0;
  job.load.inertia = 2.0;
  job.load.efficiency = 1.0;
  const double most = 80.0 * job.load.motor.Kt * 20.0;  // N m, at the joint
  job.load.friction = 0.65 * most;
  job.load.gravity = 0.6 * most;
  job.start = -1.5;
  job.end = 1.0;
  const auto travel = fastest_travel(job);
  ASSERT_FALSE(travel);
  EXPECT_TRUE(travel.error().is(TravelError::never_there)) << to_string(travel.error());
  EXPECT_NE(to_string(travel.error()).find("gravity and friction"), std::string::npos);
}

}  // namespace
}  // namespace flyball::fastest_travel_test
