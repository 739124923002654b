#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/planning/profiles/exponential_profile.hpp>
#include <flyball/planning/profiles/minimum_jerk_profile.hpp>
#include <flyball/planning/profiles/parabolic_profile.hpp>

#include "planning/profiles/fastest_duration.hpp"
#include "planning/profiles/profile_laws.hpp"
#include "support/allocation_count.hpp"

namespace flyball::other_profiles_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
const double nan = std::numeric_limits<double>::quiet_NaN();

MotorMotionLimits random_motor(Random& random) {
  MotorMotionLimits motor{.kV = std::exp(random.uniform(-1.0, 3.0)),
                          .kA = std::exp(random.uniform(-4.0, 1.0)),
                          .voltage = 12.0};
  if (random.uniform() < 0.5) {
    motor.kS = random.uniform(0.0, 1.0);
    motor.kG = random.uniform(-3.0, 3.0);
  }
  if (random.uniform() < 0.5) {
    motor.current_voltage = random.uniform(5.0, 20.0);
  }
  if (random.uniform() < 0.5) {
    motor.velocity = random.uniform(0.1, 0.9) * 8.0 / motor.kV;
  }
  return motor;
}

// From rest for t at full voltage: v = V/kV (1 - e^(-t kV/kA)).
TEST(ExponentialProfile, IsTheMotorsOwnStepResponse) {
  const MotorMotionLimits motor{.kV = 2.0, .kA = 0.5, .voltage = 10.0};
  const ExponentialProfile profile(motor, {}, {40.0});
  const double t = 0.6;
  const double gone = 1.0 - std::exp(-t * 4.0);
  EXPECT_NEAR(profile.sample(t).velocity, 5.0 * gone, 1e-12);
  EXPECT_NEAR(profile.sample(t).position, 5.0 * (t - 0.25 * gone), 1e-12);
  EXPECT_NEAR(profile.sample(t).acceleration, 20.0 * (1.0 - gone), 1e-11);
  // Braking from the top speed, at twice the voltage: ln 2 · kA/kV of time.
  EXPECT_NEAR(profile.sample(profile.total_time() - 0.25 * std::log(2.0)).velocity, 5.0, 1e-6);
}

// Everywhere the voltage and the current that it takes are there, and one of them is used up, or
// the velocity is at its limit: there is no faster motion.
TEST(ExponentialProfile, UsesWhatTheMotorHas) {
  Random random(31);
  for (int trial = 0; trial < 5000; ++trial) {
    const MotorMotionLimits motor = random_motor(random);
    const double top = std::min(motor.velocity, 8.0 / motor.kV);
    const MotionState start{random.normal(), random.uniform(-1.0, 1.0) * top};
    const MotionState goal{random.normal() * 3.0,
                           trial % 2 == 0 ? 0.0 : random.uniform(-1.0, 1.0) * top};
    const ExponentialProfile profile(motor, start, goal);
    test::ProfileDemand demand;
    demand.start = start;
    demand.goal = goal;
    // At speed it brakes harder than it accelerates from rest.
    const double most = (2.0 * motor.voltage + 4.0) / motor.kA;
    demand.limits = {std::max(profile.limits().velocity, profile.limits().reverse_velocity), most};
    ASSERT_EQ(test::broken_law(profile, demand), "") << trial;
    const double end = profile.total_time();
    for (int k = 1; k < 40; ++k) {
      const MotionState at = profile.sample(end * k / 40.0);
      const double friction = at.velocity > 0.0 ? motor.kS : at.velocity < 0.0 ? -motor.kS : 0.0;
      const double volts =
          motor.kA * at.acceleration + motor.kV * at.velocity + friction + motor.kG;
      const double current = volts - motor.kV * at.velocity;
      ASSERT_LE(std::abs(volts), motor.voltage * (1.0 + 1e-9));
      ASSERT_LE(std::abs(current), motor.current_voltage * (1.0 + 1e-9));
      const bool full = std::abs(volts) > motor.voltage * (1.0 - 1e-7) ||
                        std::abs(current) > motor.current_voltage * (1.0 - 1e-7);
      const double limit =
          at.velocity > 0.0 ? profile.limits().velocity : profile.limits().reverse_velocity;
      ASSERT_TRUE(full || std::abs(at.velocity) > limit * (1.0 - 1e-7)) << trial << ' ' << k;
    }
  }
}

// No duration is shorter, by bisection over the velocity between full effort up and down.
TEST(ExponentialProfile, IsTheFastest) {
  Random random(35);
  for (int trial = 0; trial < 2000; ++trial) {
    const MotorMotionLimits motor = random_motor(random);
    const double top = std::min(motor.velocity, 8.0 / motor.kV);
    const MotionState start{random.normal(), random.uniform(-2.0, 2.0) * top};
    const MotionState goal{random.normal() * 3.0, random.uniform(-1.0, 1.0) * top};
    const ExponentialProfile profile(motor, start, goal);
    constexpr double nearly = 1.0 - 1e-9;  // of the top speed
    const double high =
        std::min(motor.velocity, nearly * (motor.voltage - motor.kS - motor.kG) / motor.kV);
    const double low =
        std::min(motor.velocity, nearly * (motor.voltage - motor.kS + motor.kG) / motor.kV);
    ASSERT_EQ(test::broken_optimality(profile.total_time(), test::MotorEffort{motor}, high, low,
                                      start, goal),
              "")
        << trial;
  }
}

// The same motor as a trapezoid that it can follow everywhere needs longer.
TEST(ExponentialProfile, BeatsEveryTrapezoidOfItsMotor) {
  const MotorMotionLimits motor{.kV = 4.0, .kA = 0.4, .voltage = 12.0, .kS = 0.3, .kG = 0.8};
  const double best = ExponentialProfile(motor, {}, {2.0}).total_time();
  for (int i = 1; i < 100; ++i) {
    const double v = i / 100.0 * motor.most(0.0) / motor.kV * motor.kA;
    const double a = motor.most(v);
    if (a > 0.0) {
      EXPECT_LT(best, TrapezoidProfile({v, a}, {}, {2.0}).total_time()) << v;
    }
  }
}

TEST(ParabolicProfile, AcceleratesLeastWhereItIsFastest) {
  // To 4 with a = 2: T = 2 v/a = 4 s and 2/3 v T = 32/3 each way.
  const ParabolicProfile profile({.velocity = 4.0, .acceleration = 2.0}, {}, {30.0});
  EXPECT_NEAR(profile.total_time(), 8.0 + (30.0 - 64.0 / 3.0) / 4.0, 1e-12);
  for (const double t : {0.0, 1.0, 2.0, 3.9}) {
    const MotionState at = profile.sample(t);
    EXPECT_NEAR(at.velocity, 4.0 * (1.0 - (1.0 - t / 4.0) * (1.0 - t / 4.0)), 1e-12);
    EXPECT_NEAR(at.acceleration, 2.0 * std::sqrt(1.0 - at.velocity / 4.0), 1e-7);
  }
}

TEST(ParabolicProfile, KeepsTheLaws) {
  Random random(32);
  for (int trial = 0; trial < 10000; ++trial) {
    test::ProfileDemand demand = test::random_demand(random, 2, trial % 2 == 1);
    demand.limits = {demand.limits.velocity, demand.limits.acceleration};
    const double V = demand.limits.velocity;
    demand.goal.velocity = std::clamp(demand.goal.velocity, -V, V);
    demand.replan = false;
    const ParabolicProfile profile(demand.limits, demand.start, demand.goal);
    ASSERT_EQ(test::broken_law(profile, demand), "") << trial;
    for (int k = 1; k < 20; ++k) {
      const MotionState at = profile.sample(profile.total_time() * k / 20.0);
      if (std::abs(at.velocity) <= V) {
        const double most = demand.limits.acceleration * std::sqrt(1.0 - std::abs(at.velocity) / V);
        ASSERT_LE(std::abs(at.acceleration), most + 1e-6 * demand.limits.acceleration) << trial;
      }
    }
  }
}

TEST(ParabolicProfile, IsTheFastest) {
  Random random(36);
  for (int trial = 0; trial < 2000; ++trial) {
    const test::ProfileDemand demand = test::random_demand(random, 2, trial % 2 == 0);
    const double V = demand.limits.velocity;
    const double A = demand.limits.acceleration;
    MotionState goal = demand.goal;
    goal.velocity = std::clamp(goal.velocity, -V, V);
    ASSERT_EQ(test::broken_optimality(ParabolicProfile({V, A}, demand.start, goal).total_time(),
                                      test::ParabolicEffort{V, A}, V, V, demand.start, goal),
              "")
        << trial;
  }
}

TEST(StepperProfile, JumpsOverTheSlowSpeeds) {
  // 1 at once, up to 3 with a = 2 in 1 s over 2, down the same, the rest of 10 at 3.
  const StepperProfile profile({.velocity = 3.0, .acceleration = 2.0}, 1.0, {}, {10.0});
  EXPECT_NEAR(profile.total_time(), 1.0 + 2.0 + 1.0, 1e-12);
  EXPECT_EQ(profile.sample(-0.1).velocity, 0.0);
  EXPECT_EQ(profile.sample(0.0).velocity, 1.0);
  EXPECT_NEAR(profile.sample(profile.total_time() - 1e-9).velocity, 1.0, 1e-7);
  EXPECT_EQ(profile.sample(profile.total_time()).velocity, 0.0);
  EXPECT_EQ(profile.sample(99.0).position, 10.0);
  // Backwards the jump is backwards; nowhere to go is no jump; a moving start keeps its velocity.
  EXPECT_EQ(StepperProfile({3.0, 2.0}, 1.0, {10.0}, {}).sample(0.0).velocity, -1.0);
  EXPECT_EQ(StepperProfile({3.0, 2.0}, 1.0, {}, {}).total_time(), 0.0);
  EXPECT_EQ(StepperProfile({3.0, 2.0}, 1.0, {0.0, 2.0}, {10.0}).sample(0.0).velocity, 2.0);
}

// Rest to rest over d = 2: v 1.875 d/T, a 10/√3 d/T², j 60 d/T³; whichever binds.
TEST(MinimumJerkProfile, RestToRest) {
  const MinimumJerkProfile by_velocity({.velocity = 0.5, .acceleration = 50.0}, {}, {2.0});
  EXPECT_NEAR(by_velocity.total_time(), 7.5, 1e-7);
  const MinimumJerkProfile by_acceleration({.velocity = 50.0, .acceleration = 0.5}, {}, {2.0});
  EXPECT_NEAR(by_acceleration.total_time(), std::sqrt(40.0 / std::sqrt(3.0)), 1e-7);
  const MinimumJerkProfile by_jerk({.velocity = 50.0, .acceleration = 50.0, .jerk = 15.0}, {},
                                   {2.0});
  EXPECT_NEAR(by_jerk.total_time(), 2.0, 1e-7);
  // 10 s³ - 15 s⁴ + 6 s⁵ at a half.
  EXPECT_NEAR(by_jerk.sample(1.0).position, 1.0, 1e-8);
  EXPECT_NEAR(by_jerk.sample(0.5).position, 2.0 * (10.0 / 64.0 - 15.0 / 256.0 + 6.0 / 1024.0),
              1e-8);
  EXPECT_TRUE(by_jerk.reversible());
}

TEST(MinimumJerkProfile, KeepsTheLaws) {
  Random random(33);
  int kept = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    test::ProfileDemand demand = test::random_demand(random, 3, false);
    demand.replan = false;
    if (trial % 2 == 0) {
      demand.start = {demand.start.position};
      demand.goal = {demand.goal.position};
    }
    const MinimumJerkProfile profile(demand.limits, demand.start, demand.goal);
    if (profile.keeps_limits()) {
      ++kept;
      ASSERT_EQ(test::broken_law(profile, demand), "") << trial;
    } else {
      ASSERT_NE(trial % 2, 0) << "rest to rest can be kept";
    }
  }
  EXPECT_GT(kept, 600);
}

// Ends 0.8 µm apart, which the rounding of their places would make a jerk of its own in 7 µs.
TEST(MinimumJerkProfile, KeepsItsJerkOverAMicrometre) {
  const MotionLimits limits{0.11408607222110141, 2.3127589835416189, 1.6619124155903815,
                            0.13766880189669459, 0.60343794390985039};
  test::ProfileDemand demand{limits,
                             {-0.048125197073686912, 0.11408607222110141, 0.0},
                             {-0.048124378817777071, 0.11408607222110141, 0.0}};
  demand.order = 3;
  demand.replan = false;
  const MinimumJerkProfile profile(limits, demand.start, demand.goal);
  EXPECT_TRUE(profile.keeps_limits());
  EXPECT_LT(profile.total_time(), 1e-5);
  EXPECT_EQ(test::broken_law(profile, demand), "");
}

// No shorter duration keeps the limits, be it below a gap of durations that do not.
TEST(MinimumJerkProfile, IsTheShortest) {
  Random random(37);
  int kept = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const test::ProfileDemand demand = test::random_demand(random, 3, false);
    const MinimumJerkProfile profile(demand.limits, demand.start, demand.goal);
    if (profile.keeps_limits() && profile.total_time() > 0.0) {
      ++kept;
      ASSERT_EQ(test::shorter_polynomial(profile, demand, 30), "") << trial;
    }
  }
  EXPECT_GT(kept, 200);
  // From a velocity back to the same place with the same velocity, with another acceleration, it
  // goes round: no bound of the duration is above zero, and there is one that keeps the limits.
  const MinimumJerkProfile round({2.0, 3.0, 0.0, 0.0, 20.0}, {0.0, 0.4, 0.0}, {0.0, 0.4, 0.1});
  EXPECT_TRUE(round.keeps_limits());
  EXPECT_GT(round.total_time(), 0.1);
}

TEST(MinimumJerkProfile, OfUnusableGoalsIsAtTheGoal) {
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    for (const MotionState& goal :
         {MotionState{bad, 0.0, 0.0}, MotionState{1.5, bad, 0.0}, MotionState{1.5, 0.0, bad}}) {
      const auto profile = MinimumJerkProfile::with_duration(1.0, {0.5, 0.0, 0.0}, goal);
      for (const double t : {-1.0, 0.0, 0.5, 1.0, 1e300}) {
        const MotionState at = profile.sample(t);
        EXPECT_EQ(at.position, std::isfinite(goal.position) ? goal.position : 0.0);
        EXPECT_EQ(at.velocity, 0.0);
        EXPECT_EQ(at.acceleration, 0.0);
      }
    }
  }
}

// Of all motions that take its time it has the least ∫ jerk²: adding s³(1-s)³ times anything, which
// changes no end, makes it more.
TEST(MinimumJerkProfile, HasTheLeastJerk) {
  const MotionState start{0.3, -0.5, 1.0};
  const MotionState goal{1.2, 0.4, -0.7};
  const double T = 1.7;
  const MinimumJerkProfile profile = MinimumJerkProfile::with_duration(T, start, goal);
  EXPECT_NEAR(profile.sample(T * (1.0 - 1e-15)).acceleration, -0.7, 1e-9);
  const auto cost = [&](double size) {
    double sum = 0.0;
    constexpr int n = 20000;
    for (int k = 0; k < n; ++k) {
      const double s = (k + 0.5) / n;
      // (s³ - 3s⁴ + 3s⁵ - s⁶)''' / T³
      const double bump = (6.0 - 72.0 * s + 180.0 * s * s - 120.0 * s * s * s) / (T * T * T);
      const double j = profile.jerk(s * T) + size * bump;
      sum += j * j * T / n;
    }
    return sum;
  };
  const double least = cost(0.0);
  EXPECT_GT(cost(0.1), least);
  EXPECT_GT(cost(-0.1), least);
  // Stationary: both sides rise alike.
  EXPECT_NEAR(cost(0.1) - least, cost(-0.1) - least, 1e-4 * (cost(0.1) - least));
}

TEST(OtherProfiles, AreFiniteForAnything) {
  const double values[] = {0.0, 1.0, -2.0, 1e-300, 1e-29, 1e29, 1e300, -infinity, infinity, nan};
  const auto check = [](const auto& profile) {
    ASSERT_TRUE(std::isfinite(profile.total_time()));
    for (const double t : {0.0, 0.5, 1e10, infinity, nan, -1.0}) {
      const MotionState state = profile.sample(t);
      ASSERT_TRUE(std::isfinite(state.position) && std::isfinite(state.velocity) &&
                  std::isfinite(state.acceleration));
    }
  };
  for (const double a : values) {
    for (const double b : values) {
      for (const double c : values) {
        check(ExponentialProfile({.kV = a, .kA = b, .voltage = 12.0}, {c, 0.5}, {1.0, c}));
        check(ExponentialProfile({2.0, 0.5, 12.0, a, b, c, a}, {c, 0.5}, {1.0}));
        check(ParabolicProfile({a, b}, {c, 0.5}, {1.0, c}));
        check(StepperProfile({a, b}, c, {c, 0.5}, {1.0}));
        check(MinimumJerkProfile({a, b, 0.0, 0.0, c}, {c, 0.5, a}, {1.0, b}));
      }
    }
  }
}

TEST(OtherProfiles, AllocateNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (int i = 0; i < 20; ++i) {
    const MotionState start{0.1 * i, 0.2};
    sum += ExponentialProfile({2.0, 0.5, 12.0}, start, {3.0}).sample(0.5).position;
    sum += ParabolicProfile({1.0, 2.0}, start, {3.0}).sample(0.5).position;
    sum += StepperProfile({1.0, 2.0}, 0.1, start, {3.0}).sample(0.5).position;
    sum += MinimumJerkProfile({1.0, 2.0}, start, {3.0}).sample(0.5).position;
  }
  EXPECT_EQ(counter.count(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace flyball::other_profiles_test
