#pragma once

#include <optional>

#include <flyball/control/followers/follower.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

namespace flyball {

/// What tunes the follower of a holonomic robot: Bryson's tolerances, of which infinite ones of the
/// pose do not count.
struct HolonomicSettings {
  double x_tolerance = 0.05;                ///< m, in the field.
  double y_tolerance = 0.05;                ///< m, in the field.
  double heading_tolerance = 0.1;           ///< rad
  double velocity_tolerance = 0.5;          ///< m/s
  double angular_velocity_tolerance = 1.0;  ///< rad/s
  Time period{0.02};                        ///< T > 0.
  /// Limits of the heading's own profile. Without them the heading of the reference is tracked as
  /// it comes; with them the robot turns to it, the shorter way, at no more than these.
  std::optional<MotionLimits> heading_profile{};
  SpeedLimits limits{};  ///< `velocity` of the robot in any direction, and `angular_velocity`.
};

/// The follower of a robot that moves in any direction (swerve, mecanum): the error of the global
/// pose is three integrators (8.5), each with its own discrete LQR gain,
///
///     (v_x, v_y, ω)_field = R(θ_r) v_r + diag(k_x, k_y, k_θ)(r - x),
///
/// and (8.6) turns the velocity into the robot's frame; inverse kinematics make wheels of it. The
/// heading's error is continuous, that of the shorter way; where `heading_profile` is set, the
/// heading that is tracked is a trapezoid profile's, which starts where the robot is.
///
/// Run-time object: noexcept, allocation-free; finite and within the limits whatever comes.
/// Source: book, section 8.6.2.
class HolonomicFollower {
 public:
  /// @errors ArgumentError::not_positive (tolerances, period, limits), out_of_range, not_finite.
  [[nodiscard]] static Expected<HolonomicFollower> create(const HolonomicSettings& settings = {});

  /// @param pose  The estimated pose. @param r  What is to be tracked: its velocity in its own
  /// frame, which need not be the way the robot looks.
  FollowerCommand calculate(const Pose2d& pose, const TrackingPoint& r) noexcept;

  /// Forgets the heading's profile: the next one starts where the robot is then.
  void reset() noexcept { heading_.reset(); }
  /// The heading that was tracked last: of the profile, or of the reference; position in rad.
  [[nodiscard]] std::optional<MotionState> heading() const noexcept { return heading_; }
  /// (k_x, k_y, k_θ), 1/s.
  [[nodiscard]] const Eigen::Vector3d& gains() const noexcept { return gains_; }
  [[nodiscard]] const HolonomicSettings& settings() const noexcept { return settings_; }

 private:
  explicit HolonomicFollower(const HolonomicSettings& settings) noexcept;
  [[nodiscard]] MotionState next_heading(double measured, double wanted,
                                         double wanted_rate) noexcept;

  HolonomicSettings settings_;
  Eigen::Vector3d gains_;
  std::optional<MotionState> heading_{};  ///< Of the period that was answered.
};

}  // namespace flyball
