#include <flyball/control/followers/ltv_unicycle.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/signal.hpp>

#include "core/try.hpp"

namespace flyball {

Expected<LtvUnicycleFollower> LtvUnicycleFollower::create(const LtvUnicycleSettings& settings) {
  constexpr std::string_view where = "LtvUnicycleFollower";
  FLYBALL_CHECK(detail::check_tolerance(settings.x_tolerance, where, "x_tolerance", "m"));
  FLYBALL_CHECK(detail::check_tolerance(settings.y_tolerance, where, "y_tolerance", "m"));
  FLYBALL_CHECK(
      detail::check_tolerance(settings.heading_tolerance, where, "heading_tolerance", "rad"));
  FLYBALL_CHECK(
      Checks(where)
          .positive(settings.velocity_tolerance, "velocity_tolerance", "m/s")
          .within(settings.velocity_tolerance, 0.0, 1e25, "velocity_tolerance", "m/s")
          .positive(settings.angular_velocity_tolerance, "angular_velocity_tolerance", "rad/s")
          .within(settings.angular_velocity_tolerance, 0.0, 1e25, "angular_velocity_tolerance",
                  "rad/s")
          .positive(settings.period.si(), "period", "s")
          .within(settings.period.si(), 0.0, 1e25, "period", "s")
          .also([&] { return detail::check_low_speed(settings.low_speed, where); })
          .also([&] { return detail::check_farthest(settings.farthest_error, where); })
          .also([&] { return detail::check_speed_limits(settings.limits, where); }));
  return LtvUnicycleFollower(settings);
}

LtvUnicycleFollower::LtvUnicycleFollower(const LtvUnicycleSettings& settings) noexcept
    : settings_(settings),
      k_x_(detail::integrator_gain(settings.x_tolerance, settings.velocity_tolerance,
                                   settings.period.si())),
      across_(settings.angular_velocity_tolerance / settings.y_tolerance),
      heading_(settings.angular_velocity_tolerance / settings.heading_tolerance) {
  const double cT = heading_ * settings.period.si();
  root_ = std::sqrt(4.0 + cT * cT);
  root_less_ = cT * cT / (2.0 + root_);
}

LtvUnicycleFollower::Turning LtvUnicycleFollower::turning_gains(double v) const noexcept {
  const double T = settings_.period.si();
  v = detail::cut(v);
  const double least = settings_.low_speed.velocity;
  const double speed = std::max(std::abs(v), least);
  // The closed loop's poles z satisfy a reciprocal polynomial; h = √(z₁ z₂), and n = h + 1/h.
  const double g = across_ * speed * T * T;
  const double n = 0.5 * g + root_;
  const double n_less = 0.5 * g + root_less_;
  const double h = 2.0 / (n + std::sqrt(n_less * (n + 2.0)));
  const double k_y = across_ * h;
  const double k_heading = std::sqrt(heading_ * heading_ * h * h + 2.0 * speed * k_y);
  const bool fades = settings_.low_speed.cross_track == LowSpeed::CrossTrack::fades;
  const double share = std::abs(v) >= least || !fades ? (v < 0.0 ? -1.0 : 1.0) : v / least;
  return {share * k_y, k_heading};
}

LtvUnicycleFollower::Gain LtvUnicycleFollower::K(double v) const noexcept {
  const Turning turning = turning_gains(v);
  Gain K;
  K << k_x_, 0.0, 0.0, 0.0, turning.y, turning.heading;
  return K;
}

FollowerCommand LtvUnicycleFollower::calculate(const Pose2d& pose,
                                               const TrackingPoint& r) const noexcept {
  if (!detail::known(r)) {
    return {{}, FollowerStatus::no_reference};
  }
  bool saturated = false;
  if (!detail::known(pose)) {
    return {settings_.limits.on_arc(r.speeds.vx, r.speeds.omega, saturated),
            FollowerStatus::no_pose};
  }
  const Eigen::Vector3d e = no_farther(tracking_error(pose, r.pose), settings_.farthest_error);
  const Turning k = turning_gains(r.speeds.vx);
  // u = K(v) e                                                                       (8.34)
  const double v = r.speeds.vx + k_x_ * e(0);
  const double omega = r.speeds.omega + k.y * e(1) + k.heading * e(2);
  const auto speeds = settings_.limits.on_arc(v, omega, saturated);
  return {speeds, saturated ? FollowerStatus::saturated : FollowerStatus::tracking};
}

}  // namespace flyball
