#include <flyball/control/state_feedback.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"

namespace flyball::state_feedback_test {
namespace {

using Scalar = Eigen::Matrix<double, 1, 1>;
constexpr double infinity = std::numeric_limits<double>::infinity();

StateFeedback<2, 1> feedback() {
  return {Eigen::RowVector2d(10.0, 2.0), Scalar(-12.0), Scalar(12.0)};
}

// u = 10·(1 - 0.5) + 2·(0 - 0.25) + 1 = 5.5
TEST(StateFeedback, IsK) {
  const auto u =
      feedback().calculate(Eigen::Vector2d(0.5, 0.25), Eigen::Vector2d(1.0, 0.0), Scalar(1.0));
  EXPECT_DOUBLE_EQ(u(0), 5.5);
  EXPECT_DOUBLE_EQ(feedback().calculate(Eigen::Vector2d(0.5, 0.25), Eigen::Vector2d(1.0, 0.0))(0),
                   4.5);
}

TEST(StateFeedback, KeepsTheLimits) {
  const Eigen::Vector2d zero = Eigen::Vector2d::Zero();
  EXPECT_EQ(feedback().calculate(zero, Eigen::Vector2d(9.0, 0.0))(0), 12.0);
  EXPECT_EQ(feedback().calculate(zero, Eigen::Vector2d(-9.0, 0.0))(0), -12.0);
  EXPECT_EQ(feedback().calculate(zero, Eigen::Vector2d(1e300, 1e300))(0), 12.0);
  EXPECT_EQ(feedback().calculate(zero, zero, Scalar(std::nan("")))(0), 0.0);
  const StateFeedback<1, 1> free(Scalar(1.0), Scalar(-infinity), Scalar(infinity));
  EXPECT_EQ(free.calculate(Scalar(0.0), Scalar(1e6))(0), 1e6);
  const StateFeedback<1, 1> positive(Scalar(1.0), Scalar(2.0), Scalar(5.0));
  EXPECT_EQ(positive.clamp(Scalar(std::nan("")))(0), 2.0);
}

// From 3.0 rad to -3.0 rad is 0.283 rad forwards, not 6 rad back.
TEST(StateFeedback, WrapsAnAngle) {
  auto arm = feedback();
  arm.set_angle(0, 2.0 * std::numbers::pi);
  arm.set_angle(7, 1.0);
  const auto u = arm.calculate(Eigen::Vector2d(3.0, 0.0), Eigen::Vector2d(-3.0, 0.0));
  EXPECT_NEAR(u(0), 10.0 * (2.0 * std::numbers::pi - 6.0), 1e-13);
}

TEST(StateFeedback, FixedIsDynamicAndAllocatesNothing) {
  const auto fixed = feedback();
  const StateFeedback<> dynamic(fixed.K(), fixed.u_min(), fixed.u_max());
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector2d x(random.normal(), random.normal());
    const Eigen::Vector2d r(random.normal(), random.normal());
    ASSERT_DOUBLE_EQ(fixed.calculate(x, r)(0), dynamic.calculate(x, r)(0));
  }
  if (test::counts_allocations()) {
    const test::AllocationCounter counter;
    EXPECT_TRUE(
        std::isfinite(fixed.calculate(Eigen::Vector2d(0.1, 0.2), Eigen::Vector2d(0.3, 0.4))(0)));
    EXPECT_EQ(counter.count(), 0u);
  }
}

// (6.23): 6 V of motor on a rail at 10 V needs the command 7.2 V of 12; and (6.24) undoes it.
TEST(VoltageCompensation, MakesUpForTheRail) {
  const VoltageCompensation compensation(12.0);
  EXPECT_DOUBLE_EQ(compensation.command(6.0, 10.0), 7.2);
  EXPECT_DOUBLE_EQ(compensation.motor_voltage(7.2, 10.0), 6.0);
  for (const double rail : {7.0, 9.5, 12.0, 13.2}) {
    for (const double voltage : {-5.0, 0.0, 3.0}) {
      EXPECT_NEAR(compensation.motor_voltage(compensation.command(voltage, rail), rail), voltage,
                  1e-14);
    }
  }
}

// There is no more than the rail: the command ends at the whole duty.
TEST(VoltageCompensation, EndsAtTheRail) {
  const VoltageCompensation compensation(12.0);
  EXPECT_EQ(compensation.command(11.0, 10.0), 12.0);
  EXPECT_EQ(compensation.command(-11.0, 10.0), -12.0);
  EXPECT_DOUBLE_EQ(compensation.motor_voltage(12.0, 10.0), 10.0);
}

TEST(VoltageCompensation, DoesNotBelieveABrokenSensor) {
  const VoltageCompensation compensation(12.0);
  for (const double rail : {0.0, -3.0, std::nan(""), infinity, 1e6}) {
    EXPECT_EQ(compensation.rail(rail), 12.0);
    EXPECT_DOUBLE_EQ(compensation.command(3.0, rail), 3.0);
  }
  EXPECT_DOUBLE_EQ(compensation.rail(1.0), 4.0);
}

}  // namespace
}  // namespace flyball::state_feedback_test
