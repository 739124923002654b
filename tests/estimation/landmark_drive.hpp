#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/estimation/localization/landmark_log.hpp>
#include <flyball/geometry/se2.hpp>

namespace flyball::test {

/// What a simulated drive among landmarks is like.
struct DriveSettings {
  double duration = 60.0;  ///< s
  SensorCalibration calibration{.velocity_scale = 0.95,
                                .turn_scale = 1.05,
                                .delay = 0.2,
                                .range_scale = 0.015,
                                .depth_exponent = 1.0};
  double range_std = 0.03;    ///< m
  double bearing_std = 0.01;  ///< rad
  double speed_std = 0.02;    ///< m/s, of every hundredth of a second.
  double turn_std = 0.05;     ///< rad/s
  double carried_at = -1.0;   ///< s; then the robot is put elsewhere.
  double mistaken = 0.0;      ///< Share of the sightings that name another landmark.
  bool abrupt = false;        ///< It stops and turns at once, which tells the delay.
};

/// A log and the truth behind it.
struct SimulatedDrive {
  LandmarkLog log{};
  std::vector<double> time{};
  std::vector<Pose2d> truth{};
};

/// Ten landmarks around a field of 8 m x 8 m, a robot that drives rounded loops in it with a sensor
/// that sees 0.7 rad to both sides, a hundred odometry samples and four looks a second.
inline SimulatedDrive landmark_drive(std::uint64_t seed, const DriveSettings& settings = {}) {
  Random random(seed);
  SimulatedDrive drive;
  for (int i = 0; i < 10; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 10.0;
    drive.log.landmarks.push_back({std::to_string(i),
                                   {4.0 * std::cos(angle) + random.uniform(-0.5, 0.5),
                                    4.0 * std::sin(angle) + random.uniform(-0.5, 0.5)}});
  }
  constexpr double dt = 0.01;
  const SensorCalibration& k = settings.calibration;
  Pose2d pose(1.0, 0.0, random.uniform(-3.0, 3.0));
  const int steps = static_cast<int>(settings.duration / dt);
  const double phase = random.uniform(0.0, 6.0);
  const auto commanded = [&](double t) {
    if (settings.abrupt) {
      const double turn = std::fmod(t, 6.0) < 3.0 ? 0.5 : -0.3;
      return std::pair(std::fmod(t, 4.0) < 2.5 ? 0.4 : 0.0, std::fmod(t, 2.0) < 1.0 ? turn : 0.0);
    }
    return std::pair(0.25 + 0.1 * std::sin(0.3 * t + phase),
                     0.35 * std::sin(0.5 * t + phase) + 0.15);
  };
  for (int i = 0; i <= steps; ++i) {
    const double t = dt * i;
    drive.time.push_back(t);
    drive.truth.push_back(pose);
    const auto [v, w] = commanded(t + k.delay);
    drive.log.odometry.push_back({t, v, w});
    if (i % 25 == 12) {
      for (std::size_t j = 0; j < drive.log.landmarks.size(); ++j) {
        const Eigen::Vector2d seen = pose.inverse() * drive.log.landmarks[j].position;
        const double beta = std::atan2(seen(1), seen(0));
        if (std::abs(beta) > 0.7) {
          continue;
        }
        const std::size_t named =
            random.uniform() < settings.mistaken ? (j + 3) % drive.log.landmarks.size() : j;
        drive.log.sightings.push_back(
            {t, named,
             (1.0 + k.range_scale) * seen.norm() * std::pow(std::cos(beta), k.depth_exponent) +
                 k.range_offset + settings.range_std * random.normal(),
             (1.0 + k.bearing_scale) * beta + k.bearing_offset +
                 settings.bearing_std * random.normal()});
      }
    }
    // What the odometry said a delay ago is what the robot does now.
    const auto [vd, wd] = commanded(t);
    const double speed = k.velocity_scale * vd + settings.speed_std * random.normal();
    const double turn = k.turn_scale * (wd - k.gyro_bias) + k.turn_per_velocity * vd +
                        settings.turn_std * random.normal();
    pose = pose * Pose2d::exp(Eigen::Vector3d(speed * dt, 0.0, turn * dt));
    if (settings.carried_at > t - 0.5 * dt && settings.carried_at < t + 0.5 * dt) {
      pose = Pose2d(-pose.x(), -pose.y(), pose.angle() + 2.0);
    }
  }
  return drive;
}

}  // namespace flyball::test
