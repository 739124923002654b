#include <flyball/planning/profiles/trapezoid_profile.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "planning/profiles/fastest_duration.hpp"
#include "planning/profiles/profile_laws.hpp"
#include "support/allocation_count.hpp"

namespace flyball::trapezoid_profile_test {
namespace {

// Rest to rest over 50 with v 7, a 3.5: 2 s up, 5.142857 s cruise, 2 s down.
TEST(TrapezoidProfile, RestToRest) {
  const TrapezoidProfile profile({7.0, 3.5}, {}, {50.0, 0.0});
  EXPECT_NEAR(profile.total_time(), 9.142857142857142, 1e-14);
  EXPECT_DOUBLE_EQ(profile.sample(1.0).position, 1.75);
  EXPECT_DOUBLE_EQ(profile.sample(1.0).velocity, 3.5);
  EXPECT_EQ(profile.sample(1.0).acceleration, 3.5);
  EXPECT_NEAR(profile.sample(4.0).position, 7.0 + 14.0, 1e-13);
  EXPECT_EQ(profile.sample(4.0).acceleration, 0.0);
  EXPECT_NEAR(profile.sample(profile.total_time() - 1.0).position, 50.0 - 1.75, 1e-12);
  EXPECT_EQ(profile.sample(100.0).position, 50.0);
  EXPECT_EQ(profile.sample(100.0).velocity, 0.0);
  EXPECT_EQ(profile.sample(-1.0).position, 0.0);
}

// Too short to reach 10: the peak is sqrt(a d) = 2, each side takes 1 s. Backwards is the mirror.
TEST(TrapezoidProfile, TriangleBothWays) {
  const TrapezoidProfile there({10.0, 2.0}, {1.0, 0.0}, {3.0, 0.0});
  EXPECT_DOUBLE_EQ(there.total_time(), 2.0);
  EXPECT_DOUBLE_EQ(there.cruise_velocity(), 2.0);
  EXPECT_DOUBLE_EQ(there.sample(1.0).position, 2.0);
  const TrapezoidProfile back({10.0, 2.0}, {3.0, 0.0}, {1.0, 0.0});
  EXPECT_DOUBLE_EQ(back.total_time(), 2.0);
  EXPECT_DOUBLE_EQ(back.cruise_velocity(), -2.0);
  EXPECT_DOUBLE_EQ(back.sample(0.5).position, 2.75);
}

// At 4 with the limit 2 and a = 1: 2 s down to 2 covers 6; then 2 (t - 2); 2 s down covers 2.
// 20 = 6 + 12 + 2, so 2 + 6 + 2 = 10 s.
TEST(TrapezoidProfile, BrakesAnOverspeedStart) {
  const TrapezoidProfile profile({2.0, 1.0}, {0.0, 4.0}, {20.0, 0.0});
  EXPECT_DOUBLE_EQ(profile.total_time(), 10.0);
  EXPECT_DOUBLE_EQ(profile.sample(1.0).velocity, 3.0);
  EXPECT_DOUBLE_EQ(profile.sample(2.0).position, 6.0);
  EXPECT_DOUBLE_EQ(profile.sample(5.0).velocity, 2.0);
}

// v_0 = 4, a = 2, goal 1: it stops at 4, beyond the goal, and comes back 3 with the peak
// sqrt(2·3): 2 s + 2 sqrt(3/2) s.
TEST(TrapezoidProfile, ComesBackWhenItCannotStopInTime) {
  const TrapezoidProfile profile({10.0, 2.0}, {0.0, 4.0}, {1.0, 0.0});
  EXPECT_NEAR(profile.total_time(), 2.0 + 2.0 * std::sqrt(1.5), 1e-14);
  EXPECT_NEAR(profile.sample(2.0).position, 4.0, 1e-14);
  EXPECT_NEAR(profile.sample(2.0).velocity, 0.0, 1e-14);
}

TEST(TrapezoidProfile, NothingToDo) {
  const TrapezoidProfile profile({1.0, 1.0}, {2.0, 0.0}, {2.0, 0.0});
  EXPECT_EQ(profile.total_time(), 0.0);
  EXPECT_EQ(profile.sample(0.0).position, 2.0);
  EXPECT_EQ(profile.sample(0.0).acceleration, 0.0);
}

TEST(TrapezoidProfile, KeepsTheLaws) {
  Random random(11);
  for (const bool outside : {false, true}) {
    for (int trial = 0; trial < 20000; ++trial) {
      const test::ProfileDemand demand = test::random_demand(random, 2, outside);
      const TrapezoidProfile profile(demand.limits, demand.start, demand.goal);
      ASSERT_EQ(test::broken_law(profile, demand), "") << "trial " << trial;
    }
  }
}

// Up with 4, down with 1, over 10 from rest: the peak is √(2·10·4·1/5) = 4, 1 s up, 4 s down. The
// other way it is 4 s up and 1 s down; `along` makes it 1 s and 4 s both ways.
TEST(TrapezoidProfile, OtherLimitsUpThanDown) {
  const MotionLimits limits{.velocity = 9.0, .acceleration = 4.0, .deceleration = 1.0};
  const TrapezoidProfile up(limits, {}, {10.0});
  EXPECT_NEAR(up.total_time(), 5.0, 1e-14);
  EXPECT_NEAR(up.sample(1.0).velocity, 4.0, 1e-14);
  const TrapezoidProfile down(limits, {10.0}, {});
  EXPECT_NEAR(down.sample(4.0).velocity, -4.0, 1e-14);
  const TrapezoidProfile mirrored(limits.along(-10.0), {10.0}, {});
  EXPECT_NEAR(mirrored.sample(1.0).velocity, -4.0, 1e-14);
  // 9 forwards, 2 backwards: only what is no faster than 2 can be gone back.
  const MotionLimits slow_back{.velocity = 9.0, .acceleration = 4.0, .reverse_velocity = 2.0};
  EXPECT_FALSE(TrapezoidProfile(slow_back, {}, {10.0}).reversible());
  EXPECT_TRUE(TrapezoidProfile(slow_back, {}, {0.5}).reversible());
}

// A brute-force check of time optimality: no bang-bang-with-cruise motion of the other sign, and no
// slower peak, arrives earlier. From rest, time falls with the peak, so the limit or the triangle
// is best; the same with a moving start is compared with a grid of peaks.
TEST(TrapezoidProfile, IsTheFastest) {
  Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const MotionLimits limits{random.uniform(0.5, 2.0), random.uniform(0.5, 2.0)};
    const MotionState start{0.0, random.uniform(-1.0, 1.0) * limits.velocity};
    const MotionState goal{random.uniform(-3.0, 3.0), 0.0};
    const double best = TrapezoidProfile(limits, start, goal).total_time();
    for (int i = -400; i <= 400; ++i) {
      const double c = limits.velocity * i / 400.0;
      const double t_1 = std::abs(c - start.velocity) / limits.acceleration;
      const double t_3 = std::abs(c) / limits.acceleration;
      const double rest = goal.position - 0.5 * (start.velocity + c) * t_1 - 0.5 * c * t_3;
      if (c != 0.0 && rest / c >= 0.0) {
        ASSERT_GE(t_1 + rest / c + t_3, best - 1e-9);
      }
    }
  }
}

// The same of all limits and states, by bisection over the peak.
TEST(TrapezoidProfile, IsTheFastestOfAll) {
  Random random(6);
  for (int trial = 0; trial < 4000; ++trial) {
    const test::ProfileDemand demand = test::random_demand(random, 2, trial % 2 == 0);
    const MotionLimits all = demand.limits.both_ways();
    const TrapezoidProfile profile(demand.limits, demand.start, demand.goal);
    ASSERT_EQ(test::broken_optimality(
                  profile.total_time(), test::ConstantEffort{all.acceleration, all.deceleration},
                  all.velocity, all.reverse_velocity, demand.start, demand.goal),
              "")
        << trial;
  }
}

// At its velocity limit, with almost no acceleration, it still cruises to its goal.
TEST(TrapezoidProfile, CruisesWithLimitsOfAllSizes) {
  for (const double down : {1e-99, 1e-20, 1.0}) {
    for (const double up : {1e-99, 1e-20, 1.0}) {
      const MotionLimits limits{.velocity = 2.0, .acceleration = up, .deceleration = down};
      EXPECT_NEAR(TrapezoidProfile(limits, {0.0, 2.0}, {1.0, 2.0}).total_time(), 0.5, 1e-15);
      EXPECT_NEAR(TrapezoidProfile(limits, {1.0, -2.0}, {0.0, -2.0}).total_time(), 0.5, 1e-15);
    }
  }
}

TEST(TrapezoidProfile, IsFiniteForAnything) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double values[] = {0.0, 1.0, -2.0, 1e-300, 1e300, -1e300, infinity, -infinity, nan};
  for (const double v : values) {
    for (const double a : values) {
      for (const double x : values) {
        for (const double w : values) {
          const TrapezoidProfile profile({v, a}, {x, w}, {1.0, w});
          ASSERT_TRUE(std::isfinite(profile.total_time()));
          for (const double t : {0.0, 0.5, 1e10, infinity, nan, -1.0}) {
            const MotionState state = profile.sample(t);
            ASSERT_TRUE(std::isfinite(state.position) && std::isfinite(state.velocity) &&
                        std::isfinite(state.acceleration));
          }
        }
      }
    }
  }
}

TEST(TrapezoidProfile, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (int i = 0; i < 100; ++i) {
    const TrapezoidProfile profile({1.0, 2.0}, {0.1 * i, 0.2}, {3.0, 0.0});
    sum += profile.sample(0.5).position;
  }
  EXPECT_EQ(counter.count(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace flyball::trapezoid_profile_test
