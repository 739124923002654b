#include <flyball/mechanisms/battery.hpp>

#include <gtest/gtest.h>

namespace flyball::mechanisms::battery_test {
namespace {

// Stalled at full duty the battery's and the motor's resistances divide the voltage:
// 12·0.06/(0.06 + 0.02) = 9 V, and 150 A flow.
TEST(Battery, DividesTheVoltageAtStall) {
  const Battery battery{.open_circuit_voltage = 12.0, .resistance = 0.02};
  EXPECT_DOUBLE_EQ(battery.rail_voltage(1.0, 0.0, 0.06), 9.0);
  EXPECT_DOUBLE_EQ(battery.rail_voltage(-1.0, 0.0, 0.06), 9.0);
}

// It satisfies V = V_open - R_b D (D V - e)/R.
TEST(Battery, SatisfiesItsEquation) {
  const Battery battery{.open_circuit_voltage = 12.6, .resistance = 0.018, .other_current = 4.0};
  for (const double duty : {-1.0, -0.3, 0.0, 0.5, 1.0}) {
    for (const double emf : {-6.0, 0.0, 8.0}) {
      const double rail = battery.rail_voltage(duty, emf, 0.05);
      const double current = duty * (duty * rail - emf) / 0.05;
      EXPECT_NEAR(rail, 12.6 - 0.018 * (current + 4.0), 1e-13);
    }
  }
}

TEST(Battery, DoesNotSagWithoutResistanceOrMotor) {
  EXPECT_EQ(Battery{}.rail_voltage(1.0, 0.0, 0.01), 12.0);
  EXPECT_EQ((Battery{.open_circuit_voltage = 12.0, .resistance = 0.1}.rail_voltage(1.0, 0.0)),
            12.0);
  EXPECT_EQ((Battery{.open_circuit_voltage = 12.0, .resistance = 1.0, .other_current = 100.0}
                 .rail_voltage(0.0, 0.0)),
            0.0);
}

}  // namespace
}  // namespace flyball::mechanisms::battery_test
