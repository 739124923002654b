#pragma once

#include <array>

#include <flyball/control/followers/drive_tracker.hpp>

namespace flyball {

/// Where a differential drive is and how fast its sides are, or are to be.
struct DriveState {
  Pose2d pose{};
  double left = 0.0;   ///< m/s
  double right = 0.0;  ///< m/s
};

/// The state of a drive that tracks a point. @param trackwidth  m.
[[nodiscard]] inline DriveState drive_state(const TrackingPoint& point,
                                            double trackwidth) noexcept {
  const Eigen::Vector2d sides = side_velocities(point.speeds, trackwidth);
  return {point.pose, sides(0), sides(1)};
}

/// The error dynamics of Theorem 8.7.4 at the velocity v = (vl + vr)/2, linearised at θ = 0:
/// x = [x, y, θ, vl, vr] and A of (8.14), B of (8.15). @param v  m/s.
/// @errors ArgumentError::not_positive, not_finite.
[[nodiscard]] Expected<ContinuousSystem<5, 2, 5>> drive_error_dynamics(
    const mechanisms::DifferentialDrive& drive, Length trackwidth, double v);

/// Where the time-varying regulator takes its gain from.
enum class GainSource {
  each_period,  ///< A Riccati equation of five states, solved each period.
  schedule,     ///< A table over the velocity, interpolated.
};

/// What tunes the time-varying drive regulator: Bryson's tolerances, of which infinite ones of the
/// states do not count.
struct LtvDriveSettings {
  double x_tolerance = 0.0625;       ///< m, ahead.
  double y_tolerance = 0.125;        ///< m, across.
  double heading_tolerance = 2.5;    ///< rad
  double velocity_tolerance = 0.95;  ///< m/s, of each side.
  double voltage_tolerance = 12.0;   ///< V
  double voltage_limit = 12.0;       ///< V
  Time period{0.02};                 ///< T > 0.
  LowSpeed low_speed{};
  /// m, > 0: a position that is farther off pulls as one at this distance does. A linear regulator
  /// far from its path asks for more than the limits give, most of it ahead, and cannot turn; the
  /// book's has no such bound.
  double farthest_error = 0.4;
  GainSource source = GainSource::each_period;
  /// m/s: the gain of a faster robot is that of this velocity. Zero: one and a half times what the
  /// voltage limit can reach.
  double largest_velocity = 0.0;
};

/// The linear time-varying differential drive follower: voltages from the whole state,
///
///     u = K(v) [R(θ)ᵀ, 0; 0, I] (r - x) + u_ff                                     (8.16)
///
/// with K(v) the discrete LQR gain of the error dynamics (Theorem 8.7.4) at the robot's velocity
/// v = (vl + vr)/2, and u_ff the drive's plant inversion.
///
/// Under zero-order hold A_d and B_d are affine in v, so only the Riccati equation is left for the
/// loop; K(-v) is K(v) with its cross-track column negated. `schedule` interpolates K linearly
/// over √v instead; `schedule_error` says how far that is off.
///
/// Run-time object: noexcept, allocation-free; finite and within the limit whatever comes. Should
/// a Riccati equation fail, the schedule answers. Source: book, sections 8.7.4 and 8.7.5.
class LtvDriveFollower {
 public:
  using Gain = Eigen::Matrix<double, 2, 5>;
  /// Entries of the schedule: at v_i = low + (largest - low)(i/intervals)².
  static constexpr int intervals = 64;

  /// @errors ArgumentError::not_positive (tolerances, limits, trackwidth, period), out_of_range,
  ///         not_finite; those of `lqr` with the velocity.
  /// Cost: about 130 Riccati equations.
  [[nodiscard]] static Expected<LtvDriveFollower> create(const mechanisms::DifferentialDrive& drive,
                                                         Length trackwidth,
                                                         const LtvDriveSettings& settings = {});

  /// @param x  The estimated state. @param r, r_next  What is to be tracked, now and one period
  /// later.
  [[nodiscard]] DriveCommand calculate(const DriveState& x, const DriveState& r,
                                       const DriveState& r_next) const noexcept;
  /// The same with another feedforward. @param u_ff  V, left and right.
  [[nodiscard]] DriveCommand calculate(const DriveState& x, const DriveState& r,
                                       const Eigen::Vector2d& u_ff) const noexcept;

  /// K, 2 x 5, at a velocity, from the source of the settings. @param v  m/s; NaN is zero.
  [[nodiscard]] Gain K(double v) const noexcept;
  /// The velocities of the schedule, m/s, ascending, and the gains there.
  [[nodiscard]] std::array<double, intervals + 1> schedule_velocities() const noexcept;
  [[nodiscard]] const std::array<Gain, intervals + 1>& schedule() const noexcept {
    return schedule_;
  }
  /// The largest relative error, in the Frobenius norm, of the schedule's gain halfway between its
  /// entries.
  [[nodiscard]] double schedule_error() const noexcept { return schedule_error_; }
  [[nodiscard]] const LtvDriveSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] double trackwidth() const noexcept { return trackwidth_; }
  [[nodiscard]] const DriveInversion& inversion() const noexcept { return inversion_; }

 private:
  LtvDriveFollower(const LtvDriveSettings& settings, double trackwidth,
                   const DriveInversion& inversion)
      : settings_(settings), trackwidth_(trackwidth), inversion_(inversion) {}

  /// A_d and B_d at a velocity.
  [[nodiscard]] Eigen::Matrix<double, 5, 5> A(double v) const noexcept { return A_0_ + v * A_v_; }
  [[nodiscard]] Eigen::Matrix<double, 5, 2> B(double v) const noexcept { return B_0_ + v * B_v_; }
  /// At a speed of the schedule's range.
  [[nodiscard]] Gain scheduled(double speed) const noexcept;
  [[nodiscard]] Gain solved(double speed) const noexcept;

  LtvDriveSettings settings_;
  double trackwidth_;
  DriveInversion inversion_;
  Eigen::Matrix<double, 5, 5> A_0_;
  Eigen::Matrix<double, 5, 5> A_v_;
  Eigen::Matrix<double, 5, 2> B_0_;
  Eigen::Matrix<double, 5, 2> B_v_;
  Eigen::Matrix<double, 5, 5> Q_;
  Eigen::Matrix2d R_;
  std::array<Gain, intervals + 1> schedule_;
  double schedule_error_ = 0.0;
};

}  // namespace flyball
