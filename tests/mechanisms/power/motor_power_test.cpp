#include <flyball/mechanisms/power/motor_power.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/mechanisms/current_limit.hpp>

namespace flyball::mechanisms::motor_power_test {
namespace {

// A CIM at 12 V: at free speed nothing comes out of it and I_free is drawn; stalled all is heat.
TEST(MotorPower, OfADatasheet) {
  const DcMotor motor = cim();
  const MotorPower free = motor_power(motor, motor.free_speed, 12.0);
  EXPECT_NEAR(free.electrical, 12.0 * 2.7, 1e-10);
  EXPECT_NEAR(free.shaft, 0.0, 1e-10);
  EXPECT_NEAR(free.efficiency(), 0.0, 1e-12);
  const MotorPower stalled = motor_power(motor, 0.0, 12.0);
  EXPECT_NEAR(stalled.copper, 12.0 * 133.0, 1e-9);
  EXPECT_EQ(stalled.shaft, 0.0);
  EXPECT_NEAR(stalled.lost, 0.0, 1e-9);
}

// What comes in goes somewhere, and heats: copper never cools; the best speeds are the best.
TEST(MotorPower, Laws) {
  Random random(121);
  for (int trial = 0; trial < 300; ++trial) {
    const DcMotor motor = trial % 2 == 0 ? cim(2) : kraken_x60();
    const double volts = random.uniform(-12.0, 12.0);
    const double omega = random.uniform(-700.0, 700.0);
    const MotorPower power = motor_power(motor, omega, volts);
    EXPECT_NEAR(power.electrical, power.copper + power.lost + power.shaft,
                1e-9 * (1.0 + std::abs(power.electrical)));
    EXPECT_GE(power.copper, 0.0);
    EXPECT_GE(power.efficiency(), 0.0);
    EXPECT_LE(power.efficiency(), 1.0);
  }
  for (const double volts : {12.0, 6.0, -9.0}) {
    const DcMotor motor = cim();
    const double best = most_efficient_speed(motor, volts);
    const double strongest = most_powerful_speed(motor, volts);
    const double efficiency = motor_power(motor, best, volts).efficiency();
    const double power = motor_power(motor, strongest, volts).shaft;
    EXPECT_GT(efficiency, 0.5);
    for (double by = -0.3; by <= 0.3; by += 0.01) {
      if (const MotorPower there = motor_power(motor, best * (1.0 + by), volts);
          there.shaft > 0.0) {  // beyond free speed it brakes
        EXPECT_LE(there.efficiency(), efficiency + 1e-12);
      }
      EXPECT_LE(motor_power(motor, strongest * (1.0 + by), volts).shaft, power + 1e-10);
    }
  }
  EXPECT_EQ(most_efficient_speed(cim(), 0.1), 0.0);
  EXPECT_EQ(most_powerful_speed(cim(), 0.1), 0.0);
}

// V (V - e)/(R V_rail) at the limit: 775pro at 500 rad/s, 20 A of 12 V. By hand V = e/2 + √(e²/4 +
// R·240).
TEST(SupplyCurrentLimit, Predicted) {
  const DcMotor motor = vex_775pro();
  const double e = 500.0 / motor.Kv;
  const double limited = limit_predicted_supply_current(motor, 12.0, 500.0, 12.0, 20.0);
  EXPECT_NEAR(limited, 0.5 * e + std::sqrt(0.25 * e * e + motor.R * 240.0), 1e-13);
  EXPECT_NEAR(limited * motor.current(500.0, limited) / 12.0, 20.0, 1e-11);
  // What draws less is left alone, braking too.
  EXPECT_EQ(limit_predicted_supply_current(motor, 4.0, 500.0, 12.0, 20.0), 4.0);
  EXPECT_EQ(limit_predicted_supply_current(motor, 0.0, 500.0, 12.0, 0.0), 0.0);
  // Plugging draws.
  const double plugged = limit_predicted_supply_current(motor, -12.0, 500.0, 12.0, 20.0);
  EXPECT_NEAR(plugged * motor.current(500.0, plugged) / 12.0, 20.0, 1e-11);
  // The same by a measured current.
  EXPECT_NEAR(
      limit_measured_supply_current(motor, 12.0, 9.0, motor.current(500.0, 9.0), 12.0, 20.0),
      limited, 1e-12);
  for (const double odd : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(), -1e300}) {
    EXPECT_TRUE(std::isfinite(limit_predicted_supply_current(motor, odd, 100.0, 12.0, 40.0)));
    EXPECT_TRUE(std::isfinite(limit_predicted_supply_current(motor, 12.0, odd, 12.0, 40.0)));
    EXPECT_TRUE(std::isfinite(limit_predicted_supply_current(motor, 12.0, 100.0, odd, 40.0)));
    EXPECT_TRUE(std::isfinite(limit_predicted_supply_current(motor, 12.0, 100.0, 12.0, odd)));
    EXPECT_TRUE(std::isfinite(limit_measured_supply_current(motor, 12.0, odd, odd, 12.0, 40.0)));
  }
}

// 100 ms above 40 A pass at up to 80 A, then 40 A until the current is below 38 A.
// A lost sample is no current of zero: what has been counted stays, and a limit that holds goes on.
TEST(PeakCurrentLimit, ALostSampleChangesNothing) {
  for (const double lost : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1.7e308}) {
    PeakCurrentLimit limit(40.0, 60.0, 0.5, 0.02);
    for (int k = 0; k < 30; ++k) {
      limit.update(55.0);
      limit.update(lost);
    }
    EXPECT_EQ(limit.limit(), 40.0) << lost;
    EXPECT_EQ(limit.update(lost), 40.0) << lost;
    EXPECT_EQ(limit.update(0.0), 60.0) << lost;
  }
}

TEST(PeakCurrentLimit, LetsAPeakPass) {
  PeakCurrentLimit limit(40.0, 80.0, 0.1, 0.02);
  EXPECT_EQ(limit.limit(), 80.0);
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(limit.update(-75.0), 80.0) << k;
  }
  EXPECT_EQ(limit.update(75.0), 40.0);
  EXPECT_EQ(limit.update(40.0), 40.0);
  EXPECT_EQ(limit.update(39.0), 40.0);
  EXPECT_EQ(limit.update(37.0), 80.0);
  EXPECT_EQ(limit.update(std::numeric_limits<double>::quiet_NaN()), 80.0);
  PeakCurrentLimit none(40.0, 10.0, 0.1, 0.02);  // a peak below it is it
  EXPECT_EQ(none.limit(), 40.0);
}

}  // namespace
}  // namespace flyball::mechanisms::motor_power_test
