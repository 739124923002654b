#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/localization/landmark_filter.hpp>
#include <flyball/estimation/localization/localize.hpp>
#include <flyball/estimation/localization/relocalizer.hpp>

#include "estimation/landmark_drive.hpp"
#include "estimation/localization/residuals.hpp"
#include "support/allocation_count.hpp"

namespace flyball::localization_test {
namespace {

using Eigen::Vector2d;
using test::DriveSettings;
using test::landmark_drive;
using test::SimulatedDrive;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Score {
  double rms = 0.0;
  double worst = 0.0;
  double nees = 0.0;  ///< Over its two degrees of freedom.
};
Score score(const LocalizedPath& path, const SimulatedDrive& drive, double from = 0.0) {
  Score result;
  double count = 0.0;
  for (std::size_t i = 0; i < path.time.size(); ++i) {
    if (path.time[i] < from) {
      continue;
    }
    const auto at = static_cast<std::size_t>(std::llround(path.time[i] * 100.0));
    const double off = (path.pose[i].translation() - drive.truth[at].translation()).norm();
    const Eigen::Vector3d e = drive.truth[at].minus(path.pose[i]);
    result.rms += off * off;
    result.worst = std::max(result.worst, off);
    result.nees +=
        0.5 * e.head<2>().dot(path.covariance[i].topLeftCorner<2, 2>().inverse() * e.head<2>());
    count += 1.0;
  }
  result.rms = std::sqrt(result.rms / count);
  result.nees /= count;
  return result;
}

TEST(Relocalizer, TwoLandmarksTellThePose) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const Pose2d truth(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0),
                       random.uniform(-3.1, 3.1));
    Relocalizer relocalizer;
    Pose2d reckoned(3.0, -2.0, 1.0);  // From anywhere.
    Pose2d at = truth;
    for (int k = 0; k < 6; ++k) {
      const Vector2d landmark(random.uniform(-6.0, 6.0), random.uniform(-6.0, 6.0));
      relocalizer.add(0.1 * k, reckoned, at.inverse() * landmark, landmark);
      const Eigen::Vector3d step(0.05, 0.0, 0.02);
      at = at * Pose2d::exp(step);
      reckoned = reckoned * Pose2d::exp(step);
    }
    const auto found = relocalizer.find(reckoned);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->agreeing, 6);
    EXPECT_LE(found->pose.minus(at).norm(), 1e-12);
    EXPECT_EQ(relocalizer.agreeing(at, reckoned, 6), 6);
    EXPECT_LE(relocalizer.agreeing(at * Pose2d(3.0, 3.0, 2.0), reckoned, 6), 1);
  }
}

TEST(Relocalizer, FalseSightingsAreOutvoted) {
  Random random(4);
  int right = 0;
  constexpr int trials = 200;
  for (int trial = 0; trial < trials; ++trial) {
    const Pose2d truth(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0),
                       random.uniform(-3.1, 3.1));
    Relocalizer relocalizer;
    for (int k = 0; k < 20; ++k) {
      const Vector2d landmark(random.uniform(-6.0, 6.0), random.uniform(-6.0, 6.0));
      const Vector2d seen = k % 6 == 4
                                ? Vector2d(random.uniform(-6.0, 6.0), random.uniform(-6.0, 6.0))
                                : Vector2d(truth.inverse() * landmark);
      relocalizer.add(0.1 * k, Pose2d(), seen, landmark);
    }
    const auto found = relocalizer.find(Pose2d());
    right += found && found->pose.minus(truth).norm() < 0.1 ? 1 : 0;
  }
  EXPECT_EQ(right, trials);
}

TEST(Relocalizer, OneLandmarkIsNotEnough) {
  Relocalizer relocalizer;
  EXPECT_FALSE(relocalizer.find(Pose2d()));
  for (int k = 0; k < 30; ++k) {
    relocalizer.add(0.1 * k, Pose2d(0.1 * k, 0.0, 0.0), {2.0 - 0.1 * k, 1.0}, {5.0, 5.0});
  }
  EXPECT_EQ(relocalizer.size(), Relocalizer::capacity);
  EXPECT_FALSE(relocalizer.find(Pose2d(3.0, 0.0, 0.0)));
  relocalizer.add(3.0, Pose2d(), {nan, 0.0}, {0.0, 0.0});
  EXPECT_NEAR(relocalizer.newest_time(), 2.9, 1e-12);
}

TEST(LandmarkFilter, FindsItselfAndItsSensors) {
  const SimulatedDrive drive = landmark_drive(1, {.duration = 120.0});
  const auto result = filter_landmarks(drive.log, {}, drive.time);
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(result->relocalizations, 1);
  EXPECT_LE(result->path.time.front(), 10.0);
  const Score all = score(result->path, drive, 20.0);
  EXPECT_LE(all.rms, 0.06);
  EXPECT_LE(all.worst, 0.25);
  EXPECT_LE(all.nees, 1.5);
  EXPECT_NEAR(result->calibration.delay, 0.2, 0.05);
  EXPECT_NEAR(result->calibration.depth_exponent, 1.0, 0.15);
  EXPECT_NEAR(result->calibration.velocity_scale, 0.95, 0.03);
}

// The steps differ, the model does not: each finds the path and the sensors, and where everything
// is known well enough for a straight line all say the same.
TEST(LandmarkFilter, EveryMethodFindsThePathAndTheSensors) {
  const SimulatedDrive drive = landmark_drive(1, {.duration = 120.0});
  std::vector<Pose2d> ends;
  for (const auto method : {LandmarkFilterMethod::extended, LandmarkFilterMethod::unscented,
                            LandmarkFilterMethod::invariant}) {
    SCOPED_TRACE(static_cast<int>(method));
    const auto result = filter_landmarks(drive.log, {.method = method}, drive.time);
    ASSERT_TRUE(result) << to_string(result.error());
    const Score all = score(result->path, drive, 20.0);
    EXPECT_LE(all.rms, 0.06);
    EXPECT_LE(all.nees, 1.5);
    EXPECT_NEAR(result->calibration.delay, 0.2, 0.05);
    EXPECT_NEAR(result->calibration.depth_exponent, 1.0, 0.15);
    ends.push_back(result->path.pose.back());
  }
  for (std::size_t i = 1; i < ends.size(); ++i) {
    const double apart = ends[i].minus(ends[0]).norm();
    EXPECT_LT(apart, 0.01);
    EXPECT_GT(apart, 1e-6) << "the same steps";
  }
}

TEST(LandmarkFilter, AGyrosBiasIsFound) {
  DriveSettings settings{.duration = 120.0};
  settings.calibration.gyro_bias = 0.03;
  const SimulatedDrive drive = landmark_drive(4, settings);
  LandmarkOptions options;
  options.calibration_std.gyro_bias = 0.05;
  for (const auto method : {LandmarkFilterMethod::extended, LandmarkFilterMethod::unscented,
                            LandmarkFilterMethod::invariant}) {
    options.method = method;
    const auto filtered = filter_landmarks(drive.log, options, drive.time);
    ASSERT_TRUE(filtered) << to_string(filtered.error());
    EXPECT_NEAR(filtered->calibration.gyro_bias, 0.03, 0.01);
  }
  const auto smoothed = smooth_landmarks(drive.log, options, drive.time);
  ASSERT_TRUE(smoothed) << to_string(smoothed.error());
  EXPECT_NEAR(smoothed->calibration.gyro_bias, 0.03, 3.0 * smoothed->calibration_std.gyro_bias);
  EXPECT_LT(smoothed->calibration_std.gyro_bias, 0.025);
}

// What is seen is the inverse of what is measured.
TEST(LandmarkFilter, SeenIsTheInverseOfASighting) {
  const SensorCalibration k{.range_scale = 0.1,
                            .range_offset = 0.05,
                            .depth_exponent = 0.7,
                            .bearing_scale = -0.03,
                            .bearing_offset = 0.02};
  for (const double angle : {-1.2, -0.3, 0.0, 0.8}) {
    const Vector2d there(3.0 * std::cos(angle), 3.0 * std::sin(angle));
    const Eigen::Vector2d reading = localization::sighting(Pose2d(), k.vector(), there);
    EXPECT_LE((localization::seen(k.vector(), reading(0), reading(1)) - there).norm(), 1e-14);
  }
}

TEST(LandmarkFilter, ACalibrationThatIsKnownIsKept) {
  const SimulatedDrive drive = landmark_drive(2);
  LandmarkOptions options;
  options.calibration = DriveSettings{}.calibration;
  options.calibration_std =
      SensorCalibration::from(Eigen::Matrix<double, SensorCalibration::size, 1>::Zero());
  const auto result = filter_landmarks(drive.log, options, drive.time, drive.truth.front());
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_LE((result->calibration.vector() - options.calibration.vector()).norm(), 1e-12);
  EXPECT_LE(score(result->path, drive).rms, 0.05);
}

// 2 m and a right angle off at the start: found within seconds of sightings in 99 of 100 drives.
TEST(LandmarkFilter, AWrongStartIsMended) {
  int mended = 0;
  constexpr int drives = 100;
  for (int seed = 0; seed < drives; ++seed) {
    const SimulatedDrive drive =
        landmark_drive(static_cast<std::uint64_t>(seed) + 100, {.duration = 25.0});
    const Pose2d wrong = drive.truth.front() * Pose2d(1.6, 1.2, 0.5 * std::numbers::pi);
    const auto result = filter_landmarks(drive.log, {}, drive.time, wrong);
    ASSERT_TRUE(result) << to_string(result.error());
    mended += score(result->path, drive, 20.0).worst < 0.4 ? 1 : 0;
  }
  EXPECT_GE(mended, 99);
}

// Put elsewhere and turned by 2 rad: after two seconds in which landmarks were seen it is found.
TEST(LandmarkFilter, ARobotThatIsCarriedAwayIsFound) {
  int found = 0;
  constexpr int drives = 50;
  for (int seed = 0; seed < drives; ++seed) {
    const SimulatedDrive drive = landmark_drive(static_cast<std::uint64_t>(seed) + 300,
                                                {.duration = 45.0, .carried_at = 25.0});
    // Two seconds' worth of looks, of two landmarks or more.
    double seen = 0.0;
    double deadline = drive.time.back();
    std::vector<std::size_t> landmarks;
    double last = -1.0;
    for (const Sighting& sighting : drive.log.sightings) {
      if (sighting.time <= 25.0) {
        continue;
      }
      landmarks.push_back(sighting.landmark);
      seen += sighting.time > last ? 0.25 : 0.0;
      last = sighting.time;
      const bool two = std::any_of(landmarks.begin(), landmarks.end(),
                                   [&](std::size_t l) { return l != landmarks.front(); });
      if (seen >= 2.0 && two) {
        deadline = sighting.time;
        break;
      }
    }
    const auto result = filter_landmarks(drive.log, {}, drive.time, drive.truth.front());
    ASSERT_TRUE(result) << to_string(result.error());
    found += score(result->path, drive, deadline + 0.5).worst < 0.6 ? 1 : 0;
  }
  EXPECT_GE(found, 49);
}

// A landmark that is taken for another pulls at every sighting: it must not drag the pose away.
TEST(LandmarkFilter, LandmarksTakenForOthersDoNotDragIt) {
  SimulatedDrive drive = landmark_drive(5, {.duration = 120.0, .mistaken = 0.2});
  const auto result = filter_landmarks(drive.log, {}, drive.time, drive.truth.front());
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_LE(score(result->path, drive).worst, 0.4);
  const auto smoothed = smooth_landmarks(drive.log, {}, drive.time, drive.truth.front());
  ASSERT_TRUE(smoothed) << to_string(smoothed.error());
  EXPECT_LE(score(smoothed->path, drive).worst, 0.25);
  const auto used =
      static_cast<double>(std::count(smoothed->used.begin(), smoothed->used.end(), true));
  EXPECT_NEAR(used / static_cast<double>(smoothed->used.size()), 0.8, 0.07);
}

TEST(LandmarkFilter, WhatIsNoNumberChangesNothing) {
  auto filter = LandmarkFilter::create().value();
  EXPECT_FALSE(filter.located());
  EXPECT_FALSE(filter.reset(Pose2d(nan, 0.0, 0.0)));
  ASSERT_TRUE(filter.reset(Pose2d(1.0, 2.0, 0.5)));
  EXPECT_TRUE(filter.odometry(0.0, 0.5, 0.1));
  EXPECT_FALSE(filter.odometry(1.0, nan, 0.1));
  EXPECT_FALSE(filter.odometry(-1.0, 0.5, 0.1));
  EXPECT_TRUE(filter.predict(0.5));
  const Pose2d before = filter.pose();
  EXPECT_FALSE(filter.predict(nan));
  EXPECT_FALSE(filter.predict(0.2));
  EXPECT_EQ(filter.time(), 0.5);
  for (const double bad : {nan, std::numeric_limits<double>::infinity(), -1.0}) {
    EXPECT_FALSE(filter.sighting(0.5, {3.0, 3.0}, bad, 0.1).accepted());
  }
  EXPECT_FALSE(filter.sighting(0.5, {3.0, nan}, 2.0, 0.1).accepted());
  EXPECT_FALSE(filter.sighting(0.5, {3.0, 3.0}, 2.0, nan).accepted());
  EXPECT_EQ(filter.pose().minus(before).norm(), 0.0);
  EXPECT_TRUE(filter.predict(3600.0));  // A bounded number of steps.
  EXPECT_TRUE(filter.pose().matrix().allFinite());
  EXPECT_TRUE(filter.pose_covariance().allFinite());
}

TEST(LandmarkFilter, AnotherClocksTimeChangesNothing) {
  auto filter = LandmarkFilter::create({}).value();
  ASSERT_TRUE(filter.reset(Pose2d(1.0, 2.0, 0.5)));
  ASSERT_TRUE(filter.odometry(10.0, 1.0, 0.0));
  ASSERT_TRUE(filter.predict(11.0));
  const Pose2d pose = filter.pose();
  const auto P = filter.estimate().P();
  for (const double time : {1e99, 1.7e9, 11.0 + 3601.0}) {
    EXPECT_FALSE(filter.odometry(time, 1.0, 0.0));
    EXPECT_FALSE(filter.predict(time));
    EXPECT_FALSE(filter.sighting(time, {5.0, 5.0}, 3.0, 0.1).accepted());
  }
  EXPECT_EQ(filter.time(), 11.0);
  EXPECT_EQ(filter.pose().matrix(), pose.matrix());
  EXPECT_EQ(filter.estimate().P(), P);
  EXPECT_TRUE(filter.odometry(12.0, 1.0, 0.0));
  EXPECT_TRUE(filter.predict(12.0));

  EXPECT_FALSE(filter.reset(Pose2d(), nan));
  ASSERT_TRUE(filter.reset(Pose2d(3.0, 0.0, 0.0), 1.7e9));
  EXPECT_EQ(filter.time(), 1.7e9);
  ASSERT_TRUE(filter.reset(Pose2d(3.0, 0.0, 0.0), 1.0));  // Back, and with odometry of then.
  ASSERT_TRUE(filter.odometry(1.0, 1.0, 0.0));
  ASSERT_TRUE(filter.predict(2.0));
  EXPECT_EQ(filter.time(), 2.0);
  EXPECT_GT(filter.pose().x(), 3.5);
}

void expect_no_allocations(LandmarkFilterMethod method) {
  const SimulatedDrive drive = landmark_drive(7, {.duration = 10.0});
  auto filter = LandmarkFilter::create({.method = method}).value();
  const test::AllocationCounter count;
  std::size_t next = 0;
  for (const OdometrySample& sample : drive.log.odometry) {
    filter.odometry(sample.time, sample.velocity, sample.turn_rate);
    while (next < drive.log.sightings.size() && drive.log.sightings[next].time <= sample.time) {
      const Sighting& s = drive.log.sightings[next++];
      filter.sighting(s.time, drive.log.landmarks[s.landmark].position, s.range, s.bearing);
    }
    filter.predict(sample.time);
  }
  EXPECT_EQ(count.count(), 0U);
  EXPECT_TRUE(filter.located());
}
TEST(LandmarkFilter, DoesNotAllocate) {
  for (const auto method : {LandmarkFilterMethod::extended, LandmarkFilterMethod::unscented,
                            LandmarkFilterMethod::invariant}) {
    expect_no_allocations(method);
  }
}

TEST(SmoothLandmarks, IsNearerThanTheFilterAndKnowsItsSensors) {
  for (const std::uint64_t seed : {11U, 12U, 13U}) {
    const SimulatedDrive drive = landmark_drive(seed, {.duration = 120.0});
    const auto filtered = filter_landmarks(drive.log, {}, drive.time);
    const auto smoothed = smooth_landmarks(drive.log, {}, drive.time);
    ASSERT_TRUE(smoothed) << to_string(smoothed.error());
    EXPECT_TRUE(smoothed->converged);
    const Score all = score(smoothed->path, drive);
    EXPECT_LT(all.rms, score(filtered->path, drive).rms);
    EXPECT_LE(all.rms, 0.04);
    EXPECT_LE(all.nees, 1.2);
    const auto truth = DriveSettings{}.calibration.vector();
    const Eigen::VectorXd off =
        (smoothed->calibration.vector() - truth).cwiseQuotient(smoothed->calibration_std.vector());
    EXPECT_LE(off.cwiseAbs().maxCoeff(), 3.5) << off.transpose();
    EXPECT_LE(smoothed->calibration_std.delay, 0.07);
  }
}

// Expected to be none, and in truth a fifth of a second: where the robot stops and turns at once,
// both find it, and what else was unknown.
TEST(SmoothLandmarks, AbruptMotionTellsTheDelay) {
  for (const std::uint64_t seed : {31U, 32U}) {
    const SimulatedDrive drive = landmark_drive(seed, {.duration = 150.0, .abrupt = true});
    LandmarkOptions options;
    options.calibration.delay = 0.0;
    const auto filtered = filter_landmarks(drive.log, options, drive.time);
    ASSERT_TRUE(filtered) << to_string(filtered.error());
    EXPECT_NEAR(filtered->calibration.delay, 0.2, 0.04);
    const auto smoothed = smooth_landmarks(drive.log, options, drive.time);
    ASSERT_TRUE(smoothed) << to_string(smoothed.error());
    EXPECT_NEAR(smoothed->calibration.delay, 0.2, 0.03);
    EXPECT_LE(score(smoothed->path, drive).rms, 0.05);
  }
}

// While the odometry is silent the robot may do anything: three seconds later its heading is not
// known to a tenth of a radian, as it is where the odometry says that it stands.
TEST(LandmarkFilter, SilentOdometryIsNoOdometryOfRest) {
  const auto heading_std = [](bool silent) {
    auto filter = LandmarkFilter::create().value();
    filter.reset(Pose2d());
    for (int i = 0; i <= 400; ++i) {
      if (i <= 100 || !silent) {
        filter.odometry(0.01 * i, 0.0, 0.0);
      }
    }
    filter.predict(4.0);
    return std::sqrt(filter.pose_covariance()(2, 2));
  };
  EXPECT_GE(heading_std(true), 0.3);
  EXPECT_LE(heading_std(false), 0.115);
}

// v = t and w = 2t: the way from 1 to 2 with a delay d is ((2 - d)² - (1 - d)²)/2 = 3/2 - d, the
// angle twice that, at any delay from which it is linearised.
TEST(SmoothLandmarks, ATwistIsLinearInTheDelay) {
  for (const double delay : {0.0, 0.3}) {
    const localization::Driven driven{1.5 - delay, 3.0 - 2.0 * delay, 1.0, 2.0, delay, 1.0};
    SensorCalibration calibration{.velocity_scale = 2.0, .turn_per_velocity = 0.5, .delay = 0.1};
    const Eigen::Vector3d tau =
        localization::twist(driven, Vector2d(0.01, 0.02), calibration.vector());
    EXPECT_NEAR(tau(0), 2.0 * 1.4 + 0.01, 1e-15);
    EXPECT_EQ(tau(1), 0.0);
    EXPECT_NEAR(tau(2), 2.8 + 0.5 * 1.4 + 0.02, 1e-15);
  }
}

// After the robot was carried away the filter leaves out some looks before it believes; looking
// back they fit.
TEST(SmoothLandmarks, WhatTheFilterLeftOutComesBackWhereItFits) {
  std::ptrdiff_t filter = 0;
  std::ptrdiff_t smoother = 0;
  for (std::uint64_t seed = 300; seed < 305; ++seed) {
    const SimulatedDrive drive = landmark_drive(seed, {.duration = 45.0, .carried_at = 25.0});
    const auto filtered = filter_landmarks(drive.log, {}, drive.time, drive.truth.front());
    const auto smoothed = smooth_landmarks(drive.log, {}, drive.time, drive.truth.front());
    ASSERT_TRUE(filtered && smoothed);
    filter += std::count(filtered->weight.begin(), filtered->weight.end(), 0.0);
    smoother += std::count(smoothed->used.begin(), smoothed->used.end(), false);
  }
  EXPECT_LE(smoother + 5, filter);
}

TEST(SmoothLandmarks, TheSameLogGivesTheSameBytes) {
  const SimulatedDrive drive = landmark_drive(21, {.duration = 30.0});
  const auto first = smooth_landmarks(drive.log, {}, drive.time);
  const auto second = smooth_landmarks(drive.log, {}, drive.time);
  ASSERT_TRUE(first && second);
  for (std::size_t i = 0; i < first->path.pose.size(); ++i) {
    ASSERT_EQ(first->path.pose[i].matrix(), second->path.pose[i].matrix());
  }
}

TEST(LandmarkLog, WhatDoesNotFitIsRefusedWithItsRow) {
  const SimulatedDrive drive = landmark_drive(1, {.duration = 20.0});
  const auto refused = [&](auto change, ArgumentError code, const char* words) {
    LandmarkLog log = drive.log;
    LandmarkOptions options;
    change(log, options);
    const auto result = filter_landmarks(log, options, drive.time);
    ASSERT_FALSE(result);
    EXPECT_TRUE(result.error().is(code)) << to_string(result.error());
    EXPECT_NE(to_string(result.error()).find(words), std::string::npos)
        << to_string(result.error());
    EXPECT_FALSE(smooth_landmarks(log, options, drive.time));
  };
  refused([](auto& log, auto&) { log.odometry[4].velocity = nan; }, ArgumentError::not_finite,
          "odometry row 5");
  refused([](auto& log, auto&) { log.odometry[4].time = 0.0; }, ArgumentError::out_of_range,
          "odometry row 5");
  refused([](auto& log, auto&) { log.sightings[2].landmark = 99; }, ArgumentError::out_of_range,
          "sighting 3");
  refused([](auto& log, auto&) { log.sightings[2].range = 0.0; }, ArgumentError::out_of_range,
          "range");
  refused([](auto& log, auto&) { log.sightings[2].bearing = 40.0; }, ArgumentError::out_of_range,
          "degrees");
  refused([](auto& log, auto&) { log.landmarks[1].position(0) = nan; }, ArgumentError::not_finite,
          "landmark 2");
  for (const double beyond : {1e-300, 1e300}) {
    refused([&](auto&, auto& options) { options.range_std = beyond; }, ArgumentError::out_of_range,
            "range_std");
    refused([&](auto&, auto& options) { options.bearing_std = beyond; },
            ArgumentError::out_of_range, "bearing_std");
  }
  refused([](auto&, auto& options) { options.range_std = 0.0; }, ArgumentError::not_positive,
          "range_std");
  refused([](auto&, auto& options) { options.calibration_std.delay = -1.0; },
          ArgumentError::out_of_range, "delay");
  LandmarkLog blind = drive.log;
  blind.sightings.clear();
  EXPECT_TRUE(
      filter_landmarks(blind, {}, drive.time).error().is(LocalizationError::too_few_sightings));
  EXPECT_TRUE(filter_landmarks(blind, {}, drive.time, drive.truth.front()));
  EXPECT_FALSE(filter_landmarks(drive.log, {}, {1.0, 0.5}));
  EXPECT_FALSE(filter_landmarks(drive.log, {}, {nan}));
  EXPECT_FALSE(smooth_landmarks(LandmarkLog{}, {}, {}));
}

}  // namespace
}  // namespace flyball::localization_test
