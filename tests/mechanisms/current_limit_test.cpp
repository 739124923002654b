#include <flyball/mechanisms/current_limit.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace flyball::mechanisms::current_limit_test {
namespace {

// 775pro at 500 rad/s, 40 A: I = 100.019 A at 12 V, limited to 6.6251 V; the book's snippet in
// NumPy 1.24.2: K_v = 18730 π/30/(12 - 0.7 R), R = 12/134.
TEST(CurrentLimit, IsTheBooksSnippet) {
  const DcMotor motor = vex_775pro();
  EXPECT_NEAR(motor.current(500.0, 12.0), 100.01918753740046, 1e-9);
  EXPECT_NEAR(limit_predicted_current(motor, 12.0, 500.0, 40.0), 6.625147384710406, 1e-12);
  // What is measured under 12 V at that speed tells the same.
  EXPECT_NEAR(limit_measured_current(motor, 12.0, 12.0, motor.current(500.0, 12.0), 40.0),
              6.625147384710406, 1e-12);
}

TEST(CurrentLimit, HoldsInBothDirectionsAndChangesNothingElse) {
  rc::check([] {
    const DcMotor motor = neo(*rc::gen::inRange(1, 4));
    const double omega = *rc::gen::inRange(-600, 601);
    const double voltage = 0.01 * *rc::gen::inRange(-1200, 1201);
    const double limit = *rc::gen::inRange(0, 200);
    const double limited = limit_predicted_current(motor, voltage, omega, limit);
    const double wanted = motor.current(omega, voltage);
    const double drawn = motor.current(omega, limited);
    RC_ASSERT(std::abs(drawn) <= limit + 1e-9);
    if (std::abs(wanted) <= limit) {
      RC_ASSERT(limited == voltage);
    } else {
      RC_ASSERT(std::abs(drawn - std::copysign(limit, wanted)) < 1e-9 * (1.0 + limit));
    }
  });
}

TEST(CurrentLimit, IsFiniteWhateverComes) {
  const DcMotor motor = neo();
  for (const double odd : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(), -1e300}) {
    EXPECT_TRUE(std::isfinite(limit_predicted_current(motor, odd, 100.0, 40.0)));
    EXPECT_TRUE(std::isfinite(limit_predicted_current(motor, 12.0, odd, 40.0)));
    EXPECT_TRUE(std::isfinite(limit_predicted_current(motor, 12.0, 100.0, odd)));
    EXPECT_TRUE(std::isfinite(limit_measured_current(motor, 12.0, odd, odd, 40.0)));
  }
}

}  // namespace
}  // namespace flyball::mechanisms::current_limit_test
