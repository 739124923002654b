#pragma once

#include <flyball/control/followers/follower.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/differential_drive.hpp>

namespace flyball {

/// What a differential drive is told, V.
struct DriveCommand {
  Eigen::Vector2d voltage = Eigen::Vector2d::Zero();  ///< Left, right.
  FollowerStatus status = FollowerStatus::tracking;
};

/// The voltages that are wanted, by one factor brought within ±limit: the ratio of the sides stays,
/// and with it the way the robot turns. NaN is zero. @param limit  V, > 0.
/// @param saturated  Set where it scaled.
[[nodiscard]] Eigen::Vector2d within_voltage(const Eigen::Vector2d& voltage, double limit,
                                             bool& saturated) noexcept;

/// Plant inversion of a drive's velocities, with its friction:
/// u = B_d⁻¹(r_{k+1} - A_d r_k) + kS sgn(r_{k+1}).
///
/// Run-time object: noexcept, allocation-free. Source: book, Theorem 7.8.1 on Theorem 8.7.1.
class DriveInversion {
 public:
  /// @errors Those of the discretisation; ArgumentError::out_of_range where B has no inverse.
  [[nodiscard]] static Expected<DriveInversion> create(const mechanisms::DifferentialDrive& drive,
                                                       Time period);
  /// @param r, r_next  m/s, left and right, now and one period later. @return V; zero where it is
  /// not a finite number.
  [[nodiscard]] Eigen::Vector2d calculate(const Eigen::Vector2d& r,
                                          const Eigen::Vector2d& r_next) const noexcept;
  /// The discrete plant, 2 x 2 each.
  [[nodiscard]] const Eigen::Matrix2d& A() const noexcept { return A_; }
  [[nodiscard]] const Eigen::Matrix2d& B() const noexcept { return B_; }
  [[nodiscard]] const Eigen::Matrix2d& B_inverse() const noexcept { return B_inverse_; }
  [[nodiscard]] const Eigen::Vector2d& kS() const noexcept { return kS_; }  ///< V

 private:
  DriveInversion(const Eigen::Matrix2d& A, const Eigen::Matrix2d& B, const Eigen::Vector2d& kS);

  Eigen::Matrix2d A_;
  Eigen::Matrix2d B_;
  Eigen::Matrix2d B_inverse_;
  Eigen::Vector2d kS_;
};

/// What tunes the tracker of the sides' velocities.
struct DriveTrackerSettings {
  double velocity_tolerance = 0.95;  ///< m/s, of each side (Bryson's rule).
  double voltage_tolerance = 12.0;   ///< V
  double voltage_limit = 12.0;       ///< V
  Time period{0.02};                 ///< T > 0.
};

/// What follows the velocities that Ramsete, the unicycle regulator and pure pursuit ask for:
/// u = K (r - x) + u_ff, K the discrete LQR gain of the drive's velocities (Theorem 8.7.1) and u_ff
/// its plant inversion, by one factor within ±voltage_limit.
///
/// Run-time object: noexcept, allocation-free; finite and within the limit whatever comes: a
/// velocity that is not a finite number has no feedback, a reference that is not stands still.
/// Source: book, sections 8.7.1 and 8.8.2.
class DriveVelocityTracker {
 public:
  /// @errors ArgumentError::not_positive, not_finite; those of `lqr`.
  [[nodiscard]] static Expected<DriveVelocityTracker> create(
      const mechanisms::DifferentialDrive& drive, const DriveTrackerSettings& settings = {});

  /// @param x  m/s, the sides' measured velocities. @param r, r_next  m/s, what they are to be now
  /// and one period later; a follower that knows only what is now gives it twice.
  [[nodiscard]] DriveCommand calculate(const Eigen::Vector2d& x, const Eigen::Vector2d& r,
                                       const Eigen::Vector2d& r_next) const noexcept;

  [[nodiscard]] const Eigen::Matrix2d& K() const noexcept { return K_; }
  [[nodiscard]] const DriveInversion& inversion() const noexcept { return inversion_; }
  [[nodiscard]] const DriveTrackerSettings& settings() const noexcept { return settings_; }

 private:
  DriveVelocityTracker(const DriveTrackerSettings& settings, const DriveInversion& inversion,
                       const Eigen::Matrix2d& K)
      : settings_(settings), inversion_(inversion), K_(K) {}

  DriveTrackerSettings settings_;
  DriveInversion inversion_;
  Eigen::Matrix2d K_;
};

/// The sides' velocities of a robot's motion, v ∓ ω trackwidth/2. @param trackwidth  m.
[[nodiscard]] inline Eigen::Vector2d side_velocities(const mechanisms::ChassisSpeeds& speeds,
                                                     double trackwidth) noexcept {
  const double turning = 0.5 * trackwidth * speeds.omega;
  return {speeds.vx - turning, speeds.vx + turning};
}

}  // namespace flyball
