#include <flyball/estimation/localization/wheel_log.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "estimation/landmark_drive.hpp"

namespace flyball::wheel_log_test {
namespace {

using test::DriveSettings;
using test::landmark_drive;
using test::SimulatedDrive;

// A quarter of a circle of radius 2 m to the left: v = 1 m/s, w = 0.5 rad/s with wheels 0.8 m
// apart.
TEST(WheelOdometry, IsThatOfTheBook) {
  WheelLog log;
  for (const double t : {0.0, 0.1, 0.1, 0.25, 1.0}) {
    log.wheels.push_back({t, (1.0 - 0.5 * 0.4) * t, (1.0 + 0.5 * 0.4) * t});
  }
  const auto odometry = wheel_odometry(log, 0.8);
  ASSERT_TRUE(odometry) << to_string(odometry.error());
  ASSERT_EQ(odometry->size(), 4U);
  for (const OdometrySample& sample : *odometry) {
    EXPECT_NEAR(sample.velocity, 1.0, 1e-14);
    EXPECT_NEAR(sample.turn_rate, 0.5, 1e-14);
  }
  EXPECT_EQ((*odometry)[1].time, 0.1);
  EXPECT_EQ(odometry->back().time, 1.0);
  // A gyro with times of its own: its mean between two readings of the wheels.
  log.gyro = {{-1.0, 9.0}, {0.0, 0.2}, {0.05, 0.4}, {0.2, 1.0}};
  const auto turned = wheel_odometry(log, 0.0);
  ASSERT_TRUE(turned) << to_string(turned.error());
  EXPECT_NEAR((*turned)[0].turn_rate, 0.3, 1e-14);
  EXPECT_NEAR((*turned)[1].turn_rate, (0.1 * 0.4 + 0.05 * 1.0) / 0.15, 1e-13);
  EXPECT_NEAR((*turned)[2].turn_rate, 1.0, 1e-14);
}

TEST(WheelOdometry, WhatIsNoLogIsRefused) {
  const auto refused = [](const WheelLog& log, double width, ArgumentError code,
                          const char* words) {
    const auto result = wheel_odometry(log, width);
    ASSERT_FALSE(result);
    EXPECT_TRUE(result.error().is(code)) << to_string(result.error());
    EXPECT_NE(to_string(result.error()).find(words), std::string::npos)
        << to_string(result.error());
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused({{{0.0, 0.0, 0.0}, {1.0, nan, 0.0}}, {}}, 0.5, ArgumentError::not_finite, "wheels row 2");
  refused({{{0.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}}, {}}, 0.5, ArgumentError::out_of_range,
          "wheels row 2");
  refused({{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}}, {{0.0, 1.0}, {-1.0, 1.0}}}, 0.5,
          ArgumentError::out_of_range, "gyro row 2");
  refused({{{0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}}, {}}, 0.5, ArgumentError::empty, "two times");
  refused({{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}}, {}}, 0.0, ArgumentError::not_positive,
          "track_width");
}

/// The wheels' distances of a true path: they are `scale` times too short, `width` apart.
WheelLog wheels_of(const SimulatedDrive& drive, double scale, double width) {
  WheelLog log;
  WheelSample now{drive.time.front(), 0.0, 0.0};
  for (std::size_t i = 0; i < drive.time.size(); ++i) {
    if (i > 0) {
      const Eigen::Vector3d moved = drive.truth[i - 1].between(drive.truth[i]).log();
      now.left += (moved(0) - 0.5 * width * moved(2)) / scale;
      now.right += (moved(0) + 0.5 * width * moved(2)) / scale;
    }
    now.time = drive.time[i];
    log.wheels.push_back(now);
  }
  return log;
}

LandmarkOptions options_of(bool gyro) {
  LandmarkOptions options;
  options.calibration.delay = 0.0;
  options.calibration_std.gyro_bias = gyro ? 0.05 : 0.0;
  return options;
}

// Wheels that are 0.55 m apart and 3 % too short, told to be 0.5 m apart: the path says both.
TEST(TrackWidth, IsFoundFromTheWheelsAlone) {
  for (const std::uint64_t seed : {41U, 42U, 43U}) {
    DriveSettings settings{.duration = 120.0};
    settings.calibration.delay = 0.0;
    SimulatedDrive drive = landmark_drive(seed, settings);
    const WheelLog wheels = wheels_of(drive, 1.03, 0.55);
    drive.log.odometry = wheel_odometry(wheels, 0.5).value();
    const auto fit = smooth_landmarks(drive.log, options_of(false), drive.time);
    ASSERT_TRUE(fit) << to_string(fit.error());
    const auto found = track_width(wheels, 0.5, *fit);
    ASSERT_TRUE(found);
    EXPECT_LT(std::abs(found->value - 0.55), 3.0 * found->std);
    EXPECT_LT(found->std, 0.03);
    EXPECT_NEAR(fit->calibration.velocity_scale, 1.03, 0.03);
    EXPECT_NEAR(fit->calibration.gyro_bias, 0.0, 1e-9);
    EXPECT_LT(fit->calibration_std.gyro_bias, 1e-5);
  }
}

// With a gyro that is biased by 0.04 rad/s and reads 4 % too little, the bias is found, and the
// track width beside it.
TEST(TrackWidth, IsFoundBesideABiasedGyro) {
  for (const std::uint64_t seed : {44U, 45U, 46U}) {
    DriveSettings settings{.duration = 120.0};
    settings.calibration.delay = 0.0;
    settings.calibration.turn_scale = 1.04;
    settings.calibration.gyro_bias = 0.04;
    SimulatedDrive drive = landmark_drive(seed, settings);
    WheelLog wheels = wheels_of(drive, 0.98, 0.55);
    for (std::size_t i = 0; i < drive.time.size(); ++i) {
      // What the gyro reads while the robot turns from here to the next sample.
      const std::size_t next = std::min(i + 1, drive.time.size() - 1);
      const double turned = drive.truth[i].between(drive.truth[next]).angle() / 0.01;
      wheels.gyro.push_back({drive.time[i], turned / 1.04 + 0.04});
    }
    drive.log.odometry = wheel_odometry(wheels, 0.0).value();
    const auto fit = smooth_landmarks(drive.log, options_of(true), drive.time);
    ASSERT_TRUE(fit) << to_string(fit.error());
    EXPECT_NEAR(fit->calibration.gyro_bias, 0.04, 3.0 * fit->calibration_std.gyro_bias);
    EXPECT_LT(fit->calibration_std.gyro_bias, 0.025);
    const auto found = track_width(wheels, 0.0, *fit);
    ASSERT_TRUE(found);
    EXPECT_LT(std::abs(found->value - 0.55), 3.0 * found->std);
    EXPECT_LT(found->std, 0.03);
  }
}

TEST(TrackWidth, OfARobotThatNeverTurnedIsUnknown) {
  WheelLog log;
  SmoothedLandmarks fit;
  fit.calibration_covariance.setZero();
  for (int k = 0; k < 500; ++k) {
    log.wheels.push_back({0.1 * k, 0.02 * k, 0.02 * k});
    fit.path.time.push_back(0.1 * k);
    fit.path.pose.emplace_back(0.02 * k, 0.0, 0.0);
  }
  log.gyro = {{0.0, 0.0}};
  EXPECT_FALSE(track_width(log, 0.5, fit));
}

}  // namespace
}  // namespace flyball::wheel_log_test
