#include <flyball/mechanisms/power/motor_supply.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/derivatives/differentiation.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::motor_supply_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

PowerBus<1> one_motor(const CurrentLimits& limits, double resistance) {
  return {{MotorTerminal{.R = 0.1, .Kv = 50.0, .limits = limits}},
          {.open_circuit_voltage = 12.0, .resistance = resistance}};
}

// Stalled at full voltage, 12·0.1/(0.1 + 0.02) = 10 V and 100 A.
TEST(PowerBus, DividesTheVoltageAtStall) {
  const auto flow = one_motor({}, 0.02).flow<double>({12.0}, {0.0});
  EXPECT_NEAR(flow.rail, 10.0, 1e-14);
  EXPECT_NEAR(flow.current[0], 100.0, 1e-12);
  EXPECT_NEAR(flow.supply[0], 100.0, 1e-12);
  EXPECT_NEAR(flow.battery_current, 100.0, 1e-12);
}

// Stalled at 4 V, 40 A: 160 W at the rail; V = 12 - 0.02·160/V has 6 + √(36 - 3.2).
TEST(PowerBus, AControllerHasConstantPower) {
  const auto flow = one_motor({}, 0.02).flow<double>({4.0}, {0.0});
  EXPECT_NEAR(flow.rail, 6.0 + std::sqrt(32.8), 1e-13);
  EXPECT_NEAR(flow.supply[0], 160.0 / flow.rail, 1e-12);
  EXPECT_EQ(flow.voltage[0], 4.0);
}

// Stator 30 A: 3 V above the back EMF. Supply 10 A of 12 V at stall: V²/0.1 = 120 W, V = √12.
TEST(PowerBus, LimitsOfBothSides) {
  EXPECT_NEAR(one_motor({.stator = 30.0}, 0.0).flow<double>({12.0}, {200.0}).voltage[0], 7.0,
              1e-14);
  EXPECT_NEAR(one_motor({.stator = 30.0}, 0.0).flow<double>({-12.0}, {200.0}).voltage[0], 1.0,
              1e-14);
  const auto flow = one_motor({.supply = 10.0}, 0.0).flow<double>({12.0}, {0.0});
  EXPECT_NEAR(flow.voltage[0], std::sqrt(12.0), 1e-12);
  EXPECT_NEAR(flow.supply[0], 10.0, 1e-10);
  EXPECT_NEAR(flow.current[0], std::sqrt(12.0) / 0.1, 1e-11);
  // Plugging: the motor turns forward, and is driven backward: e/2 - √(e²/4 + 12).
  const auto plugged = one_motor({.supply = 10.0}, 0.0).flow<double>({-12.0}, {200.0});
  EXPECT_NEAR(plugged.voltage[0], 2.0 - std::sqrt(4.0 + 12.0), 1e-12);
  EXPECT_NEAR(plugged.supply[0], 10.0, 1e-10);
  // Braking feeds back, which is not limited.
  const auto braked = one_motor({.supply = 10.0}, 0.0).flow<double>({2.0}, {200.0});
  EXPECT_EQ(braked.voltage[0], 2.0);
  EXPECT_NEAR(braked.supply[0], 2.0 * -20.0 / 12.0, 1e-12);
}

PowerBus<3> random_bus(Random& random) {
  PowerBus<3> bus;
  bus.battery = {.open_circuit_voltage = random.uniform(11.0, 13.0),
                 .resistance = random.uniform(0.0, 0.05),
                 .other_current = random.uniform(0.0, 10.0)};
  for (MotorTerminal& motor : bus.motors) {
    motor = {.R = std::exp(random.uniform(-5.0, -1.0)),
             .Kv = random.uniform(20.0, 80.0),
             .limits = {
                 .stator = random.uniform(0.0, 1.0) < 0.3 ? infinity : random.uniform(5.0, 200.0),
                 .supply = random.uniform(0.0, 1.0) < 0.3 ? infinity : random.uniform(5.0, 80.0)}};
  }
  return bus;
}

std::array<double, 3> random_three(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

// Kirchhoff's law at the battery, both limits, and power: what the battery gives is what its
// resistance, the windings and the shafts take.
TEST(PowerBus, Laws) {
  Random random(121);
  int sagged = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const PowerBus<3> bus = random_bus(random);
    const auto wanted = random_three(random, 14.0);
    const auto speeds = random_three(random, 500.0);
    const auto flow = bus.flow<double>(wanted, speeds);
    if (flow.rail == 0.0) {
      continue;
    }
    sagged += flow.rail < 0.8 * bus.battery.open_circuit_voltage ? 1 : 0;
    EXPECT_NEAR(flow.rail,
                bus.battery.open_circuit_voltage - bus.battery.resistance * flow.battery_current,
                2e-12);
    double power = flow.rail * bus.battery.other_current;
    for (std::size_t k = 0; k < 3; ++k) {
      const double emf = speeds[k] / bus.motors[k].Kv;
      EXPECT_LE(std::abs(flow.voltage[k]), flow.rail * (1.0 + 1e-15));
      EXPECT_LE(flow.supply[k], bus.motors[k].limits.supply * (1.0 + 1e-9));
      const bool beyond = std::abs(emf) > flow.rail + bus.motors[k].limits.stator * bus.motors[k].R;
      if (!beyond) {
        EXPECT_LE(std::abs(flow.current[k]), bus.motors[k].limits.stator * (1.0 + 1e-9));
      }
      const double copper = flow.current[k] * flow.current[k] * bus.motors[k].R;
      power += copper + emf * flow.current[k];
      // What needs no limit is not changed.
      const double current = (wanted[k] - emf) / bus.motors[k].R;
      if (std::abs(wanted[k]) <= flow.rail && std::abs(current) <= bus.motors[k].limits.stator &&
          wanted[k] * current <= bus.motors[k].limits.supply * flow.rail) {
        EXPECT_EQ(flow.voltage[k], wanted[k]);
      }
    }
    EXPECT_NEAR(flow.rail * flow.battery_current, power, 1e-9 * (1.0 + std::abs(power)));
  }
  EXPECT_GT(sagged, 500);
}

// Exact derivatives of the solved rail against differences, away from kinks.
TEST(PowerBus, DerivativesOfTheImplicitFunction) {
  Random random(122);
  int compared = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const PowerBus<3> bus = random_bus(random);
    Eigen::Vector<double, 6> z;
    for (int k = 0; k < 3; ++k) {
      z(k) = random.uniform(-12.0, 12.0);
      z(3 + k) = random.uniform(-400.0, 400.0);
    }
    const auto rail = [&](const auto& at) {
      using Scalar = typename std::decay_t<decltype(at)>::Scalar;
      return bus.flow<Scalar>({at(0), at(1), at(2)}, {at(3), at(4), at(5)}).rail;
    };
    const auto exact = gradient(rail, z);
    bool smooth = true;
    Eigen::Vector<double, 6> numeric;
    for (int i = 0; i < 6; ++i) {
      const double h = i < 3 ? 1e-5 : 1e-3;
      Eigen::Vector<double, 6> up = z;
      Eigen::Vector<double, 6> down = z;
      up(i) += h;
      down(i) -= h;
      numeric(i) = (rail(up) - rail(down)) / (2.0 * h);
      smooth = smooth && std::abs(rail(up) - 2.0 * rail(z) + rail(down)) < 1e-9;
    }
    if (smooth) {
      EXPECT_LE((exact - numeric).norm(), 1e-5 * (1.0 + exact.norm()));
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(PowerBus, IsFiniteWhateverComes) {
  const double odd[] = {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity, 1e300, 0.0};
  for (const double volts : odd) {
    for (const double speed : odd) {
      for (const double resistance : {0.0, 0.02, 1.0}) {
        const auto flow =
            one_motor({.stator = 40.0, .supply = 30.0}, resistance).flow<double>({volts}, {speed});
        EXPECT_TRUE(std::isfinite(flow.rail) && std::isfinite(flow.voltage[0]));
      }
    }
  }
  // A battery that cannot hold what else is on.
  PowerBus<1> dead = one_motor({}, 1.0);
  dead.battery.other_current = 20.0;
  const auto flow = dead.flow<double>({5.0}, {0.0});
  EXPECT_EQ(flow.rail, 0.0);
  EXPECT_EQ(flow.voltage[0], 0.0);
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (int k = 0; k < 100; ++k) {
    sum += one_motor({.supply = 20.0}, 0.02).flow<double>({0.1 * k}, {1.0 * k}).rail;
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
  EXPECT_GT(sum, 0.0);
}

TEST(Brownout, HoldsOffUntilTheBatteryHasRecovered) {
  Brownout brownout;
  EXPECT_TRUE(brownout.update(6.8));
  EXPECT_FALSE(brownout.update(6.7));
  EXPECT_FALSE(brownout.update(7.4));
  EXPECT_FALSE(brownout.update(NAN));
  EXPECT_TRUE(brownout.update(7.6));
  EXPECT_TRUE(brownout.update(7.0));
  EXPECT_FALSE(brownout.update(0.0));
  EXPECT_EQ(brownout.count(), 2);
  Brownout crossed(6.3, 5.0);
  EXPECT_FALSE(crossed.update(6.0));
  EXPECT_FALSE(crossed.update(6.2));
  EXPECT_TRUE(crossed.update(6.4));
}

}  // namespace
}  // namespace flyball::mechanisms::motor_supply_test
