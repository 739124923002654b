#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <flyball/geometry/se2.hpp>
#include <flyball/systems/model.hpp>

/// Residuals of a drive among landmarks, over a generic scalar, whitened. Errors are (speed, turn
/// rate); calibrations stand in the order of SensorCalibration.
namespace flyball::localization {

/// Beyond this angle off its axis no camera tells a depth.
inline constexpr double least_cosine = 0.1;

/// What the odometry says of the motion between two times.
struct Driven {
  double way, turned;               ///< m and rad, with the delay of `delay`.
  double velocity_gain, turn_gain;  ///< How the rates change from the begin to the end.
  double delay;
  double dt;
};

/// The twist of it, (way, 0, angle), under errors and calibration; linear in the delay.
template <class Errors, class Calibration>
[[nodiscard]] auto twist(const Driven& d, const Errors& e, const Calibration& k) {
  using Scalar = typename Errors::Scalar;
  const Scalar late = k(3) - d.delay;
  const Scalar way = d.way - d.velocity_gain * late;
  const Scalar turned = d.turned - d.turn_gain * late;
  return Eigen::Matrix<Scalar, 3, 1>{k(0) * way + e(0) * d.dt, Scalar(0.0),
                                     k(1) * (turned - k(9) * d.dt) + k(2) * way + e(1) * d.dt};
}

/// The range and the bearing at which a landmark is seen.
template <class Pose, class Calibration>
[[nodiscard]] auto sighting(const Pose& pose, const Calibration& k,
                            const Eigen::Vector2d& landmark) {
  using Scalar = typename Pose::Scalar;
  using std::atan2;
  using std::cos;
  using std::exp;
  using std::log;
  using std::sqrt;
  const Eigen::Matrix<Scalar, 2, 1> off{Scalar(landmark(0)) - pose.x(),
                                        Scalar(landmark(1)) - pose.y()};
  const Eigen::Matrix<Scalar, 2, 1> seen = pose.rotation().inverse() * off;
  const Scalar d = sqrt(seen(0) * seen(0) + seen(1) * seen(1));
  const Scalar beta = atan2(seen(1), seen(0));
  Scalar cosine = cos(beta);
  if (cosine < least_cosine) {
    cosine = Scalar(least_cosine);
  }
  return Eigen::Matrix<Scalar, 2, 1>{(1.0 + k(4)) * d * exp(k(6) * log(cosine)) + k(5),
                                     (1.0 + k(7)) * beta + k(8)};
}

/// Where the robot sees what it measured by range and bearing, in its frame: the inverse of
/// `sighting`.
template <class Calibration, class Reading>
[[nodiscard]] auto seen(const Calibration& k, const Reading& range, const Reading& bearing) {
  using Scalar = ScalarOf<Calibration, Eigen::Matrix<Reading, 1, 1>>;
  using std::cos;
  using std::exp;
  using std::log;
  using std::sin;
  constexpr double least_distance = 0.01;  // m
  const Scalar direction = (bearing - k(8)) / (1.0 + k(7));
  Scalar cosine = cos(direction);
  if (cosine < least_cosine) {
    cosine = Scalar(least_cosine);
  }
  Scalar distance = (range - k(5)) / ((1.0 + k(4)) * exp(k(6) * log(cosine)));
  if (distance < least_distance) {
    distance = Scalar(least_distance);
  }
  return Eigen::Matrix<Scalar, 2, 1>{distance * cos(direction), distance * sin(direction)};
}

/// From one pose to the next by the odometry between them.
struct OdometryResidual {
  Driven driven;
  Eigen::Vector3d inverse_std;

  template <class Pose, class Errors, class Calibration>
  auto operator()(const Pose& from, const Pose& to, const Errors& e, const Calibration& k) const {
    using Scalar = typename Pose::Scalar;
    const Eigen::Matrix<Scalar, 3, 1> r =
        Pose::exp(twist(driven, e, k)).between(from.between(to)).log();
    return Eigen::Matrix<Scalar, 3, 1>{r(0) * inverse_std(0), r(1) * inverse_std(1),
                                       r(2) * inverse_std(2)};
  }
};

/// Errors that decay: e⁺ = stays e + noise.
struct ErrorResidual {
  double stays;
  Eigen::Vector2d inverse_std;

  template <class Errors>
  auto operator()(const Errors& before, const Errors& after) const {
    using Scalar = typename Errors::Scalar;
    return Eigen::Matrix<Scalar, 2, 1>{(after(0) - stays * before(0)) * inverse_std(0),
                                       (after(1) - stays * before(1)) * inverse_std(1)};
  }
};

/// What was known beforehand of a vector.
template <int N>
struct PriorResidual {
  Eigen::Matrix<double, N, 1> mean;
  Eigen::Matrix<double, N, 1> inverse_std;

  template <class Vector>
  auto operator()(const Vector& x) const {
    using Scalar = typename Vector::Scalar;
    Eigen::Matrix<Scalar, N, 1> r;
    for (int i = 0; i < N; ++i) {
      r(i) = (x(i) - mean(i)) * inverse_std(i);
    }
    return r;
  }
};

/// What was known beforehand of a pose.
struct PosePrior {
  Pose2d mean;
  Eigen::Vector3d inverse_std;

  template <class Pose>
  auto operator()(const Pose& x) const {
    using Scalar = typename Pose::Scalar;
    const Eigen::Matrix<Scalar, 3, 1> r = mean.cast<Scalar>().between(x).log();
    return Eigen::Matrix<Scalar, 3, 1>{r(0) * inverse_std(0), r(1) * inverse_std(1),
                                       r(2) * inverse_std(2)};
  }
};

/// A landmark seen from a pose.
struct SightingResidual {
  Eigen::Vector2d landmark;
  double range, bearing;
  double inverse_range_std, inverse_bearing_std;

  template <class Pose, class Calibration>
  auto operator()(const Pose& pose, const Calibration& k) const {
    using Scalar = typename Pose::Scalar;
    const auto expected = sighting(pose, k, landmark);
    return Eigen::Matrix<Scalar, 2, 1>{
        (range - expected(0)) * inverse_range_std,
        angle_difference(Scalar(bearing), Scalar(expected(1))) * inverse_bearing_std};
  }
};

}  // namespace flyball::localization
