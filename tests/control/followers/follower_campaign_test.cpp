#include <gtest/gtest.h>

#include "followers/follower_campaign.hpp"

// A sample of `campaign_followers`, other seeds than those that are measured there: starts within
// 1 m and 1.5 rad of the path's, sides moving at up to 1 m/s either way; the robot's mass, inertia,
// motors and trackwidth off by up to 20 %, its wheels on tires that slip, what is measured 40 ms
// late.
namespace flyball::follower_campaign::follower_campaign_test {
namespace {

TEST(FollowerCampaign, RandomStartsConvergeOrSaySo) {
  const Followers designed;
  for (const Kind kind : kinds) {
    int converged = 0;
    constexpr int runs = 5;
    for (int k = 0; k < runs; ++k) {
      const Outcome outcome = run(designed, kind, 500000 + static_cast<std::uint64_t>(k), {});
      EXPECT_NE(outcome.ending, Ending::not_finite) << name_of(kind) << " " << k;
      converged += outcome.ending == Ending::converged ? 1 : 0;
    }
    EXPECT_GE(converged, runs - 1) << name_of(kind);
  }
}

// Far beyond the region a follower that does not come back is at its limits or lost, never silent.
TEST(FollowerCampaign, FarStartsAreSeen) {
  const Followers designed;
  Conditions far;
  far.distance = 40.0;
  int converged = 0;
  for (const Kind kind : {Kind::ramsete, Kind::unicycle, Kind::drive}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Outcome outcome = run(designed, kind, seed, far);
      converged += outcome.ending == Ending::converged ? 1 : 0;
      EXPECT_NE(outcome.ending, Ending::near) << name_of(kind) << " " << seed;
      EXPECT_NE(outcome.ending, Ending::not_finite) << name_of(kind) << " " << seed;
    }
  }
  EXPECT_LT(converged, 12);
}

}  // namespace
}  // namespace flyball::follower_campaign::follower_campaign_test
