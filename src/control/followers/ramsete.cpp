#include <flyball/control/followers/ramsete.hpp>

#include <cmath>

#include <flyball/core/signal.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

/// sin e / e given the sine.
double sinc(double e, double sine) noexcept {
  // 1 - e²/6 is exact to rounding below 1e-4.
  return std::abs(e) > 1e-4 ? sine / e : 1.0 - e * e / 6.0;
}

}  // namespace

Expected<RamseteFollower> RamseteFollower::create(const RamseteSettings& settings) {
  constexpr std::string_view where = "RamseteFollower";
  FLYBALL_CHECK(Checks(where)
                    .positive(settings.b, "b", "rad²/m²")
                    .within(settings.b, 0.0, largest_signal, "b", "rad²/m²")
                    .positive(settings.zeta, "zeta", "1/rad")
                    .within(settings.zeta, 0.0, 1.0, "zeta", "1/rad")
                    .also([&] { return detail::check_speed_limits(settings.limits, where); }));
  return RamseteFollower(settings);
}

double RamseteFollower::gain(double v_d, double omega_d) const noexcept {
  // k = 2ζ √(ω_d² + b v_d²)                                                          (8.27)
  return 2.0 * settings_.zeta * std::sqrt(omega_d * omega_d + settings_.b * v_d * v_d);
}

FollowerCommand RamseteFollower::calculate(const Pose2d& pose,
                                           const TrackingPoint& r) const noexcept {
  if (!detail::known(r)) {
    return {{}, FollowerStatus::no_reference};
  }
  const double v_d = r.speeds.vx;
  const double omega_d = r.speeds.omega;
  bool saturated = false;
  if (!detail::known(pose)) {
    return {settings_.limits.on_arc(v_d, omega_d, saturated), FollowerStatus::no_pose};
  }
  const Eigen::Vector3d e = tracking_error(pose, r.pose);
  const double sine = std::sin(e(2));
  const double cosine = std::cos(e(2));
  const double k = gain(v_d, omega_d);
  // v = v_d cos e_θ + k e_x                                                          (8.25)
  const double v = v_d * cosine + k * e(0);
  // ω = ω_d + k e_θ + b v_d sinc(e_θ) e_y                                            (8.26)
  const double omega = omega_d + k * e(2) + settings_.b * v_d * sinc(e(2), sine) * e(1);
  const auto speeds = settings_.limits.on_arc(v, omega, saturated);
  return {speeds, saturated ? FollowerStatus::saturated : FollowerStatus::tracking};
}

double RamseteFollower::lyapunov_rate(const Eigen::Vector3d& error,
                                      const TrackingPoint& r) const noexcept {
  return -gain(r.speeds.vx, r.speeds.omega) *
         (settings_.b * error(0) * error(0) + error(2) * error(2));
}

}  // namespace flyball
