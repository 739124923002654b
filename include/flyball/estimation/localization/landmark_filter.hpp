#pragma once

#include <array>

#include <flyball/estimation/estimate.hpp>
#include <flyball/estimation/localization/landmark_log.hpp>
#include <flyball/estimation/localization/relocalizer.hpp>
#include <flyball/geometry/bundle.hpp>
#include <flyball/geometry/se2.hpp>

namespace flyball {

/// Odometry and sightings of landmarks, as they come: the pose, with what the sensors' calibration
/// is and what the odometry errs by at the moment. An extended Kalman filter on SE(2) x (velocity
/// and turn error) x calibration; sightings are taken by iterated corrections with Student's noise
/// in place of gates, and a pose that the newest sightings contradict is found anew. By the
/// options' method the unscented or the invariant filter's steps take their place.
///
/// It begins when it has been given a pose (`reset`) or has seen enough landmarks.
/// Run-time object: noexcept, bounded, allocation-free, finite whatever comes.
/// Source: book, sections 9.8 and 10.3; Roth, Ozkan, Gustafsson, "A Student's t filter for heavy
/// tailed process and measurement noise", ICASSP (2013); Barrau, Bonnabel, "The invariant extended
/// Kalman filter as a stable observer", IEEE Trans. Automatic Control 62 (2017).
class LandmarkFilter {
 public:
  using Errors = Eigen::Vector2d;
  using Calibration = Eigen::Matrix<double, SensorCalibration::size, 1>;
  using State = Bundle<Pose2d, Errors, Calibration>;
  static constexpr int size = State::tangent_size;

  /// @errors As `check_landmark_log` for the options.
  [[nodiscard]] static Expected<LandmarkFilter> create(const LandmarkOptions& options = {});

  /// s; what is farther ahead of the filter and of its odometry is another clock's time.
  static constexpr double longest_pause = 3600.0;

  /// A pose to begin, or to go on, with: its standard deviations are the options'.
  /// @return  Whether it was taken: not what is not finite.
  bool reset(const Pose2d& pose) noexcept;
  /// The same at a time, earlier or later: by a clock that was set, or after a long pause. The
  /// odometry so far is forgotten.
  bool reset(const Pose2d& pose, double time) noexcept;
  /// Whether there is a pose.
  [[nodiscard]] bool located() const noexcept { return located_; }

  /// The odometry from now on. @return  Whether it was taken: not what is not finite, older than
  /// the last or `longest_pause` ahead. Of samples that come faster than 4 ms the newest counts.
  bool odometry(double time, double velocity, double turn_rate) noexcept;
  /// Goes on to a time. @return  Whether it did: times before that of now are left out, and those
  /// more than `longest_pause` after it and after the odometry.
  bool predict(double time) noexcept;
  /// What a sighting did. @param landmark  Where the landmark is, m. @param time  s; a sighting
  /// before the filter's time counts as one of now, one after it predicts. What is not finite, or
  /// farther ahead than `longest_pause`, changes nothing.
  Correction<2> sighting(double time, const Eigen::Vector2d& landmark, double range,
                         double bearing) noexcept;

  [[nodiscard]] double time() const noexcept { return time_; }
  [[nodiscard]] const Pose2d& pose() const noexcept { return estimate_.x_hat().get<0>(); }
  /// Of the pose's error, in its own frame.
  [[nodiscard]] Eigen::Matrix3d pose_covariance() const noexcept {
    return estimate_.P().topLeftCorner<3, 3>();
  }
  [[nodiscard]] SensorCalibration calibration() const noexcept {
    return SensorCalibration::from(estimate_.x_hat().get<2>());
  }
  [[nodiscard]] const Estimate<State>& estimate() const noexcept { return estimate_; }
  /// The pose by odometry alone, from the origin.
  [[nodiscard]] const Pose2d& dead_reckoned() const noexcept { return dead_reckoned_; }
  /// How often the pose was found anew, the first time included if it was not given.
  [[nodiscard]] int relocalizations() const noexcept { return relocalizations_; }

 private:
  LandmarkFilter(const LandmarkOptions& options, const OutlierGuard& guard) noexcept;

  /// The way driven and turned by the odometry until a time, and its rates there.
  struct Driven {
    double way = 0.0, turned = 0.0, velocity = 0.0, turn_rate = 0.0;
    bool missing = false;  ///< No odometry for longer than a gap.
  };
  [[nodiscard]] Driven driven(double time) const noexcept;
  [[nodiscard]] bool is_near(double time) const noexcept;
  void step(double from, double to) noexcept;
  Correction<2> take(Estimate<State>& estimate, const Eigen::Vector2d& landmark,
                     const Eigen::Vector2d& reading) noexcept;
  void relocalize() noexcept;

  static constexpr int memory = 512;  ///< Of samples: 2 s at 250 Hz.
  LandmarkOptions options_;
  Estimate<State> estimate_;
  OutlierGuard guard_;
  MeasurementNoise<2> noise_;
  Relocalizer relocalizer_;
  Pose2d dead_reckoned_;
  struct Sample {
    double time, way, turned, velocity, turn_rate;
  };
  std::array<Sample, memory> samples_{};
  int next_sample_ = 0;
  int sample_count_ = 0;
  double time_ = 0.0;
  bool started_ = false;
  bool located_ = false;
  int relocalizations_ = 0;
};

}  // namespace flyball
