#pragma once

#include <flyball/control/followers/follower.hpp>

namespace flyball {

/// What tunes Ramsete. The units are those of section 8.8.3, (8.31) and (8.32), with which every
/// term of the law has the unit of its side: k is 1/s, sinc is 1/rad.
struct RamseteSettings {
  double b = 2.0;     ///< rad²/m², > 0: larger converges more aggressively, like proportional gain.
  double zeta = 0.7;  ///< 1/rad, between 0 and 1: larger damps more.
  SpeedLimits limits{};
};

/// Ramsete, a nonlinear time-varying follower for robots that move like a unicycle:
///
///     v = v_d cos e_θ + k e_x
///     ω = ω_d + k e_θ + b v_d sinc(e_θ) e_y,    k = 2ζ √(ω_d² + b v_d²),  sinc e = sin e / e,
///
/// with the error of `tracking_error`. For a reference whose speeds are bounded and do not vanish,
/// e = 0 is asymptotically stable from anywhere on a unicycle without limits: `lyapunov` does not
/// grow along its motion,
/// dV/dt = -k b e_x² - k e_θ² (Theorem 8.8.1). It gives v and ω for a tracker of the wheels'
/// velocities (`DriveVelocityTracker`); a reference at rest (k = 0) has no feedback.
///
/// Run-time object: noexcept, allocation-free; finite and within the limits whatever comes.
/// Source: book, Theorems 8.8.1 and 8.8.2; De Luca, Oriolo, Vendittelli, "Control of Wheeled Mobile
/// Robots: An Experimental Overview", RAMSETE (2001), section 5.
class RamseteFollower {
 public:
  /// @errors ArgumentError::not_positive (b, limits), out_of_range (ζ), not_finite.
  [[nodiscard]] static Expected<RamseteFollower> create(const RamseteSettings& settings = {});

  /// @param pose  The estimated pose. @param r  What is to be tracked; its vy is ignored.
  [[nodiscard]] FollowerCommand calculate(const Pose2d& pose,
                                          const TrackingPoint& r) const noexcept;

  /// V = b (e_x² + e_y²)/2 + e_θ²/2, rad². @param error  As `tracking_error` gives it.
  [[nodiscard]] double lyapunov(const Eigen::Vector3d& error) const noexcept {
    return 0.5 * (settings_.b * (error(0) * error(0) + error(1) * error(1)) + error(2) * error(2));
  }
  /// dV/dt = -k (b e_x² + e_θ²), rad²/s, of a unicycle that moves as it is told.
  [[nodiscard]] double lyapunov_rate(const Eigen::Vector3d& error,
                                     const TrackingPoint& r) const noexcept;

  [[nodiscard]] const RamseteSettings& settings() const noexcept { return settings_; }

 private:
  explicit RamseteFollower(const RamseteSettings& settings) noexcept : settings_(settings) {}
  /// (8.27), 1/s.
  [[nodiscard]] double gain(double v_d, double omega_d) const noexcept;

  RamseteSettings settings_;
};

}  // namespace flyball
