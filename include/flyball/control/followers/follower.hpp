#pragma once

#include <concepts>
#include <limits>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/geometry/se2.hpp>
#include <flyball/mechanisms/kinematics/chassis_speeds.hpp>
#include <flyball/planning/trajectory/trajectory.hpp>

/// What all path followers share: what they are asked to track, what they answer, and the limits
/// that their answers keep.
namespace flyball {

/// Where a robot is to be at one instant, and how it moves there: what a follower tracks.
struct TrackingPoint {
  Pose2d pose{};                       ///< In the field.
  mechanisms::ChassisSpeeds speeds{};  ///< In the frame of that pose: v_d is vx, ω_d omega.
};

/// A point of a trajectory as a follower takes it: v_d along the path and ω_d = v_d κ.
[[nodiscard]] inline TrackingPoint tracking_point(const TrajectoryPoint& point) noexcept {
  return {point.pose, {point.velocity, 0.0, point.velocity * point.curvature}};
}

/// How an answer came about, the gravest reason first.
enum class FollowerStatus {
  no_reference,  ///< The reference is not of finite numbers: the command is to stand still.
  no_pose,       ///< What was measured is not of finite numbers: the command is the reference's own
                 ///< motion, without feedback.
  saturated,     ///< The control law asks for more than the limits; the command is within them.
  tracking,      ///< The control law's command.
};
/// "tracking", "saturated", …
[[nodiscard]] const char* to_string(FollowerStatus status) noexcept;

/// What a follower answers: finite and within its limits, whatever it is given.
struct FollowerCommand {
  mechanisms::ChassisSpeeds speeds{};  ///< In the robot's frame.
  FollowerStatus status = FollowerStatus::tracking;
};

/// A follower of poses: one call a period, with the estimated pose and what is to be tracked.
template <class F>
concept PoseFollower = requires(F& follower, const Pose2d& pose, const TrackingPoint& r) {
  { follower.calculate(pose, r) } noexcept -> std::same_as<FollowerCommand>;
};

/// The tracking error in the robot's frame (8.24): (e_x ahead, e_y to the left, e_θ),
///
///     e = [cos θ, sin θ, 0; -sin θ, cos θ, 0; 0, 0, 1] (r - x),    e_θ in [-π, π].
///
/// @param pose  Where the robot is. @param r  Where it is to be. @return m, m, rad. Noexcept,
/// allocation-free.
[[nodiscard]] Eigen::Vector3d tracking_error(const Pose2d& pose, const Pose2d& r) noexcept;

/// Where a robot is that was at a pose a while ago and moves on as it did: x Exp(v dt). What is
/// seen or acted on late is followed better from where the robot will be.
/// @param speeds  In the robot's frame, measured. @param delay  s. @return The pose itself where
/// speeds or delay are not finite numbers. Noexcept, allocation-free.
[[nodiscard]] Pose2d pose_after(const Pose2d& pose, const mechanisms::ChassisSpeeds& speeds,
                                double delay) noexcept;

/// The error with its position no farther than that, in its direction. @param distance  m, > 0.
[[nodiscard]] Eigen::Vector3d no_farther(const Eigen::Vector3d& error, double distance) noexcept;

/// How near a reference counts as at it.
struct PoseTolerance {
  double x = 0.05;        ///< m, ahead or behind.
  double y = 0.05;        ///< m, across.
  double heading = 0.05;  ///< rad
};
/// Whether an error is within a tolerance; false for what is not a number. @param error  As
/// `tracking_error` gives it.
[[nodiscard]] bool within_tolerance(const Eigen::Vector3d& error,
                                    const PoseTolerance& tolerance) noexcept;
/// Whether a robot is at a pose.
[[nodiscard]] inline bool at_reference(const Pose2d& pose, const Pose2d& r,
                                       const PoseTolerance& tolerance) noexcept {
  return within_tolerance(tracking_error(pose, r), tolerance);
}

/// What a robot's motion must not exceed. Each is positive; infinite ones count as
/// `largest_signal`.
struct SpeedLimits {
  double velocity = std::numeric_limits<double>::infinity();          ///< m/s
  double angular_velocity = std::numeric_limits<double>::infinity();  ///< rad/s
  /// m/s, of each wheel of a differential drive of this trackwidth: |v| + |ω| trackwidth/2.
  double wheel_velocity = std::numeric_limits<double>::infinity();
  double trackwidth = 0.0;  ///< m, not negative.

  /// v and ω of a robot that cannot move sideways, scaled by one factor until they keep the limits:
  /// the robot stays on the arc that was meant. NaN is zero. @param saturated  Set where it scaled.
  [[nodiscard]] mechanisms::ChassisSpeeds on_arc(double v, double omega,
                                                 bool& saturated) const noexcept;
  /// Speeds of a robot that moves in any direction: the velocity scaled, its direction kept, and ω
  /// cut. NaN is zero.
  [[nodiscard]] mechanisms::ChassisSpeeds in_any_direction(const mechanisms::ChassisSpeeds& speeds,
                                                           bool& saturated) const noexcept;
};

/// What a time-varying regulator does about the robot's standing still, where no input moves it
/// sideways and its cross-track gain has two limits, ±, from the two sides.
struct LowSpeed {
  /// What becomes of the cross-track gain below `velocity`.
  enum class CrossTrack {
    fades,  ///< Goes to zero with the speed: a robot at rest does not turn for what turning in
            ///< place cannot mend.
    holds,  ///< Stays as at `velocity`, as the book has it: a linearisation "around a slightly
            ///< nonzero velocity instead"; zero counts as forward.
  };
  double velocity = 0.1;  ///< m/s, > 0.
  CrossTrack cross_track = CrossTrack::fades;
};

/// Watches a follower's error: says when it has settled, and when it has left the region in which
/// it is known to come back, so that nothing diverges unseen. Run-time object: noexcept,
/// allocation-free.
class TrackingMonitor {
 public:
  /// What it watches for.
  struct Settings {
    PoseTolerance tolerance{};            ///< Settled within it
    double hold_time = 0.1;               ///< s, for so long, not negative.
    double distance = 1.0;                ///< m, > 0: farther from the reference is lost.
    double heading = 1.5707963267948966;  ///< rad, > 0; so is a larger error of the heading.
  };
  /// What it says.
  enum class State { following, settled, lost };

  /// @errors ArgumentError::not_positive, out_of_range, not_finite.
  [[nodiscard]] static Expected<TrackingMonitor> create(const Settings& settings);

  /// @param error  As `tracking_error` gives it; one that is not of numbers is lost. @param dt  s
  /// since the last one.
  State update(const Eigen::Vector3d& error, double dt) noexcept;
  [[nodiscard]] State state() const noexcept { return state_; }
  /// Starts anew.
  void reset() noexcept;

 private:
  explicit TrackingMonitor(const Settings& settings) noexcept : settings_(settings) {}

  Settings settings_;
  double within_ = -1.0;  ///< s for which it has been within the tolerance; negative: it is not.
  State state_ = State::following;
};

namespace detail {

/// @errors ArgumentError::not_positive and not_finite, for the limits' own constraints.
[[nodiscard]] Expected<void> check_speed_limits(const SpeedLimits& limits, std::string_view where);
[[nodiscard]] Expected<void> check_farthest(double distance, std::string_view where);
[[nodiscard]] Expected<void> check_low_speed(const LowSpeed& low, std::string_view where);
/// A tolerance of Bryson's rule as the weight 1/tolerance²; infinite is 0.
[[nodiscard]] Expected<void> check_tolerance(double tolerance, std::string_view where,
                                             std::string_view name, std::string_view unit);
/// Whether its numbers are signals.
[[nodiscard]] bool known(const Pose2d& pose) noexcept;
[[nodiscard]] bool known(const TrackingPoint& r) noexcept;
/// The discrete regulator of an integrator, x₊ = x + T u, for Q = 1/x², R = 1/u²:
/// k T = m/(√(m + m²/4) + m/2) with m = Q T²/R, the stable root of the reciprocal polynomial.
[[nodiscard]] double integrator_gain(double x_tolerance, double u_tolerance,
                                     double period) noexcept;

}  // namespace detail

}  // namespace flyball
