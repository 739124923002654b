// What every profile does at the edges of its interface: whatever the numbers, it answers, is
// finite, and either goes from its start to its goal or stands at the goal from the start.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/planning/profiles/exponential_profile.hpp>
#include <flyball/planning/profiles/minimum_jerk_profile.hpp>
#include <flyball/planning/profiles/parabolic_profile.hpp>
#include <flyball/planning/profiles/s_curve_profile.hpp>
#include <flyball/planning/profiles/synchronized_motion.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

namespace flyball::profile_edges_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
const double nan = std::numeric_limits<double>::quiet_NaN();

bool is_finite(const MotionState& s) {
  return std::isfinite(s.position) && std::isfinite(s.velocity) && std::isfinite(s.acceleration);
}

/// What of the interface is broken, in words.
/// @param jumps  It may start with a jump of the velocity.
template <MotionProfile Profile>
std::string broken_edge(const Profile& profile, const MotionState& start, const MotionState& goal,
                        bool jumps) {
  const double end = profile.total_time();
  if (!(end >= 0.0) || !std::isfinite(end)) {
    return "its duration";
  }
  if (profile.remaining_time(-1.0) != end || profile.remaining_time(0.0) != end ||
      profile.remaining_time(end) != 0.0 || profile.remaining_time(infinity) != 0.0 ||
      !(profile.remaining_time(nan) >= 0.0)) {
    return "the time that remains";
  }
  for (const double t :
       {-infinity, -1.0, 0.0, 1e-300, 0.3 * end, end, 2.0 * end, 1e300, infinity, nan}) {
    if (!is_finite(profile.sample(t))) {
      return "a sample is not finite";
    }
  }
  // A profile that takes no time is at its start, which is the goal but for rounding.
  const double rounding =
      end > 0.0 ? 0.0 : 1e-14 * (std::abs(start.position) + std::abs(goal.position));
  if (std::isfinite(start.position) && std::isfinite(goal.position) &&
      !(std::abs(profile.sample(end).position - goal.position) <= rounding)) {
    return "it does not end at its goal";
  }
  if (end > 0.0) {
    const MotionState first = profile.sample(0.0);
    const MotionState before = profile.sample(-1.0);
    // The parabola's times, and so its velocities, are as fine as its limit's.
    const double v = std::isfinite(profile.limits().velocity) ? profile.limits().velocity : 0.0;
    if (first.position != start.position || before.position != start.position ||
        (!jumps && !(std::abs(first.velocity - start.velocity) <= 1e-14 * std::max(1.0, v)))) {
      return "it does not begin at its start";
    }
  }
  static_cast<void>(profile.reversible());
  const Profile again = profile.replanned(profile.sample(0.5 * end), goal);
  if (!std::isfinite(again.total_time()) || !is_finite(again.sample(0.5 * again.total_time()))) {
    return "planned anew on the way it is not finite";
  }
  return {};
}

struct Demand {
  MotionLimits limits{};
  MotionState start{};
  MotionState goal{};
};

/// The first edge that a profile of a demand breaks, with its name.
std::string broken_edges(const Demand& d) {
  const MotionLimits& l = d.limits;
  const auto named = [](const char* name, const std::string& broken) {
    return broken.empty() ? broken : name + (": " + broken);
  };
  std::string all =
      named("trapezoid", broken_edge(TrapezoidProfile(l, d.start, d.goal), d.start, d.goal, false));
  all += named("s-curve", broken_edge(SCurveProfile(l, d.start, d.goal), d.start, d.goal, false));
  all +=
      named("parabolic", broken_edge(ParabolicProfile(l, d.start, d.goal), d.start, d.goal, false));
  all += named("stepper",
               broken_edge(StepperProfile(l, l.jerk, d.start, d.goal), d.start, d.goal, true));
  all += named("minimum jerk",
               broken_edge(MinimumJerkProfile(l, d.start, d.goal), d.start, d.goal, false));
  const MotorMotionLimits motor{.kV = l.velocity,
                                .kA = l.acceleration,
                                .voltage = 12.0,
                                .kS = l.deceleration,
                                .kG = l.reverse_velocity,
                                .current_voltage = l.jerk};
  return all + named("exponential", broken_edge(ExponentialProfile(motor, d.start, d.goal), d.start,
                                                d.goal, false));
}

std::string words(const Demand& d) {
  const MotionLimits& l = d.limits;
  char text[500];
  std::snprintf(text, sizeof text,
                "limits %.17g, %.17g, %.17g, %.17g, %.17g, from %.17g, %.17g, %.17g to %.17g, "
                "%.17g, %.17g",
                l.velocity, l.acceleration, l.deceleration, l.reverse_velocity, l.jerk,
                d.start.position, d.start.velocity, d.start.acceleration, d.goal.position,
                d.goal.velocity, d.goal.acceleration);
  return text;
}

// Each limit is once zero, negative, not a number, infinite, huge and tiny, and so is each state.
TEST(ProfileEdges, OneBadNumberAtATime) {
  const double bad[] = {0.0, -1.0, nan, infinity, -infinity, 1e300, 1e-300, -1e300, 1e99, 1e-99};
  for (const bool moving : {false, true}) {
    for (int field = 0; field < 11; ++field) {
      for (const double value : bad) {
        Demand d{{2.0, 3.0, 0.0, 0.0, 20.0}, {0.5, 0.0, 0.0}, {1.5, 0.0, 0.0}};
        if (moving) {
          d = {{2.0, 3.0, 1.0, 1.5, 20.0}, {0.5, -0.7, 0.2}, {1.5, 0.3, -0.1}};
        }
        double* const fields[] = {
            &d.limits.velocity,         &d.limits.acceleration, &d.limits.deceleration,
            &d.limits.reverse_velocity, &d.limits.jerk,         &d.start.position,
            &d.start.velocity,          &d.start.acceleration,  &d.goal.position,
            &d.goal.velocity,           &d.goal.acceleration};
        *fields[field] = value;
        ASSERT_EQ(broken_edges(d), "") << words(d);
      }
    }
  }
}

// A current that leaves next to no torque, and velocities far beyond what the limits brake in the
// time that there are numbers for: a duration is finite, and none is below zero.
TEST(ProfileEdges, ForcesOfNextToNothing) {
  const MotorMotionLimits motor{.kV = 2.0, .kA = 0.3, .voltage = 12.0};
  for (const double left : {5e-324, 1e-310, 1e-300, 1e-100, 1e-31, 1e-29, 1e-3}) {
    for (const double velocity : {-2.0, 1e20, -1e30, 0.0}) {
      MotorMotionLimits weak = motor;
      weak.current_voltage = left;
      const MotionState still{0.0, 0.0, 0.0};
      const MotionState moving{1.0, velocity, 0.0};
      ASSERT_EQ(broken_edge(ExponentialProfile(weak, still, moving), still, moving, true), "")
          << left << " to " << velocity;
      ASSERT_EQ(broken_edge(ExponentialProfile(weak, moving, still), moving, still, true), "")
          << left << " from " << velocity;
      // The same from what friction leaves of the battery.
      MotorMotionLimits held = motor;
      held.kS = std::nextafter(12.0, 0.0);
      held.voltage = 12.0;
      ASSERT_EQ(broken_edge(ExponentialProfile(held, moving, still), moving, still, true), "");
    }
  }
  const Demand demands[] = {
      {{2.0, 5.0, 1e-50, 1e-100, 50.0}, {5e-324, 1e100, 0.0}, {-2.0, 0.0, 0.0}},
      {{1e300, 1e-100, 0.0, 1e-100, 50.0}, {0.0, 1e100, 0.0}, {1e30, 0.0, 0.0}},
      {{2.0, 5.0, 1e-20, 0.0, 1e-30}, {0.0, 0.0, 1e30}, {1.0, 0.0, 1e-30}},
  };
  for (const Demand& d : demands) {
    EXPECT_EQ(broken_edges(d), "") << words(d);
  }
  // A way and a velocity whose squares are no numbers.
  const MotionLimits slow{0.5, 1e-20, 1e-50, 1e20};
  EXPECT_GE(TrapezoidProfile(slow, {}, {1e-300, 1e-300, 0.0}).total_time(), 0.0);
  const MotionLimits slower{2.0, 5.0, 1e-100};
  EXPECT_GE(TrapezoidProfile(slower, {}, {1e-310, 5e-324, 0.0}).total_time(), 0.0);
}

// The two extremes of the palette in any place of any profile, the motor's numbers among them.
TEST(ProfileEdges, FiniteForFinite) {
  const double values[] = {1.7e308, -1.7e308, 1e154, 1e100, 1e70,   1e50,     1e30,   1e20,
                           1e-20,   1e-30,    1e-50, 1e-70, 1e-100, 1e-310,   5e-324, 0.0,
                           -0.0,    1.0,      -2.0,  12.0,  0.5,    infinity, nan,    -infinity};
  constexpr double count = 24.0;
  Random random(18);
  for (int trial = 0; trial < 30000; ++trial) {
    const double share = trial % 3 == 0 ? 0.1 : trial % 3 == 1 ? 0.3 : 0.7;
    const auto pick = [&](double usual) {
      return random.uniform() < share ? values[static_cast<std::size_t>(random.uniform(0.0, count))]
                                      : usual;
    };
    const MotorMotionLimits motor{.kV = pick(2.0),
                                  .kA = pick(0.3),
                                  .voltage = pick(12.0),
                                  .kS = pick(0.1),
                                  .kG = pick(0.5),
                                  .current_voltage = pick(10.0),
                                  .velocity = pick(5.0)};
    const Demand d{{pick(2.0), pick(5.0), pick(0.0), pick(0.0), pick(50.0)},
                   {pick(0.0), pick(0.0), pick(0.0)},
                   {pick(1.0), pick(0.0), pick(0.0)}};
    const auto finite = [](const auto& profile) {
      const double end = profile.total_time();
      return end >= 0.0 && std::isfinite(end) && std::isfinite(profile.remaining_time(0.3 * end)) &&
             is_finite(profile.sample(0.3 * end)) && is_finite(profile.sample(end)) &&
             is_finite(profile.sample(1e9));
    };
    ASSERT_TRUE(finite(ExponentialProfile(motor, d.start, d.goal)))
        << words(d) << "; motor " << motor.kV << ", " << motor.kA << ", " << motor.voltage << ", "
        << motor.kS << ", " << motor.kG << ", " << motor.current_voltage << ", " << motor.velocity;
    ASSERT_TRUE(finite(TrapezoidProfile(d.limits, d.start, d.goal))) << words(d);
    ASSERT_TRUE(finite(SCurveProfile(d.limits, d.start, d.goal))) << words(d);
    ASSERT_TRUE(
        finite(SCurveProfile::to_velocity(d.limits, d.start, d.goal.velocity, d.goal.acceleration)))
        << words(d);
    ASSERT_TRUE(finite(ParabolicProfile(d.limits, d.start, d.goal))) << words(d);
    ASSERT_TRUE(finite(StepperProfile(d.limits, pick(0.1), d.start, d.goal))) << words(d);
    ASSERT_TRUE(finite(MinimumJerkProfile(d.limits, d.start, d.goal))) << words(d);
    const auto how = static_cast<Synchronization>(trial % 2);
    const SynchronizedMotion<2> both({d.limits, {2.0, 5.0, 0.0, 0.0, 50.0}},
                                     {d.start, MotionState{}}, {d.goal, MotionState{pick(1.0)}},
                                     how, pick(0.0));
    const double end = both.total_time();
    ASSERT_TRUE(end >= 0.0 && std::isfinite(both.remaining_time(0.3 * end))) << words(d);
    for (const MotionState& s : both.sample(0.3 * end)) {
      ASSERT_TRUE(is_finite(s)) << words(d);
    }
  }
}

TEST(ProfileEdges, AnyMixture) {
  const double values[] = {0.0,    1.0,   -2.0,  0.3,    1e-30,    1e30, 1e-15,  1e15,
                           1e-100, 1e100, 1e300, 1e-300, infinity, nan,  -1e300, 5.0};
  Random random(17);
  const auto pick = [&](double usual) {
    return random.uniform() < 0.6 ? usual * (1.0 + random.uniform())
                                  : values[static_cast<std::size_t>(random.uniform(0.0, 16.0))];
  };
  for (int trial = 0; trial < 20000; ++trial) {
    Demand d;
    d.limits = {pick(1.0), pick(2.0), pick(0.5), pick(1.5), pick(9.0)};
    d.start = {pick(0.0), pick(0.5), pick(0.3)};
    d.goal = {pick(1.0), pick(-0.2), pick(0.1)};
    ASSERT_EQ(broken_edges(d), "") << words(d);
  }
}

// Nothing to do takes no time; a goal that moves and is just here is come to, however long that is.
TEST(ProfileEdges, NoDistance) {
  const MotionLimits limits{2.0, 3.0, 0.0, 0.0, 20.0};
  const MotorMotionLimits motor{.kV = 4.0, .kA = 0.4, .voltage = 12.0};
  const MotionState here{0.7};
  EXPECT_EQ(TrapezoidProfile(limits, here, here).total_time(), 0.0);
  EXPECT_EQ(SCurveProfile(limits, here, here).total_time(), 0.0);
  EXPECT_EQ(ParabolicProfile(limits, here, here).total_time(), 0.0);
  EXPECT_EQ(StepperProfile(limits, 0.1, here, here).total_time(), 0.0);
  EXPECT_EQ(MinimumJerkProfile(limits, here, here).total_time(), 0.0);
  EXPECT_EQ(ExponentialProfile(motor, here, here).total_time(), 0.0);
  // Moving on with the same velocity it is already there.
  const MotionState moving{0.7, 0.4};
  EXPECT_EQ(TrapezoidProfile(limits, moving, moving).total_time(), 0.0);
  EXPECT_EQ(SCurveProfile(limits, moving, moving).total_time(), 0.0);
  EXPECT_EQ(ParabolicProfile(limits, moving, moving).total_time(), 0.0);
  EXPECT_EQ(ExponentialProfile(motor, moving, moving).total_time(), 0.0);
  EXPECT_EQ(MinimumJerkProfile(limits, moving, moving).total_time(), 0.0);
  // To the same place with the opposite velocity: to zero and back, 2 v/a.
  const MotionState back{0.7, -0.4};
  EXPECT_NEAR(TrapezoidProfile(limits, moving, back).total_time(), 0.8 / 3.0, 1e-15);
  EXPECT_EQ(TrapezoidProfile(limits, moving, back).sample(0.4 / 3.0).velocity, 0.0);
}

// Without a limit of the velocity there is no cruise: half of the way up, half of it down.
TEST(ProfileEdges, NoLimitOfTheVelocity) {
  for (const MotionLimits& limits : {MotionLimits{infinity, 2.0}, MotionLimits{1e200, 2.0}}) {
    const TrapezoidProfile trapezoid(limits, {}, {8.0});
    EXPECT_NEAR(trapezoid.total_time(), 4.0, 1e-14);
    EXPECT_NEAR(trapezoid.sample(2.0).velocity, 4.0, 1e-14);
    EXPECT_EQ(trapezoid.limits().velocity, limits.velocity);
    EXPECT_NEAR(SCurveProfile(limits, {}, {8.0}).total_time(), 4.0, 1e-12);
  }
}

}  // namespace
}  // namespace flyball::profile_edges_test
