#include <flyball/planning/profiles/s_curve_profile.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

#include "planning/profiles/profile_laws.hpp"
#include "support/allocation_count.hpp"

namespace flyball::s_curve_profile_test {
namespace {

// The book's Figure 15.2: v 7, a 3.5 within 1 s, over 50. T = d/v + v/a + a/j.
TEST(SCurveProfile, RestToRestWithAllSevenPhases) {
  const SCurveProfile profile({.velocity = 7.0, .acceleration = 3.5, .jerk = 3.5}, {}, {50.0});
  EXPECT_NEAR(profile.total_time(), 50.0 / 7.0 + 2.0 + 1.0, 1e-13);
  ASSERT_EQ(profile.pieces(), 7);
  const double jerks[7] = {3.5, 0.0, -3.5, 0.0, -3.5, 0.0, 3.5};
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(profile.piece(i).jerk, jerks[i]) << i;
  }
  EXPECT_NEAR(profile.sample(1.0).velocity, 1.75, 1e-14);  // j t²/2
  EXPECT_NEAR(profile.sample(2.0).velocity, 5.25, 1e-14);
  EXPECT_NEAR(profile.sample(3.0).velocity, 7.0, 1e-14);
  EXPECT_NEAR(profile.sample(5.0).position, 7.0 * 3.0 / 2.0 + 14.0, 1e-12);
  EXPECT_TRUE(profile.reversible());
}

// Without limits that bind, four phases of (d / 2j)^(1/3); twice the distance backwards.
TEST(SCurveProfile, JerkAlone) {
  const SCurveProfile there({.velocity = 100.0, .acceleration = 100.0, .jerk = 2.0}, {}, {4.0});
  EXPECT_NEAR(there.total_time(), 4.0, 1e-14);
  const SCurveProfile back({.velocity = 100.0, .acceleration = 100.0, .jerk = 2.0}, {4.0}, {-28.0});
  EXPECT_NEAR(back.total_time(), 8.0, 1e-14);
}

// With v_f = v_0 + a_0 t + j t²/2 and a_f = a_0 + j t one ramp is the way, and no ramp more.
TEST(SCurveProfile, ASingleRampIsASinglePiece) {
  const double j = 2.0;
  const double t = 0.7;
  const MotionState start{0.3, 0.2, 0.5};
  const MotionState goal{0.3 + 0.2 * t + 0.25 * t * t + j * t * t * t / 6.0,
                         0.2 + 0.5 * t + 0.5 * j * t * t, 0.5 + j * t};
  const SCurveProfile profile({.velocity = 5.0, .acceleration = 5.0, .jerk = j}, start, goal);
  EXPECT_EQ(profile.pieces(), 1);
  EXPECT_NEAR(profile.total_time(), t, 1e-14);
}

TEST(SCurveProfile, WithoutAJerkLimitItIsTheTrapezoid) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const test::ProfileDemand demand = test::random_demand(random, 2, trial % 2 == 1);
    const SCurveProfile profile(demand.limits, demand.start, demand.goal);
    const TrapezoidProfile trapezoid(demand.limits, demand.start, demand.goal);
    ASSERT_NEAR(profile.total_time(), trapezoid.total_time(), 1e-12 * trapezoid.total_time());
    for (const double part : {0.1, 0.4, 0.6, 0.95}) {
      const double t = part * trapezoid.total_time();
      ASSERT_NEAR(profile.sample(t).position, trapezoid.sample(t).position,
                  1e-9 * (1.0 + std::abs(trapezoid.sample(t).position)));
    }
  }
}

TEST(SCurveProfile, KeepsTheLaws) {
  Random random(15);
  for (const bool outside : {false, true}) {
    for (int trial = 0; trial < 20000; ++trial) {
      const test::ProfileDemand demand = test::random_demand(random, 3, outside);
      const SCurveProfile profile(demand.limits, demand.start, demand.goal);
      ASSERT_EQ(test::broken_law(profile, demand), "") << "trial " << trial;
    }
  }
}

// Durations of Ruckig 0.17.3 for random states within asymmetric limits; every second one short,
// where the acceleration need not cross zero.
TEST(SCurveProfile, TakesAsLongAsRuckigSays) {
  struct Case {
    MotionLimits limits;
    MotionState start;
    MotionState goal;
    double duration;
  };
  const Case cases[] = {
      {{1.452, 1.954, 2.778, 2.463, 2.034},
       {0.0, 0.246, -1.402},
       {-2.682, 1.158, 0.834},
       3.68296845224897},
      {{2.241, 1.613, 2.064, 1.195, 1.593},
       {0.0, 1.031, -0.217},
       {2.365, 2.221, 1.348},
       1.62194425280611},
      {{0.538, 2.569, 0.798, 1.672, 3.226},
       {0.0, 0.3, 0.882},
       {-2.485, -1.506, 0.018},
       3.63955237758371},
      {{1.209, 0.811, 2.394, 0.513, 4.89},
       {0.0, 0.262, -0.617},
       {-0.53, -0.288, 0.262},
       1.56165114464802},
      {{3.186, 1.036, 2.161, 3.134, 6.084},
       {0.0, -2.281, -1.481},
       {2.478, -0.926, 0.639},
       7.80629356206198},
      {{2.271, 2.052, 0.639, 0.544, 3.658},
       {0.0, 1.185, 0.734},
       {2.294, 1.255, 1.448},
       1.85820455423299},
      {{3.114, 0.999, 2.028, 1.665, 5.156},
       {0.0, -0.474, -1.016},
       {2.245, -1.559, 0.568},
       5.28977015397016},
      {{1.76, 2.003, 1.276, 2.943, 6.021},
       {0.0, -2.461, -0.181},
       {-2.234, -0.239, 0.578},
       1.48321496104152},
      {{1.759, 2.126, 1.689, 0.676, 2.285},
       {0.0, 0.387, 2.083},
       {-0.136, 0.498, 1.88},
       5.96499812547336},
      {{0.538, 2.911, 1.456, 1.371, 2.996},
       {0.0, -0.599, -0.944},
       {-1.524, -1.087, 0.04},
       1.3555334469496},
      {{0.716, 1.394, 2.008, 3.313, 4.268},
       {0.0, 0.333, 0.724},
       {-2.946, -0.081, -1.854},
       4.29498276826142},
      {{3.254, 1.638, 1.672, 0.683, 4.333},
       {0.0, 1.124, -0.031},
       {1.861, 0.433, -1.582},
       1.53041543247901},
      {{1.454, 0.945, 1.795, 2.714, 3.975},
       {0.0, -1.284, -1.18},
       {2.803, 0.212, 0.888},
       6.59078567194729},
      {{1.141, 0.724, 2.075, 1.773, 4.819},
       {0.0, 0.485, -1.287},
       {0.088, -0.981, -0.935},
       1.60776628735049},
      {{0.893, 3.178, 3.379, 1.71, 6.347},
       {0.0, -0.355, -1.819},
       {2.917, -1.216, 0.463},
       6.10224222944118},
      {{3.353, 1.945, 2.35, 1.928, 4.62},
       {0.0, 0.105, 1.291},
       {1.159, 0.559, -0.965},
       1.38195856444149},
  };
  for (const Case& c : cases) {
    EXPECT_NEAR(SCurveProfile(c.limits, c.start, c.goal).total_time(), c.duration,
                1e-9 * c.duration);
  }
}

// Any motion within the limits is a bound: its end is a goal that cannot be come to later.
TEST(SCurveProfile, NoRandomMotionIsFaster) {
  Random random(16);
  int moved = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const MotionLimits limits{random.uniform(0.5, 2.0), random.uniform(0.5, 2.0),
                              random.uniform(0.5, 2.0), random.uniform(0.5, 2.0),
                              random.uniform(0.5, 4.0)};
    const auto can_go_on = [&](const MotionState& s) {
      const double drift = 0.5 * s.acceleration * std::abs(s.acceleration) / limits.jerk;
      return s.velocity + drift <= limits.velocity &&
             s.velocity + drift >= -limits.reverse_velocity;
    };
    const MotionState start{0.0, random.uniform(-0.5, 0.5), random.uniform(-0.4, 0.4)};
    if (!can_go_on(start)) {
      continue;
    }
    MotionState at = start;
    double duration = 0.0;
    for (int piece = 0; piece < 6; ++piece) {
      const double j = limits.jerk * (random.uniform() < 0.5   ? random.uniform(-1.0, 1.0)
                                      : random.uniform() < 0.5 ? 1.0
                                                               : -1.0);
      const double h = random.uniform(0.0, 0.5);
      const MotionState next{
          at.position + (at.velocity + (0.5 * at.acceleration + j * h / 6.0) * h) * h,
          at.velocity + (at.acceleration + 0.5 * j * h) * h, at.acceleration + j * h};
      // Pieces that would leave the limits, or could not but leave them later, are left out. Where
      // both ends can be gone on from, what is between them keeps the limits.
      if (next.acceleration > limits.acceleration || next.acceleration < -limits.deceleration ||
          !can_go_on(next)) {
        continue;
      }
      at = next;
      duration += h;
    }
    const double drift = 0.5 * at.acceleration * std::abs(at.acceleration) / limits.jerk;
    if (duration == 0.0 || at.velocity - drift > limits.velocity ||
        at.velocity - drift < -limits.reverse_velocity) {
      continue;
    }
    ++moved;
    ASSERT_LE(SCurveProfile(limits, start, at).total_time(), duration * (1.0 + 1e-9)) << trial;
  }
  EXPECT_GT(moved, 10000);
}

// Brute force: a bang of each sign, with every pair of switching times on a grid, reaches some
// (p, v, a); a profile to there from the same start takes no longer, and less than 1e-9 less where
// the grid's motion is extreme (jerk +, -, +: the maximum principle).
TEST(SCurveProfile, ExtremeMotionsAreTheFastest) {
  const MotionLimits limits{.velocity = 50.0, .acceleration = 50.0, .jerk = 1.0};
  Random random(17);
  for (int trial = 0; trial < 2000; ++trial) {
    const MotionState start{0.0, random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
    MotionState at = start;
    double sign = trial % 2 == 0 ? 1.0 : -1.0;
    double duration = 0.0;
    for (int piece = 0; piece < 3; ++piece, sign = -sign) {
      const double h = random.uniform(0.0, 2.0);
      at = {at.position + (at.velocity + (0.5 * at.acceleration + sign * h / 6.0) * h) * h,
            at.velocity + (at.acceleration + 0.5 * sign * h) * h, at.acceleration + sign * h};
      duration += h;
    }
    const double found = SCurveProfile(limits, start, at).total_time();
    ASSERT_LE(found, duration * (1.0 + 1e-9));
    if (found < duration * (1.0 - 1e-9)) {
      // Another motion of the kind is faster: it must arrive too.
      const MotionState end = SCurveProfile(limits, start, at).sample(found * (1.0 - 1e-15));
      ASSERT_NEAR(end.position, at.position, 1e-9 * (1.0 + std::abs(at.position)));
      ASSERT_NEAR(end.velocity, at.velocity, 1e-9);
    }
  }
}

TEST(SCurveProfile, VelocityTargets) {
  const MotionLimits limits{.velocity = 10.0, .acceleration = 2.0, .jerk = 4.0};
  // 0 to 3: 0.5 s up to a = 2, which gains 0.5, 1 s of it, 0.5 s down.
  const SCurveProfile up = SCurveProfile::to_velocity(limits, {1.0}, 3.0);
  EXPECT_NEAR(up.total_time(), 2.0, 1e-14);
  EXPECT_NEAR(up.sample(1.0).velocity, 1.5, 1e-14);
  EXPECT_EQ(up.sample(3.0).velocity, 3.0);
  // The velocity is symmetric about the middle.
  EXPECT_NEAR(up.goal().position, 1.0 + 3.0, 1e-13);
  // Back to rest from a moving start with acceleration: 2 √(v + a²/2j)/j... here by the laws.
  Random random(18);
  for (int trial = 0; trial < 2000; ++trial) {
    const test::ProfileDemand demand = test::random_demand(random, 3, false);
    const SCurveProfile profile = SCurveProfile::to_velocity(
        demand.limits, demand.start, demand.goal.velocity, demand.goal.acceleration);
    test::ProfileDemand reached = demand;
    reached.goal.position = profile.goal().position;
    reached.replan = false;
    ASSERT_EQ(test::broken_law(profile, reached), "") << trial;
    // No motion to the same velocity is faster, whatever its place.
    ASSERT_LE(profile.total_time(),
              SCurveProfile(demand.limits, demand.start, demand.goal).total_time() + 1e-9);
  }
}

// Planned anew each 20 ms from where it is, it arrives when the first plan said.
TEST(SCurveProfile, ReplannedEachPeriodItArrivesInTime) {
  Random random(19);
  for (int trial = 0; trial < 300; ++trial) {
    test::ProfileDemand demand = test::random_demand(random, 3, trial % 2 == 1);
    demand.goal.velocity = 0.0;
    demand.goal.acceleration = 0.0;
    const double period = 0.02;
    SCurveProfile profile(demand.limits, demand.start, demand.goal);
    const double first = profile.total_time();
    const int steps = static_cast<int>(std::min(first / period, 2000.0));
    MotionState at = demand.start;
    for (int k = 0; k < steps; ++k) {
      at = profile.sample(period);
      profile = profile.replanned(at, demand.goal);
    }
    // Rounding of a velocity costs its root in time, at most once a plan. On the way back inside
    // the limits a shorter way may open.
    const double arrived = steps * period + profile.total_time();
    ASSERT_LE(arrived, first + 2e-4 * (1.0 + first)) << trial;
    ASSERT_GE(arrived, (trial % 2 == 1 ? 0.5 : 1.0 - 1e-6) * first - 1e-6) << trial;
  }
}

// 350° and 10° are 20° apart.
TEST(SCurveProfile, AnglesGoTheShortWay) {
  const double degree = std::acos(-1.0) / 180.0;
  const double goal = nearest_turn(10.0 * degree, 350.0 * degree);
  EXPECT_NEAR(goal, 370.0 * degree, 1e-14);
  EXPECT_NEAR(nearest_turn(-179.0 * degree, 179.0 * degree), 181.0 * degree, 1e-14);
  EXPECT_EQ(nearest_turn(0.5, 0.4, 0.0), 0.5);
  const SCurveProfile profile({.velocity = 1.0, .acceleration = 2.0, .jerk = 10.0},
                              {350.0 * degree}, {goal});
  EXPECT_LT(profile.total_time(), 1.1);
}

TEST(SCurveProfile, ACutGoalIsSaid) {
  const MotionLimits limits{.velocity = 1.0, .acceleration = 1.0, .jerk = 2.0};
  EXPECT_EQ(SCurveProfile(limits, {}, {1.0, 3.0, 0.0}).goal().velocity, 1.0);
  // At v = 1 with a = -1 it would have been faster before: nothing of it is left.
  EXPECT_EQ(SCurveProfile(limits, {}, {1.0, 1.0, -1.0}).goal().acceleration, 0.0);
}

TEST(SCurveProfile, IsFiniteForAnything) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double values[] = {0.0, 1.0, -2.0, 1e-300, 1e-29, 1e29, 1e300, -infinity, infinity, nan};
  for (const double v : values) {
    for (const double a : values) {
      for (const double j : values) {
        for (const double x : values) {
          const SCurveProfile profile({v, a, 0.0, 0.0, j}, {x, 0.5, a}, {1.0, x, 0.0});
          ASSERT_TRUE(std::isfinite(profile.total_time()));
          for (const double t : {0.0, 0.5, 1e10, infinity, nan, -1.0}) {
            const MotionState state = profile.sample(t);
            ASSERT_TRUE(std::isfinite(state.position) && std::isfinite(state.velocity) &&
                        std::isfinite(state.acceleration))
                << v << ' ' << a << ' ' << j << ' ' << x << ' ' << t;
          }
        }
      }
    }
  }
}

TEST(SCurveProfile, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (int i = 0; i < 100; ++i) {
    const SCurveProfile profile({1.0, 2.0, 0.0, 0.0, 5.0}, {0.1 * i, 0.2, 0.3}, {3.0, 0.1, 0.0});
    sum += profile.sample(0.5).position;
  }
  EXPECT_EQ(counter.count(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace flyball::s_curve_profile_test
