#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/argument.hpp>
#include <flyball/estimation/localization/landmark_filter.hpp>
#include <flyball/estimation/localization/localize.hpp>

// Logs that are hardly any, and clocks that are wrong.
namespace flyball::landmark_log_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A robot that stands at the origin among four landmarks, which it sees at given times.
LandmarkLog standing(double first, double last, std::initializer_list<double> looks) {
  LandmarkLog log;
  log.landmarks = {{"1", {3.0, 0.5}}, {"2", {1.0, 3.0}}, {"3", {3.0, 3.0}}, {"4", {3.0, -1.0}}};
  for (int i = 0; first + 0.1 * i <= last + 1e-9; ++i) {
    log.odometry.push_back({first + 0.1 * i, 0.0, 0.0});
  }
  for (const double time : looks) {
    for (std::size_t l = 0; l < log.landmarks.size(); ++l) {
      const Eigen::Vector2d& at = log.landmarks[l].position;
      log.sightings.push_back({time, l, at.norm(), std::atan2(at(1), at(0))});
    }
  }
  return log;
}
LandmarkOptions plain() {
  LandmarkOptions options;
  options.calibration = {};
  return options;
}

TEST(SmoothLandmarks, OneTimeIsAPath) {
  const auto result =
      smooth_landmarks(standing(2.0, 2.0, {2.0}), plain(), {1.0, 2.0, 3.0}, Pose2d(0.05, 0.0, 0.0));
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->path.time, std::vector<double>{2.0});
  EXPECT_LE(result->path.pose.front().minus(Pose2d()).norm(), 0.06);
  EXPECT_TRUE(result->path.covariance.front().allFinite());
}

TEST(SmoothLandmarks, APoseThatTheLastLookTellsIsNoPath) {
  const auto result = smooth_landmarks(standing(0.0, 5.0, {5.0}), plain(), {0.0, 5.0});
  ASSERT_FALSE(result);
  EXPECT_TRUE(result.error().is(LocalizationError::too_few_sightings)) << to_string(result.error());
}

// The four sightings that tell the first pose are all that there are.
TEST(SmoothLandmarks, TheLooksThatToldThePoseHoldIt) {
  const auto result = smooth_landmarks(standing(0.0, 5.0, {3.0}), plain(), {0.0, 4.0, 5.0});
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->path.time, (std::vector<double>{4.0, 5.0}));
  EXPECT_LE(result->path.pose.back().minus(Pose2d()).norm(), 0.1);
}

TEST(LandmarkFilter, ASightingOfNoTimeChangesNothing) {
  auto filter = LandmarkFilter::create(plain()).value();
  filter.reset(Pose2d());
  filter.predict(1.0);
  for (const double bad : {nan, std::numeric_limits<double>::infinity(), -1e200}) {
    EXPECT_FALSE(filter.sighting(bad, {3.0, 0.0}, 2.9, 0.0).accepted());
  }
  EXPECT_EQ(filter.pose().x(), 0.0);
  EXPECT_EQ(filter.time(), 1.0);
  EXPECT_TRUE(filter.sighting(0.5, {3.0, 0.0}, 2.9, 0.0).accepted());  // Late: as of now.
  EXPECT_EQ(filter.time(), 1.0);
}

TEST(LandmarkLog, OtherClocksAreRefused) {
  const auto refused = [](auto change, const char* words) {
    LandmarkLog log = standing(0.0, 5.0, {1.0, 2.0});
    change(log);
    for (const bool smooth : {false, true}) {
      const auto error = smooth ? smooth_landmarks(log, plain(), {1.0}).error()
                                : filter_landmarks(log, plain(), {1.0}).error();
      EXPECT_TRUE(error.is(ArgumentError::out_of_range)) << to_string(error);
      EXPECT_NE(to_string(error).find(words), std::string::npos) << to_string(error);
    }
  };
  refused([](LandmarkLog& log) { log.odometry.front().time = -1.2e9; }, "odometry row 2");
  refused([](LandmarkLog& log) { log.odometry.back().time = 1e300; }, "odometry row 51");
  refused([](LandmarkLog& log) { log.sightings.front().time = -1e12; }, "sighting 1");
  refused([](LandmarkLog& log) { log.sightings.back().time = 1.2e12; }, "sighting 8");
  refused(
      [](LandmarkLog& log) {
        log.odometry.clear();
        log.sightings.back().time = 1.2e12;
      },
      "the one before");
  LandmarkLog late = standing(0.0, 5.0, {1.0, 600.0});
  EXPECT_TRUE(filter_landmarks(late, plain(), {1.0, 600.0}));
}

TEST(LandmarkLog, AStartThatIsNoneIsRefused) {
  for (const double bad : {nan, std::numeric_limits<double>::infinity(), 1e200}) {
    const LandmarkLog log = standing(0.0, 5.0, {1.0, 2.0});
    const Pose2d start(bad, 0.0, 0.0);
    EXPECT_TRUE(filter_landmarks(log, plain(), {1.0}, start).error().is(ArgumentError::not_finite));
    EXPECT_TRUE(smooth_landmarks(log, plain(), {1.0}, start).error().is(ArgumentError::not_finite));
  }
}

}  // namespace
}  // namespace flyball::landmark_log_test
