#include <flyball/mechanisms/powertrain.hpp>

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <flyball/core/errors.hpp>
#include <flyball/mechanisms/gravity.hpp>

namespace flyball::mechanisms::powertrain_test {
namespace {

/// Whether a current is allowed, by the definitions: the rail of P = u I is the larger root of
/// V² - V_open V + R_b P = 0.
bool is_allowed(const PowerLimits& limits, double e, double R, double I) {
  const double u = e + R * I;
  const double V = limits.battery.open_circuit_voltage -
                   limits.battery.resistance * limits.battery.other_current;
  const double discriminant = V * V - 4.0 * limits.battery.resistance * u * I;
  if (I > limits.stator_current || u > limits.voltage || discriminant < 0.0) {
    return false;
  }
  const double rail = 0.5 * (V + std::sqrt(discriminant));
  return u <= rail && u * I <= rail * limits.supply_current;
}

// The definition of "hardest": what is given is allowed, and a little more is not.
TEST(StrongestPush, IsTheGreatestCurrentThatEveryLimitAllows) {
  std::mt19937_64 random(7);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::array<int, power_bounds> seen{};
  for (int i = 0; i < 20'000; ++i) {
    const DcMotor motor = i % 3 == 0 ? neo(2) : i % 3 == 1 ? kraken_x60(1 + i % 7) : cim(4);
    PowerLimits limits{.voltage = between(4.0, 13.0),
                       .stator_current = between(20.0, 900.0),
                       .supply_current = between(10.0, 600.0)};
    limits.battery = {.open_circuit_voltage = between(10.0, 13.0),
                      .resistance = i % 5 == 0 ? 0.0 : between(0.001, 0.05),
                      .other_current = between(0.0, 20.0)};
    const double omega = between(-1.0, 1.0) * motor.free_speed;
    const int direction = i % 2 == 0 ? 1 : -1;
    const double R = motor.R * between(1.0, 1.5);
    const MotorPoint point = strongest_push(motor, limits, omega, direction, R);
    const double I = direction * point.current;
    const double e = direction * omega / motor.Kv;
    EXPECT_EQ(point.voltage, omega / motor.Kv + R * point.current);
    EXPECT_NEAR(point.rail * point.supply_current, point.power(),
                1e-9 * (1.0 + std::abs(point.power())));
    if (I == 0.0) {
      EXPECT_FALSE(is_allowed(limits, e, R, 1e-6)) << i;
      continue;
    }
    EXPECT_TRUE(is_allowed(limits, e, R, I * (1.0 - 1e-9))) << i << " " << to_string(point.bound);
    EXPECT_FALSE(is_allowed(limits, e, R, I * (1.0 + 1e-9))) << i << " " << to_string(point.bound);
    ++seen[static_cast<std::size_t>(point.bound)];
  }
  for (int bound = 0; bound < power_bounds - 1; ++bound) {
    EXPECT_GT(seen[static_cast<std::size_t>(bound)], 100)
        << to_string(static_cast<PowerBound>(bound));
  }
}

// At a standstill on a stiff battery: I = V/R, the stall current of the datasheet.
TEST(StrongestPush, AtAStandstillIsTheStallCurrent) {
  const DcMotor motor = neo(1);
  PowerLimits limits;
  limits.battery.open_circuit_voltage = 13.0;
  const MotorPoint point = strongest_push(motor, limits, 0.0, 1, motor.R);
  EXPECT_NEAR(point.current, 105.0, 1e-9);
  EXPECT_EQ(point.bound, PowerBound::voltage);
}

// Nothing is allowed that is faster than the voltage: a motor beyond its speed coasts.
TEST(StrongestPush, CoastsBeyondItsSpeed) {
  const DcMotor motor = neo(1);
  const MotorPoint point = strongest_push(motor, {}, 14.0 * motor.Kv, 1, motor.R);
  EXPECT_EQ(point.current, 0.0);
  EXPECT_EQ(point.power(), 0.0);
  EXPECT_EQ(point.rail, 12.0);
}

GearedLoad lift() {
  return {.kind = MechanismKind::elevator,
          .motor = neo(2),
          .gearing = 10.0,
          .radius = 0.0254,
          .inertia = 8.0,
          .rotor_inertia = 6e-4,
          .gravity = 8.0 * standard_gravity,
          .friction = 5.0,
          .motor_friction = 0.08,
          .efficiency = 0.9};
}

// The equations of the docstring hold, with η where the motors drive and 1/η where they are driven.
TEST(GearedLoad, AccelerationKeepsItsEquation) {
  const GearedLoad load = lift();
  const double k = load.ratio();
  for (const int direction : {1, -1}) {
    for (double I = -90.0; I <= 90.0; I += 7.5) {
      const double a = load.acceleration(0.3, direction, I);
      const double through =
          load.motor.Kt * I - direction * load.motor_friction - load.rotor_inertia * k * a;
      const double eta = through * direction >= 0.0 ? load.efficiency : 1.0 / load.efficiency;
      const double F = eta * k * through;
      EXPECT_NEAR(load.inertia * a, F - load.gravity - direction * load.friction,
                  1e-9 * (1.0 + std::abs(F)));
    }
  }
}

// An arm's gravity between two angles is greatest where it is level, if it passes there.
TEST(GearedLoad, GreatestWeightOfAnArm) {
  GearedLoad arm = lift();
  arm.kind = MechanismKind::arm;
  arm.gravity = 20.0;
  EXPECT_EQ(arm.greatest_weight(-1.0, 1.0), 20.0);
  EXPECT_NEAR(arm.greatest_weight(0.5, 1.0), 20.0 * std::cos(0.5), 1e-12);
  EXPECT_NEAR(arm.greatest_weight(1.0, 2.0), 20.0 * std::cos(1.0), 1e-12);
  EXPECT_EQ(arm.greatest_weight(1.0, 3.5), 20.0);
  arm.angle_offset = -0.5;
  EXPECT_EQ(arm.greatest_weight(0.5, 1.0), 20.0);
}

// At the slipping current the force on the floor is the grip: M a = grip - friction.
TEST(GearedLoad, SlippingCurrentGivesTheGrip) {
  GearedLoad wheel = lift();
  wheel.kind = MechanismKind::swerve_drive;
  wheel.gravity = 0.0;
  wheel.grip = 60.0;
  for (const int push : {1, -1}) {
    const double I = wheel.slipping_current(1, push);
    EXPECT_NEAR(wheel.inertia * wheel.acceleration(0.0, 1, push * I), push * 60.0 - 5.0, 1e-9);
  }
}

TEST(GearedLoad, WhatCannotBeIsRefused) {
  const auto refused = [](auto change) {
    GearedLoad load = lift();
    change(load);
    const auto checked = check_load(load, "size");
    return checked ? std::string() : to_string(checked.error());
  };
  EXPECT_EQ(refused([](GearedLoad&) {}), "");
  EXPECT_NE(refused([](GearedLoad& l) { l.efficiency = 90.0; }).find("90 % is 0.9"),
            std::string::npos);
  EXPECT_NE(refused([](GearedLoad& l) { l.gearing = 0.0; }).find("gearing"), std::string::npos);
  EXPECT_NE(refused([](GearedLoad& l) { l.inertia = NAN; }).find("inertia"), std::string::npos);
  EXPECT_NE(refused([](GearedLoad& l) { l.friction = -1.0; }).find("friction"), std::string::npos);
  EXPECT_NE(refused([](GearedLoad& l) { l.grip = 0.0; }).find("grip"), std::string::npos);
  PowerLimits limits;
  limits.battery = {.open_circuit_voltage = 12.0, .resistance = 0.1, .other_current = 130.0};
  EXPECT_FALSE(check_limits(limits, "size"));
  limits.battery.other_current = 0.0;
  EXPECT_TRUE(check_limits(limits, "size"));
  limits.supply_current = -1.0;
  EXPECT_FALSE(check_limits(limits, "size"));
}

}  // namespace
}  // namespace flyball::mechanisms::powertrain_test
