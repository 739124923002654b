#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>

/// A robot among known landmarks: what it recorded, and what is assumed of its sensors.
namespace flyball {

/// Odometry that holds until the next sample.
struct OdometrySample {
  double time = 0.0;       ///< s
  double velocity = 0.0;   ///< m/s, forward.
  double turn_rate = 0.0;  ///< rad/s, counter-clockwise.
};

/// Something whose place is known.
struct Landmark {
  std::string name{};
  Eigen::Vector2d position{0.0, 0.0};  ///< m
};

/// A landmark as a sensor of the robot saw it.
struct Sighting {
  double time = 0.0;         ///< s
  std::size_t landmark = 0;  ///< Which.
  double range = 0.0;        ///< m
  double bearing = 0.0;      ///< rad, from the robot's forward axis, counter-clockwise.
};

/// One drive.
struct LandmarkLog {
  std::vector<OdometrySample> odometry{};  ///< Times do not fall.
  std::vector<Sighting> sightings{};       ///< Times do not fall.
  std::vector<Landmark> landmarks{};
};

/// What is constant about a robot's sensors but not known beforehand. With the true speed and turn
/// rate V, W, the odometry's v, w and the landmark's true distance d and direction β,
///
///     V(t) = velocity_scale v(t - delay)
///     W(t) = turn_scale (w(t - delay) - gyro_bias) + turn_per_velocity v(t - delay)
///     range = (1 + range_scale) d cosᵖ β + range_offset,  p = depth_exponent
///     bearing = (1 + bearing_scale) β + bearing_offset.
///
/// A laser or a radio measures the distance (p = 0); a camera that tells how far a mark is from its
/// size in the image measures the depth along its axis (p = 1), which is 12 % less at half a
/// radian.
struct SensorCalibration {
  static constexpr int size = 10;

  double velocity_scale = 1.0;
  double turn_scale = 1.0;
  double turn_per_velocity = 0.0;  ///< rad/m
  double delay = 0.0;              ///< s; by how much the odometry leads the sightings.
  double range_scale = 0.0;
  double range_offset = 0.0;  ///< m
  double depth_exponent = 0.0;
  double bearing_scale = 0.0;
  double bearing_offset = 0.0;  ///< rad
  double gyro_bias = 0.0;       ///< rad/s; what the turn rate reads at rest.

  /// All of them, in this order.
  [[nodiscard]] Eigen::Matrix<double, size, 1> vector() const;
  [[nodiscard]] static SensorCalibration from(const Eigen::Matrix<double, size, 1>& values);
  struct Name {
    std::string_view name;
    std::string_view unit;
  };
  /// What they are called and in which unit, in this order.
  [[nodiscard]] static const Name& name(int index);
};

/// How a LandmarkFilter takes its steps; the model and what becomes of outliers are the same.
enum class LandmarkFilterMethod {
  extended,   ///< Exact Jacobians of range and bearing, iterated.
  unscented,  ///< The unscented transform of the motion and of range and bearing.
  /// The landmark where the robot sees it, against where it is: of a pose whose error is in the
  /// fixed frame the slope of that does not depend on the estimate.
  invariant,
};

/// What is assumed of a robot: one set of numbers serves drives of small wheeled robots of a kind.
struct LandmarkOptions {
  LandmarkFilterMethod method = LandmarkFilterMethod::extended;
  SensorCalibration calibration{.delay = 0.15, .depth_exponent = 0.5};  ///< Expected beforehand.
  /// Standard deviations of that; a zero keeps a value as it is.
  SensorCalibration calibration_std{.velocity_scale = 0.05,
                                    .turn_scale = 0.1,
                                    .turn_per_velocity = 0.1,
                                    .delay = 0.1,
                                    .range_scale = 0.03,
                                    .range_offset = 0.03,
                                    .depth_exponent = 0.5,
                                    .bearing_scale = 0.03,
                                    .bearing_offset = 0.02,
                                    .gyro_bias = 0.005};
  /// Of a sighting, per sighting. Errors of neighbouring sightings are alike, so that they tell
  /// less than they would if they were independent: larger than the scatter.
  double range_std = 0.1;     ///< m
  double bearing_std = 0.03;  ///< rad
  double freedom = 2.0;       ///< ν of Student's distribution of a sighting's error, at least 1.
  /// Of the odometry: white errors of speed, of side slip and of turning, relative ones, and errors
  /// that last for a while (first-order Gauss-Markov).
  double velocity_density = 0.03;   ///< m/s/√Hz
  double slip_density = 0.01;       ///< m/√m, across, by the way driven.
  double turn_density = 0.02;       ///< rad/s/√Hz
  double relative_density = 0.2;    ///< Of the speed and of the turn rate, /√Hz
  double velocity_error = 0.01;     ///< m/s
  double turn_error = 0.1;          ///< rad/s
  double error_time = 0.4;          ///< s
  double standstill = 0.05;         ///< Share of these errors while the odometry is zero.
  double longest_gap = 0.3;         ///< s; where odometry is missing longer than this, the speed
  double gap_velocity_error = 0.1;  ///< is wrong by so much, m/s,
  double gap_turn_error = 0.4;      ///< and the turn rate by so much, rad/s.
  double position_std = 0.1;        ///< m, of a pose given at the start
  double heading_std = 0.1;         ///< rad, of that.
  /// Whether a pose that the last sightings contradict is found anew from them.
  bool relocalize = true;
};

/// The log and the options make sense together.
/// @errors ArgumentError: not_finite, unordered times, an hour between two rows of odometry or
///         between a sighting and the odometry, an unknown landmark, a range that is not positive,
///         a bearing beyond ±2π, a standard deviation that is not positive; each with the row.
[[nodiscard]] Expected<void> check_landmark_log(const LandmarkLog& log,
                                                const LandmarkOptions& options);

}  // namespace flyball
