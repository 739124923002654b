#pragma once

#include <flyball/control/followers/follower.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball {

/// What tunes the time-varying unicycle regulator: Bryson's tolerances, of which infinite ones do
/// not count.
struct LtvUnicycleSettings {
  double x_tolerance = 0.0625;              ///< m, ahead.
  double y_tolerance = 0.125;               ///< m, across.
  double heading_tolerance = 2.5;           ///< rad
  double velocity_tolerance = 1.0;          ///< m/s
  double angular_velocity_tolerance = 2.0;  ///< rad/s
  Time period{0.02};                        ///< T > 0.
  LowSpeed low_speed{};
  /// m, > 0: a position that is farther off pulls as one at this distance does. A linear regulator
  /// far from its path asks for more than the limits give, most of it ahead, and cannot turn; the
  /// book's has no such bound.
  double farthest_error = 0.4;
  SpeedLimits limits{};
};

/// The linear time-varying unicycle follower: each period the discrete LQR of the error in the
/// robot's frame, linearised at θ = 0 and the reference's velocity v (Theorem 8.9.1),
///
///     A = [0, 0, 0; 0, 0, v; 0, 0, 0],  B = [1, 0; 0, 0; 0, 1],    (v, ω) = (v_d, ω_d) + K(v) e.
///
/// Under zero-order hold that Riccati equation has a closed form. e_x is an integrator of its own;
/// of e_y and e_θ, with a = ω̄/ȳ and c = ω̄/θ̄ (tolerances), g = a |v| T² and
///
///     n = g/2 + √(4 + c² T²),    h = 2/(n + √(n² - 4)) in (0, 1],
///
///     k_y = sgn(v) a h,    k_θ = √(c² h² + 2 a |v| h).
///
/// So nothing is iterated, tabulated or interpolated, and there is no velocity at which it fails.
///
/// Run-time object: noexcept, allocation-free; finite and within the limits whatever comes.
/// Source: book, Theorem 8.9.1; the closed form: docs/derivations/unicycle-regulator.md.
class LtvUnicycleFollower {
 public:
  using Gain = Eigen::Matrix<double, 2, 3>;

  /// @errors ArgumentError::not_positive (tolerances, period, limits), out_of_range, not_finite.
  [[nodiscard]] static Expected<LtvUnicycleFollower> create(
      const LtvUnicycleSettings& settings = {});

  /// @param pose  The estimated pose. @param r  What is to be tracked; its vy is ignored.
  [[nodiscard]] FollowerCommand calculate(const Pose2d& pose,
                                          const TrackingPoint& r) const noexcept;

  /// K, 2 x 3, at a velocity. @param v  m/s; NaN is zero.
  [[nodiscard]] Gain K(double v) const noexcept;

  [[nodiscard]] const LtvUnicycleSettings& settings() const noexcept { return settings_; }

 private:
  explicit LtvUnicycleFollower(const LtvUnicycleSettings& settings) noexcept;
  struct Turning {
    double y = 0.0;        ///< rad/(s m)
    double heading = 0.0;  ///< 1/s
  };
  [[nodiscard]] Turning turning_gains(double v) const noexcept;

  LtvUnicycleSettings settings_;
  double k_x_ = 0.0;        ///< 1/s
  double across_ = 0.0;     ///< a, rad/(s m)
  double heading_ = 0.0;    ///< c, 1/s
  double root_ = 0.0;       ///< √(4 + c²T²)
  double root_less_ = 0.0;  ///< √(4 + c²T²) - 2
};

}  // namespace flyball
