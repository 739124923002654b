#include <flyball/planning/profiles/synchronized_motion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "planning/profiles/profile_laws.hpp"
#include "support/allocation_count.hpp"

namespace flyball::synchronized_motion_test {
namespace {

using Three = SynchronizedMotion<3>;

std::string broken_axis(const JerkMotion& axis, test::ProfileDemand demand, double total) {
  demand.order = 3;
  if (std::abs(axis.total_time() - total) > 1e-9 * total) {
    return "it ends by itself";
  }
  return test::broken_law(axis, demand);
}

// From rest to rest the slow axis takes its own time, the others stretch theirs.
TEST(SynchronizedMotion, AllArriveAtOnce) {
  const MotionLimits limits{.velocity = 1.0, .acceleration = 2.0, .jerk = 8.0};
  const Three motion({limits, limits, limits}, {}, {MotionState{0.3}, {-2.0}, {0.0}});
  EXPECT_EQ(motion.slowest_axis(), 1);
  EXPECT_NEAR(motion.total_time(), SCurveProfile(limits, {}, {-2.0}).total_time(), 1e-12);
  const auto middle = motion.sample(0.5 * motion.total_time());
  EXPECT_NEAR(middle[0].position, 0.15, 1e-12);
  EXPECT_NEAR(middle[1].position, -1.0, 1e-12);
  EXPECT_EQ(middle[2].position, 0.0);
}

TEST(SynchronizedMotion, EachAxisKeepsItsLaws) {
  Random random(21);
  int waited = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    Three::Limits limits;
    Three::States start;
    Three::States goal;
    double longest = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const test::ProfileDemand demand = test::random_demand(random, 3, trial % 4 == 3);
      limits[i] = demand.limits;
      start[i] = demand.start;
      goal[i] = demand.goal;
      longest = std::max(longest, SCurveProfile(limits[i], start[i], goal[i]).total_time());
    }
    const Three motion(limits, start, goal);
    ASSERT_GE(motion.total_time(), longest * (1.0 - 1e-12));
    waited += motion.total_time() > longest * (1.0 + 1e-9) ? 1 : 0;
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_EQ(broken_axis(motion.axis(static_cast<int>(i)), {limits[i], start[i], goal[i]},
                            motion.total_time()),
                "")
          << "trial " << trial << " axis " << i;
    }
    // Between the longest of their own and the common one, there is none.
    const double less = 0.5 * (longest + motion.total_time());
    const Three asked(limits, start, goal, Synchronization::time, less);
    ASSERT_NEAR(asked.total_time(), motion.total_time(), 1e-9 * motion.total_time());
    const double later = 1.3 * motion.total_time();
    const Three slow(limits, start, goal, Synchronization::time, later);
    ASSERT_GE(slow.total_time(), later);
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_EQ(broken_axis(slow.axis(static_cast<int>(i)), {limits[i], start[i], goal[i]},
                            slow.total_time()),
                "")
          << "trial " << trial << " axis " << i;
    }
  }
  EXPECT_GT(waited, 20);  // goals that move block durations
}

// Ruckig 0.17.3, two axes: the common duration is longer than each one's own.
TEST(SynchronizedMotion, BlockedDurations) {
  using Two = SynchronizedMotion<2>;
  struct Case {
    Two::Limits limits;
    Two::States start;
    Two::States goal;
    double duration;
  };
  const Case cases[] = {
      {{{{2.083, 1.712, 0.0, 0.0, 3.722}, {2.434, 3.499, 0.0, 0.0, 6.28}}},
       {{{0.0, -1.475, -0.599}, {0.0, -2.01, -0.778}}},
       {{{-1.609, -1.979, 0.37}, {-1.67, 0.898, -2.276}}},
       4.69474687968653},
      {{{{0.88, 1.195, 0.0, 0.0, 2.962}, {1.622, 0.606, 0.0, 0.0, 2.97}}},
       {{{0.0, 0.34, 1.177}, {0.0, 0.88, 0.464}}},
       {{{0.054, -0.454, -0.737}, {0.94, 0.795, 0.2}}},
       5.03669085765231},
      {{{{1.224, 0.531, 0.0, 0.0, 6.322}, {1.548, 0.603, 0.0, 0.0, 3.327}}},
       {{{0.0, 0.142, -0.097}, {0.0, -1.294, -0.199}}},
       {{{0.784, -0.473, 0.214}, {-1.088, -1.173, -0.457}}},
       7.57673842459484},
      {{{{1.017, 1.181, 0.0, 0.0, 0.998}, {3.316, 1.144, 0.0, 0.0, 0.531}}},
       {{{0.0, -0.498, -0.753}, {0.0, 1.628, 0.833}}},
       {{{-1.576, 0.877, -0.33}, {1.817, 2.505, 1.132}}},
       12.8729788072326},
      {{{{2.903, 1.259, 0.0, 0.0, 5.116}, {1.21, 3.315, 0.0, 0.0, 4.564}}},
       {{{0.0, 2.222, 0.479}, {0.0, 0.763, -1.916}}},
       {{{1.566, 2.86, 1.152}, {1.723, 0.444, 1.696}}},
       7.92197286967842},
      {{{{3.099, 1.124, 0.0, 0.0, 2.694}, {2.476, 2.131, 0.0, 0.0, 2.569}}},
       {{{0.0, -2.293, -0.109}, {0.0, -2.035, -1.048}}},
       {{{-1.432, -2.404, -0.496}, {-0.881, -1.227, 0.694}}},
       8.39049568643116},
  };
  for (const Case& c : cases) {
    const Two motion(c.limits, c.start, c.goal);
    EXPECT_NEAR(motion.total_time(), c.duration, 1e-9 * c.duration);
    EXPECT_EQ(motion.slowest_axis(), -1);
  }
}

TEST(SynchronizedMotion, InPhaseItIsAStraightLine) {
  const Three::Limits limits{MotionLimits{2.0, 3.0, 1.5, 0.0, 9.0},
                             MotionLimits{1.0, 1.0, 0.0, 0.0, 4.0},
                             MotionLimits{4.0, 2.0, 0.0, 0.0, 5.0}};
  const Three::States start{MotionState{1.0, 0.2, 0.1}, {0.0, -0.1, -0.05}, {2.0, 0.05, 0.025}};
  const Three::States goal{MotionState{3.0}, {-1.0}, {2.5}};
  const Three motion(limits, start, goal, Synchronization::phase);
  ASSERT_TRUE(motion.in_phase());
  for (int k = 0; k <= 50; ++k) {
    const auto at = motion.sample(motion.total_time() * k / 50.0);
    EXPECT_NEAR(at[1].position, -0.5 * (at[0].position - 1.0), 1e-12);
    EXPECT_NEAR(at[2].position, 2.0 + 0.25 * (at[0].position - 1.0), 1e-12);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(broken_axis(motion.axis(static_cast<int>(i)), {limits[i], start[i], goal[i]},
                          motion.total_time()),
              "");
  }
  // No faster than without the line; and off a line they are synchronized in time.
  EXPECT_GE(motion.total_time(), Three(limits, start, goal).total_time() - 1e-12);
  Three::States off = start;
  off[2].velocity = 0.5;
  EXPECT_FALSE(Three(limits, off, goal, Synchronization::phase).in_phase());
}

TEST(SynchronizedMotion, AnUnusableAxisStandsAtItsGoal) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const MotionLimits limits{.velocity = 1.0, .acceleration = 2.0, .jerk = 8.0};
  const Three motion({limits, MotionLimits{nan, 1.0}, limits}, {},
                     {MotionState{1.0}, {2.0}, {nan}});
  EXPECT_EQ(motion.sample(0.1)[1].position, 2.0);
  EXPECT_EQ(motion.sample(0.1)[2].position, 0.0);
  EXPECT_NEAR(motion.total_time(), SCurveProfile(limits, {}, {1.0}).total_time(), 1e-12);
}

TEST(SynchronizedMotion, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  const MotionLimits limits{.velocity = 1.0, .acceleration = 2.0, .jerk = 8.0};
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Three motion({limits, limits, limits}, {MotionState{0.0, 0.1 * (i % 7), 0.2}, {}, {}},
                       {MotionState{1.0, 0.1, 0.1}, {0.01 * i, 0.3}, {2.0}});
    sum += motion.sample(0.3)[0].position;
  }
  EXPECT_EQ(counter.count(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace flyball::synchronized_motion_test
