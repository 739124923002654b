#pragma once

#include <initializer_list>
#include <optional>
#include <span>

#include <flyball/estimation/delayed_filter.hpp>
#include <flyball/estimation/pose_filter.hpp>

namespace flyball {

namespace detail {

/// The judge that the options describe. @errors As BasicPoseEstimator::create.
[[nodiscard]] Expected<OutlierGuard> pose_guard(const PoseEstimatorOptions& options, double start);

}  // namespace detail

/// Where a robot is on its field: odometry, corrected by poses that cameras see, by a heading and
/// by known landmarks. An extended Kalman filter on SE(2) with the full covariance of the pose's
/// error, in the robot's frame (x = x_hat Exp(e): forward, left, heading).
///
/// Measurements come late and in any order: the last `Capacity` predictions and measurements are
/// kept, and what comes late is taken at its time and all that was after it again, so that the
/// result is that of the same measurements in their order. One that does not fit is left out, or
/// counts for less; poses that do not fit but agree with each other replace the estimate (a robot
/// that was carried away, or began elsewhere than it was told).
///
/// The order of calls is free: a measurement before the first prediction is one of the start; those
/// of one time are taken as they come; one later than the last prediction, or older than the
/// history, is refused (`in_the_future`: predict first), as is what is not finite, and changes
/// nothing. After `reset`, at any time, there is nothing before it.
///
/// @tparam Capacity  Predictions and measurements that are kept, together.
/// Run-time object: noexcept, allocation-free, finite whatever comes. Cost: a prediction one step
/// of the filter, a measurement at most `Capacity` steps and corrections.
/// Source: book, sections 9.8 and 10.3; Sola, Deray, Atchuthan, "A micro Lie theory for state
/// estimation in robotics" (2018), section V.
template <std::size_t Capacity>
class BasicPoseEstimator {
 public:
  /// @param start  s, the clock's time at which the robot is at `pose`.
  /// @param pose   m and rad, on the field. @param P  3 x 3, of its error, in its own frame.
  /// @errors Those of P's maker; ArgumentError::not_finite, out_of_range for an option or the
  ///         start; wrong_shape, not_symmetric, not_positive for P.
  [[nodiscard]] static Expected<BasicPoseEstimator> create(
      double start, const Pose2d& pose, const Covariance& P,
      const PoseEstimatorOptions& options = {}) {
    return detail::pose_guard(options, start).and_then([&](const OutlierGuard& guard) {
      return Estimate<Pose2d>::create(pose, P).map([&](const Estimate<Pose2d>& estimate) {
        return BasicPoseEstimator(
            detail::PoseFilter(detail::PoseBelief{estimate, estimate}, options, guard), start);
      });
    });
  }

  /// The robot has moved. @param time  s. @param twist  Since the last prediction, in the robot's
  /// frame of then (m forward, m left, rad): what the wheels and the gyro tell, x <- x Exp(twist).
  /// @return  taken, not_finite, in_the_past. A motion in no time joins that of the next time.
  PoseStatus predict(double time, const Eigen::Vector3d& twist) noexcept {
    if (!is_signal(time) || !is_signal(twist)) {
      return PoseStatus::not_finite;
    }
    const double dt = time - now();
    if (dt < 0.0) {
      return PoseStatus::in_the_past;
    }
    const Eigen::Vector3d moved = joined(twist);
    if (dt == 0.0) {
      waiting_ = is_signal(moved) ? moved : waiting_;
      return is_signal(moved) ? PoseStatus::taken : PoseStatus::not_finite;
    }
    const Eigen::Vector3d rate = moved / dt;
    if (!is_signal(rate)) {
      return PoseStatus::not_finite;
    }
    history_.advance(time, rate);
    waiting_.setZero();
    return PoseStatus::taken;
  }

  /// A pose that was seen, y = x Exp(v). @param time  s, when the picture was taken.
  /// @param noise  Of v ~ N(0, R): forward and left, m, and heading, rad, in the robot's frame;
  ///               where both directions are as good, any frame's.
  PoseOutcome correct(double time, const Pose2d& seen, const MeasurementNoise<3>& noise) noexcept {
    return correct(time, std::span<const Pose2d>(&seen, 1), noise);
  }
  /// The same with independent errors. @param sigmas  m, m, rad: standard deviations.
  PoseOutcome correct(double time, const Pose2d& seen, const Eigen::Vector3d& sigmas) noexcept {
    return correct(time, seen, independent<3>(sigmas));
  }
  /// One of several poses, such as the two that one flat tag allows: the likeliest is taken, none
  /// where another one is about as likely. @param candidates  1 to `max_pose_candidates`, what the
  /// camera itself takes for likeliest first.
  PoseOutcome correct(double time, std::span<const Pose2d> candidates,
                      const MeasurementNoise<3>& noise) noexcept {
    PoseOutcome outcome;
    if (candidates.empty() || candidates.size() > max_pose_candidates) {
      outcome.status = PoseStatus::invalid_candidates;
      return outcome;
    }
    detail::SeenPose seen{{}, candidates.size(), noise};
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      if (!is_pose(candidates[k])) {
        return outcome;
      }
      seen.candidates[k] = candidates[k];
    }
    return measure(time, seen);
  }
  PoseOutcome correct(double time, std::initializer_list<Pose2d> candidates,
                      const MeasurementNoise<3>& noise) noexcept {
    return correct(time, std::span<const Pose2d>(candidates.begin(), candidates.size()), noise);
  }
  /// A heading on the field: of a compass, or a gyro that was set there. What a gyro turns between
  /// two loops belongs into the twist. @param angle  rad, any turn. @param sigma  rad.
  PoseOutcome correct_heading(double time, double angle, double sigma) noexcept {
    if (!is_signal(angle)) {
      return {};
    }
    return measure(time,
                   detail::SeenHeading{angle, independent<1>(Eigen::Matrix<double, 1, 1>(sigma))});
  }
  /// A known landmark that was seen. @param landmark  Where it is on the field, m. @param range  m.
  /// @param bearing  rad, from the robot's heading, left positive. @param sigmas  m, rad.
  PoseOutcome correct_sighting(double time, const Eigen::Vector2d& landmark, double range,
                               double bearing, const Eigen::Vector2d& sigmas) noexcept {
    if (!is_signal(landmark) || !is_signal(range) || !is_signal(bearing)) {
      return {};
    }
    return measure(time, detail::SeenLandmark{landmark, range, bearing, independent<2>(sigmas)});
  }

  /// The robot is at a pose from now on, or from `time` on, and what was before is forgotten.
  /// @param P  3 x 3, as in `create`. @return  Whether it was taken.
  bool reset(double time, const Pose2d& pose, const Eigen::Matrix3d& P) noexcept {
    detail::PoseBelief belief = belief_now();
    if (!is_signal(time) || !is_pose(pose) || !belief.estimate.reset(pose, P)) {
      return false;
    }
    belief.agreed = 0;
    history_.reset(belief, time);
    waiting_.setZero();
    return true;
  }
  bool reset(const Pose2d& pose, const Eigen::Matrix3d& P) noexcept {
    return reset(now(), pose, P);
  }

  /// s, of the last prediction.
  [[nodiscard]] double now() const noexcept { return history_.now(); }
  /// s, the oldest time of which a measurement is taken.
  [[nodiscard]] double oldest() const noexcept { return history_.oldest(); }
  [[nodiscard]] const Pose2d& pose() const noexcept { return belief_now().estimate.x_hat(); }
  /// Of the pose's error, in the robot's frame.
  [[nodiscard]] const Eigen::Matrix3d& covariance() const noexcept {
    return belief_now().estimate.P();
  }
  /// How often poses that had been rejected have replaced the estimate.
  [[nodiscard]] int relocations() const noexcept { return belief_now().relocations; }
  /// The pose at a time between `oldest` and `now`, from what was measured up to it, on the arc
  /// that was driven there; none at other times. @param time  s.
  [[nodiscard]] std::optional<Pose2d> sample(double time) const noexcept {
    const auto belief = history_.at(time);
    return belief ? std::optional<Pose2d>(belief->estimate.x_hat()) : std::nullopt;
  }

 private:
  BasicPoseEstimator(const detail::PoseFilter& filter, double start) noexcept
      : history_(filter, start) {}

  [[nodiscard]] const detail::PoseBelief& belief_now() const noexcept {
    return history_.filter().estimate();
  }
  [[nodiscard]] static bool is_pose(const Pose2d& pose) noexcept {
    const double c = pose.rotation().cos();
    const double s = pose.rotation().sin();
    return is_signal(pose.translation()) && std::abs(c * c + s * s - 1.0) < 1e-6;
  }
  template <int M>
  [[nodiscard]] static MeasurementNoise<M> independent(
      const Eigen::Matrix<double, M, 1>& sigmas) noexcept {
    // A negative one's variance is negative, so that it is refused.
    return MeasurementNoise<M>::independent(sigmas.cwiseProduct(sigmas.cwiseAbs()));
  }
  /// What waits for time to pass, and then this; turns of less than half a circle.
  [[nodiscard]] Eigen::Vector3d joined(const Eigen::Vector3d& twist) const noexcept {
    return waiting_.isZero(0.0) ? twist : (Pose2d::exp(waiting_) * Pose2d::exp(twist)).log().eval();
  }
  template <class Seen>
  PoseOutcome measure(double time, const Seen& seen) noexcept {
    PoseOutcome outcome;
    if (!seen.noise.usable()) {
      outcome.status = PoseStatus::invalid_noise;
      return outcome;
    }
    const auto of_history = history_.measure(time, detail::PoseMeasurement{seen});
    switch (of_history.status) {
      case DelayStatus::taken:
        outcome = of_history.result;
        outcome.replayed = of_history.replayed;
        break;
      case DelayStatus::too_old:
        outcome.status = PoseStatus::too_old;
        break;
      case DelayStatus::in_the_future:
        outcome.status = PoseStatus::in_the_future;
        break;
      case DelayStatus::in_the_past:
      case DelayStatus::not_finite:
        break;
    }
    return outcome;
  }

  DelayedFilter<detail::PoseFilter, detail::PoseMeasurement, Capacity> history_;
  Eigen::Vector3d waiting_ = Eigen::Vector3d::Zero();
};

/// With a history of 128 samples: at 50 predictions and 30 poses a second, more than 1.5 s.
using PoseEstimator = BasicPoseEstimator<128>;

}  // namespace flyball
