// A profile that jumps at its ends, and changes of a velocity by each kind of profile.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "planning/profiles/more_profile_laws.hpp"

namespace flyball::jumps_and_velocities_test {
namespace {

TEST(StepperProfile, KeepsTheLaws) {
  Random random(41);
  for (int trial = 0; trial < 20000; ++trial) {
    const test::ProfileDemand demand = test::random_demand(random, 2, trial % 2 == 1);
    const double jump = random.uniform() < 0.2 ? 0.0 : demand.limits.velocity * random.uniform();
    const StepperProfile profile(demand.limits, jump, demand.start, demand.goal);
    ASSERT_EQ(test::broken_law_of_jumps(profile, demand), "") << trial;
  }
}

// At 2 with 1 to brake by, 0.5 before the goal: it brakes over 2 and comes back 1.5, from -1 at the
// end, and not from +1, for which it would have to pass the goal again.
TEST(StepperProfile, ComesBackWithAJumpBackwards) {
  const StepperProfile profile({3.0, 1.0}, 1.0, {0.0, 2.0}, {0.5});
  const MotionState last = profile.sample(profile.total_time() * (1.0 - 1e-12));
  EXPECT_NEAR(last.velocity, -1.0, 1e-9);
  // 2 s to a stop at 2; back 1.5 up to c and down to 1: c² - (c² - 1)/2 ... c²/2 + (c² - 1)/2
  // = 1.5.
  const double c = std::sqrt(2.0);
  EXPECT_NEAR(profile.total_time(), 2.0 + c + (c - 1.0), 1e-12);
}

TEST(VelocityTargets, AreReachedStraight) {
  const MotionLimits limits{.velocity = 4.0, .acceleration = 2.0, .deceleration = 1.0};
  const TrapezoidProfile up = TrapezoidProfile::to_velocity(limits, {1.0, -1.0}, 3.0);
  EXPECT_EQ(up.total_time(), 2.0);
  EXPECT_EQ(up.goal().position, 1.0 + 2.0);
  EXPECT_EQ(up.sample(1.0).velocity, 1.0);
  EXPECT_EQ(up.sample(5.0).velocity, 3.0);
  EXPECT_EQ(TrapezoidProfile::to_velocity(limits, {0.0, 3.0}, 1.0).total_time(), 2.0);
  EXPECT_EQ(TrapezoidProfile::to_velocity(limits, {}, 9.0).goal().velocity, 4.0);  // cut
  EXPECT_EQ(TrapezoidProfile::to_velocity(limits, {7.0, 2.0}, 2.0).total_time(), 0.0);
  EXPECT_EQ(TrapezoidProfile::to_velocity(limits, {7.0, 2.0}, 2.0).goal().position, 7.0);
  // A motor from rest: v = V/kV (1 - e^(-t kV/kA)) is 2.5 of 5 after ln 2 / 4.
  const auto motor =
      ExponentialProfile::to_velocity({.kV = 2.0, .kA = 0.5, .voltage = 10.0}, {}, 2.5);
  EXPECT_NEAR(motor.total_time(), 0.25 * std::log(2.0), 1e-14);
  // A parabola to its top: T = 2 V/A.
  EXPECT_NEAR(ParabolicProfile::to_velocity({4.0, 2.0}, {}, 4.0).total_time(), 4.0, 1e-14);
  // Over the jump at once; within it at once altogether.
  const auto stepper = StepperProfile::to_velocity({4.0, 2.0}, 1.0, {}, 3.0);
  EXPECT_EQ(stepper.total_time(), 1.0);
  EXPECT_EQ(stepper.sample(0.0).velocity, 1.0);
  EXPECT_EQ(StepperProfile::to_velocity({4.0, 2.0}, 1.0, {}, -0.5).total_time(), 0.0);
  EXPECT_EQ(StepperProfile::to_velocity({4.0, 2.0}, 1.0, {}, -0.5).sample(0.0).velocity, -0.5);
}

TEST(VelocityTargets, KeepTheLaws) {
  Random random(42);
  for (int trial = 0; trial < 20000; ++trial) {
    const test::ProfileDemand demand = test::random_demand(random, 2, trial % 2 == 1);
    ASSERT_EQ(test::broken_law_of_velocity_targets(demand), "") << trial;
  }
}

TEST(VelocityTargets, AreFiniteForAnything) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const double values[] = {0.0, 1.0, -2.0, 1e-300, 1e-29, 1e29, 1e300, -infinity, infinity, nan};
  const auto check = [](const auto& profile) {
    ASSERT_TRUE(std::isfinite(profile.total_time()));
    for (const double t : {-1.0, 0.0, 0.5, 1e10, std::numeric_limits<double>::infinity()}) {
      const MotionState at = profile.sample(t);
      ASSERT_TRUE(std::isfinite(at.position) && std::isfinite(at.velocity) &&
                  std::isfinite(at.acceleration));
    }
  };
  for (const double a : values) {
    for (const double b : values) {
      for (const double c : values) {
        for (const double d : {0.0, 1.0, c}) {
          check(TrapezoidProfile::to_velocity({a, b}, {d, c}, d));
          check(TrapezoidProfile::to_velocity({a, b, c, d}, {0.5, d}, c));
          check(ParabolicProfile::to_velocity({a, b}, {d, c}, d));
          check(StepperProfile::to_velocity({a, b}, c, {0.5, d}, c));
          check(ExponentialProfile::to_velocity({.kV = a, .kA = b, .voltage = 12.0}, {d, c}, d));
          check(ExponentialProfile::to_velocity({2.0, 0.5, 12.0, a, b, c, a}, {c, d}, 1.0));
        }
      }
    }
  }
}

}  // namespace
}  // namespace flyball::jumps_and_velocities_test
