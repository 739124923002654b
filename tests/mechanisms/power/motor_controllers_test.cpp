#include <flyball/mechanisms/power/motor_controllers.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/mechanisms/current_limit.hpp>
#include <flyball/mechanisms/lift/cascade_elevator.hpp>
#include <flyball/mechanisms/power/powered.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::motor_controllers_test {
namespace {

using namespace flyball::literals;
using Input = Eigen::Vector<double, 1>;
using Eigen::Vector2d;

CascadeElevator lift(Mass carriage) {
  return cascade_elevator({.shaft = {.motor = cim(2), .gearing = 6.0},
                           .drum_radius = Length(0.02),
                           .carriage = carriage})
      .value();
}

// As the book's reactive limit: the first period draws what it draws, the next 40 A.
TEST(MotorControllers, ReduceWhatWasExceeded) {
  const DcMotor motor = vex_775pro();
  const std::array terminals{
      MotorTerminal{.R = motor.R, .Kv = motor.Kv, .limits = {.stator = 40.0}}};
  MotorControllers<1> controllers(terminals);
  const PowerBus<1> bus{{MotorTerminal{.R = motor.R, .Kv = motor.Kv}}, Battery{}};
  const auto first = bus.flow<double>({12.0}, {500.0});
  EXPECT_NEAR(first.current[0], 100.01918753740046, 1e-9);
  const auto next = controllers.update({12.0}, first);
  EXPECT_NEAR(next[0], 6.625147384710406, 1e-12);  // Snippet 12.1 in NumPy
  EXPECT_NEAR(next[0], limit_measured_current(motor, 12.0, 12.0, first.current[0], 40.0), 1e-12);
  EXPECT_NEAR(bus.flow<double>(next, {500.0}).current[0], 40.0, 1e-11);
}

// Each millisecond on a battery that sags: beyond the first one the limits are kept but for what a
// period changes, and predictive limits come to the same motion.
TEST(MotorControllers, KeepLimitsButForAPeriod) {
  const CascadeElevator elevator = lift(40_kg);
  const CurrentLimits limits{.stator = 80.0, .supply = 50.0};
  const Battery battery{.open_circuit_voltage = 12.5, .resistance = 0.02};
  const auto loose = powered(elevator, {}, battery).value();
  const auto predictive = powered(elevator, limits, battery).value();
  MotorControllers<1> controllers(
      {MotorTerminal{elevator.shaft(0).R, elevator.shaft(0).Kv, limits}});
  Vector2d x(0.0, 0.0);
  Vector2d z = x;
  PowerFlow<1> flow = loose.flow(x, Input(0.0));
  for (int k = 0; k < 600; ++k) {
    const Input u(controllers.update({12.0}, flow)[0]);
    flow = loose.flow(x, u);
    if (k > 0) {
      ASSERT_LE(flow.current[0], 80.0 * 1.02);
      ASSERT_LE(flow.supply[0], 50.0 * 1.03);
    }
    x = rk4(loose, x, u, 1e-3);
    z = rk4(predictive, z, Input(12.0), 1e-3);
  }
  EXPECT_GT(x(0), 0.15);
  EXPECT_NEAR(x(0), z(0), 0.05 * z(0));
  EXPECT_EQ(controllers.brownout().count(), 0);
}

// A weak battery: the rail falls below 6.75 V, the motors go off, it recovers, and again.
TEST(MotorControllers, BrownOut) {
  const CascadeElevator elevator = lift(200_kg);
  const Battery weak{.open_circuit_voltage = 12.0, .resistance = 0.06};
  const auto loose = powered(elevator, {}, weak).value();
  MotorControllers<1> controllers({MotorTerminal{elevator.shaft(0).R, elevator.shaft(0).Kv, {}}});
  Vector2d x(0.0, 0.0);
  PowerFlow<1> flow = loose.flow(x, Input(0.0));
  int off = 0;
  for (int k = 0; k < 50; ++k) {
    const bool low = flow.rail < 6.75;
    const Input u(controllers.update({12.0}, flow)[0]);
    if (low) {
      ++off;
      ASSERT_EQ(u(0), 0.0);
      ASSERT_FALSE(controllers.brownout().enabled());
    }
    flow = loose.flow(x, u);
    x = rk4(loose, x, u, 0.02);
  }
  EXPECT_GT(off, 10);
  EXPECT_EQ(controllers.brownout().count(), off);
}

TEST(MotorControllers, AreFiniteAndAllocateNothing) {
  MotorControllers<2> controllers(
      {MotorTerminal{0.1, 50.0, {.stator = 40.0, .supply = 30.0}}, MotorTerminal{0.05, 60.0, {}}});
  const double odd[] = {std::numeric_limits<double>::quiet_NaN(),
                        std::numeric_limits<double>::infinity(), -1e300, 5.0};
  const test::AllocationCounter counter;
  for (const double a : odd) {
    for (const double b : odd) {
      PowerFlow<2> flow;
      flow.rail = 12.0;
      flow.voltage = {a, b};
      flow.current = {b, a};
      for (const double volts : controllers.update({a, b}, flow)) {
        EXPECT_LE(std::abs(volts), 12.0);
      }
      flow.rail = a;
      for (const double volts : controllers.update({b, a}, flow)) {
        EXPECT_TRUE(std::isfinite(volts));
      }
    }
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
}

}  // namespace
}  // namespace flyball::mechanisms::motor_controllers_test
