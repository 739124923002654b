#include <flyball/control/followers/holonomic.hpp>

#include <cmath>
#include <numbers>

#include <flyball/core/signal.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

/// The same angle within half a turn of zero.
double wrapped(double angle) noexcept {
  return std::remainder(angle, 2.0 * std::numbers::pi);
}

}  // namespace

Expected<HolonomicFollower> HolonomicFollower::create(const HolonomicSettings& settings) {
  constexpr std::string_view where = "HolonomicFollower";
  FLYBALL_CHECK(detail::check_tolerance(settings.x_tolerance, where, "x_tolerance", "m"));
  FLYBALL_CHECK(detail::check_tolerance(settings.y_tolerance, where, "y_tolerance", "m"));
  FLYBALL_CHECK(
      detail::check_tolerance(settings.heading_tolerance, where, "heading_tolerance", "rad"));
  Checks checks(where);
  checks.positive(settings.velocity_tolerance, "velocity_tolerance", "m/s")
      .within(settings.velocity_tolerance, 0.0, 1e25, "velocity_tolerance", "m/s")
      .positive(settings.angular_velocity_tolerance, "angular_velocity_tolerance", "rad/s")
      .within(settings.angular_velocity_tolerance, 0.0, 1e25, "angular_velocity_tolerance", "rad/s")
      .positive(settings.period.si(), "period", "s")
      .also([&] { return detail::check_speed_limits(settings.limits, where); });
  if (settings.heading_profile) {
    checks.positive(settings.heading_profile->velocity, "heading_profile.velocity", "rad/s")
        .positive(settings.heading_profile->acceleration, "heading_profile.acceleration", "rad/s²");
  }
  return checks.map([&] { return HolonomicFollower(settings); });
}

HolonomicFollower::HolonomicFollower(const HolonomicSettings& settings) noexcept
    : settings_(settings),
      gains_(detail::integrator_gain(settings.x_tolerance, settings.velocity_tolerance,
                                     settings.period.si()),
             detail::integrator_gain(settings.y_tolerance, settings.velocity_tolerance,
                                     settings.period.si()),
             detail::integrator_gain(settings.heading_tolerance,
                                     settings.angular_velocity_tolerance, settings.period.si())) {}

MotionState HolonomicFollower::next_heading(double measured, double wanted,
                                            double wanted_rate) noexcept {
  if (!settings_.heading_profile) {
    return {wanted, wanted_rate, 0.0};
  }
  // A robot that was turned away by others begins anew from where it is.
  constexpr double lost = 0.5 * std::numbers::pi;
  if (!heading_ || std::abs(wrapped(heading_->position - measured)) > lost) {
    heading_ = MotionState{measured, 0.0, 0.0};
  }
  const MotionState goal{heading_->position + wrapped(wanted - heading_->position), wanted_rate};
  MotionState next =
      TrapezoidProfile(*settings_.heading_profile, *heading_, goal).sample(settings_.period.si());
  next.position = wrapped(next.position);
  return next;
}

FollowerCommand HolonomicFollower::calculate(const Pose2d& pose, const TrackingPoint& r) noexcept {
  if (!detail::known(r)) {
    return {{}, FollowerStatus::no_reference};
  }
  bool saturated = false;
  if (!detail::known(pose)) {
    return {settings_.limits.in_any_direction(r.speeds, saturated), FollowerStatus::no_pose};
  }
  const MotionState heading = next_heading(pose.angle(), r.pose.angle(), r.speeds.omega);
  const mechanisms::ChassisSpeeds moving = r.speeds.to_field(r.pose.rotation());
  // u = u_r + K (r - x), in the field                                                 (8.5)
  const mechanisms::ChassisSpeeds in_field{
      moving.vx + gains_(0) * (r.pose.x() - pose.x()),
      moving.vy + gains_(1) * (r.pose.y() - pose.y()),
      heading.velocity + gains_(2) * wrapped(heading.position - pose.angle())};
  heading_ = heading;
  // and in the robot's frame                                                          (8.6)
  const auto speeds =
      settings_.limits.in_any_direction(in_field.to_robot(pose.rotation()), saturated);
  return {speeds, saturated ? FollowerStatus::saturated : FollowerStatus::tracking};
}

}  // namespace flyball
