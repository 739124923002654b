#include <flyball/control/followers/follower.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/signal.hpp>

#include "core/try.hpp"

namespace flyball {

const char* to_string(FollowerStatus status) noexcept {
  switch (status) {
    case FollowerStatus::no_reference:
      return "no reference";
    case FollowerStatus::no_pose:
      return "no pose";
    case FollowerStatus::saturated:
      return "saturated";
    case FollowerStatus::tracking:
      return "tracking";
  }
  return "unknown";
}

Eigen::Vector3d tracking_error(const Pose2d& pose, const Pose2d& r) noexcept {
  const double c = pose.rotation().cos();
  const double s = pose.rotation().sin();
  const double c_r = r.rotation().cos();
  const double s_r = r.rotation().sin();
  const double dx = r.x() - pose.x();
  const double dy = r.y() - pose.y();
  return {c * dx + s * dy, c * dy - s * dx, std::atan2(s_r * c - c_r * s, c_r * c + s_r * s)};
}

Pose2d pose_after(const Pose2d& pose, const mechanisms::ChassisSpeeds& speeds,
                  double delay) noexcept {
  const Eigen::Vector3d twist = speeds.vector() * delay;
  return is_signal(twist) ? pose * Pose2d::exp(twist) : pose;
}

Eigen::Vector3d no_farther(const Eigen::Vector3d& error, double distance) noexcept {
  const double away = std::hypot(error(0), error(1));
  if (!(away > distance)) {
    return error;
  }
  return {error(0) / away * distance, error(1) / away * distance, error(2)};
}

bool within_tolerance(const Eigen::Vector3d& error, const PoseTolerance& tolerance) noexcept {
  return std::abs(error(0)) <= tolerance.x && std::abs(error(1)) <= tolerance.y &&
         std::abs(error(2)) <= tolerance.heading;
}

mechanisms::ChassisSpeeds SpeedLimits::on_arc(double v, double omega,
                                              bool& saturated) const noexcept {
  v = detail::cut(v);
  omega = detail::cut(omega);
  double factor = 1.0;
  const auto keep = [&factor](double value, double limit) {
    if (value > limit) {
      factor = std::min(factor, limit / value);
    }
  };
  keep(std::abs(v), velocity);
  keep(std::abs(omega), angular_velocity);
  keep(std::abs(v) + 0.5 * trackwidth * std::abs(omega), wheel_velocity);
  if (factor == 1.0) {
    return {v, 0.0, omega};
  }
  saturated = true;
  // Rounding of the product must not exceed what the factor was made for.
  factor *= 1.0 - 4.0 * std::numeric_limits<double>::epsilon();
  return {factor * v, 0.0, factor * omega};
}

mechanisms::ChassisSpeeds SpeedLimits::in_any_direction(const mechanisms::ChassisSpeeds& speeds,
                                                        bool& saturated) const noexcept {
  double vx = detail::cut(speeds.vx);
  double vy = detail::cut(speeds.vy);
  const double v = std::hypot(vx, vy);
  if (const double limit = std::min(velocity, wheel_velocity); v > limit) {
    const double factor = limit / v * (1.0 - 4.0 * std::numeric_limits<double>::epsilon());
    vx *= factor;
    vy *= factor;
    saturated = true;
  }
  double omega = detail::cut(speeds.omega);
  if (std::abs(omega) > angular_velocity) {
    omega = std::copysign(angular_velocity, omega);
    saturated = true;
  }
  return {vx, vy, omega};
}

Expected<TrackingMonitor> TrackingMonitor::create(const Settings& settings) {
  constexpr std::string_view where = "TrackingMonitor";
  return Checks(where)
      .positive(settings.tolerance.x, "tolerance.x", "m")
      .positive(settings.tolerance.y, "tolerance.y", "m")
      .positive(settings.tolerance.heading, "tolerance.heading", "rad")
      .not_negative(settings.hold_time, "hold_time", "s")
      .positive(settings.distance, "distance", "m")
      .positive(settings.heading, "heading", "rad")
      .map([&] { return TrackingMonitor(settings); });
}

TrackingMonitor::State TrackingMonitor::update(const Eigen::Vector3d& error, double dt) noexcept {
  const double distance = std::hypot(error(0), error(1));
  if (!(distance <= settings_.distance && std::abs(error(2)) <= settings_.heading)) {
    within_ = -1.0;
    return state_ = State::lost;
  }
  if (!within_tolerance(error, settings_.tolerance)) {
    within_ = -1.0;
    return state_ = State::following;
  }
  within_ = within_ < 0.0 ? 0.0 : within_ + (dt > 0.0 && is_signal(dt) ? dt : 0.0);
  return state_ = within_ >= settings_.hold_time ? State::settled : State::following;
}

void TrackingMonitor::reset() noexcept {
  within_ = -1.0;
  state_ = State::following;
}

namespace detail {

namespace {

/// Positive; infinite is allowed, NaN is not.
Expected<void> check_limit(double value, std::string_view where, std::string_view name,
                           std::string_view unit) {
  return value == std::numeric_limits<double>::infinity()
             ? Expected<void>()
             : check_positive(value, where, name, unit);
}

}  // namespace

Expected<void> check_speed_limits(const SpeedLimits& limits, std::string_view where) {
  FLYBALL_CHECK(check_limit(limits.velocity, where, "limits.velocity", "m/s"));
  FLYBALL_CHECK(check_limit(limits.angular_velocity, where, "limits.angular_velocity", "rad/s"));
  FLYBALL_CHECK(check_limit(limits.wheel_velocity, where, "limits.wheel_velocity", "m/s"));
  return check_not_negative(limits.trackwidth, where, "limits.trackwidth", "m");
}

Expected<void> check_farthest(double distance, std::string_view where) {
  return check_limit(distance, where, "farthest_error", "m");
}

Expected<void> check_low_speed(const LowSpeed& low, std::string_view where) {
  return check_positive(low.velocity, where, "low_speed.velocity", "m/s");
}

Expected<void> check_tolerance(double tolerance, std::string_view where, std::string_view name,
                               std::string_view unit) {
  FLYBALL_CHECK(check_limit(tolerance, where, name, unit));
  // The weight is 1/tolerance²; what a run-time object multiplies must stay a number.
  constexpr double least = 1e-25;
  if (tolerance < least) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got(format_number(tolerance) + " " + std::string(unit))
        .expected("at least " + format_number(least) + " " + std::string(unit));
  }
  return {};
}

bool known(const Pose2d& pose) noexcept {
  return flyball::is_signal(pose.x()) && flyball::is_signal(pose.y()) &&
         flyball::is_signal(pose.rotation().cos()) && flyball::is_signal(pose.rotation().sin());
}

bool known(const TrackingPoint& r) noexcept {
  return known(r.pose) && flyball::is_signal(r.speeds.vx) && flyball::is_signal(r.speeds.vy) &&
         flyball::is_signal(r.speeds.omega);
}

double integrator_gain(double x_tolerance, double u_tolerance, double period) noexcept {
  const double root = u_tolerance / x_tolerance * period;
  const double m = root * root;
  // m/(√(m + m²/4) + m/2) with √m taken out, so that nothing is lost at either end.
  return root / (std::sqrt(1.0 + 0.25 * m) + 0.5 * root) / period;
}

}  // namespace detail

}  // namespace flyball
