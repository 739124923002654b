#include <flyball/mechanisms/kinematics/swerve_limiter.hpp>

#include <Eigen/LU>

#include "core/format.hpp"
#include "core/try.hpp"
#include "mechanisms/motor_checks.hpp"

namespace flyball::mechanisms::detail {

namespace {

/// Positive, maybe infinite.
Expected<void> check_limit(double value, std::string_view name, std::string_view unit) {
  if (value > 0.0) {
    return {};
  }
  return refusal(ArgumentError::not_positive, "swerve_limiter", name)
      .got(format_number(value) + " " + std::string(unit))
      .expected("greater than zero; leave it out for no limit");
}

}  // namespace

Expected<LimiterNumbers> check_limiter(const SwerveLimits& limits, const SwerveForces* forces,
                                       Time period) {
  constexpr std::string_view where = "swerve_limiter";
  FLYBALL_CHECK(Checks(where)
                    .positive(limits.max_speed.si(), "max_speed", "m/s")
                    .positive(limits.steer_rate.si(), "steer_rate", "rad/s")
                    .positive(period.si(), "period", "s"));
  FLYBALL_CHECK(check_limit(limits.acceleration.si(), "acceleration", "m/s^2"));
  FLYBALL_CHECK(check_limit(limits.angular_acceleration.si(), "angular_acceleration", "rad/s^2"));
  LimiterNumbers numbers{.max_speed = limits.max_speed.si(),
                         .steer_rate = limits.steer_rate.si(),
                         .acceleration = limits.acceleration.si(),
                         .angular_acceleration = limits.angular_acceleration.si(),
                         .dt = period.si()};
  if (forces == nullptr) {
    return numbers;
  }
  FLYBALL_CHECK(check_body(forces->body, where));
  FLYBALL_CHECK(check_drive(forces->motor, forces->gearing, where));
  FLYBALL_CHECK(Checks(where)
                    .positive(forces->wheel_radius.si(), "wheel_radius", "m")
                    .positive(forces->rail.si(), "rail", "V")
                    .positive(forces->friction, "friction"));
  FLYBALL_CHECK(check_limit(forces->stator_limit, "stator_limit", "A"));
  FLYBALL_CHECK(check_limit(forces->supply_limit, "supply_limit", "A"));
  const double free =
      forces->rail.si() * forces->motor.Kv * forces->wheel_radius.si() / forces->gearing;  // m/s
  if (numbers.max_speed > 0.98 * free) {
    return refusal(ArgumentError::out_of_range, where, "max_speed")
        .got(format_number(numbers.max_speed) + " m/s")
        .expected(flyball::detail::format(
            "at most {:.4g} m/s, 0.98 of what the motors reach on {:.4g} V without load",
            0.98 * free, forces->rail.si()))
        .hint("take a lower speed, less gearing or a larger wheel");
  }
  numbers.has_forces = true;
  numbers.mass = forces->body.mass.si();
  numbers.inertia = forces->body.moment_of_inertia.si();
  numbers.grip = forces->friction * standard_gravity;
  numbers.center = forces->body.center_of_mass;
  numbers.wheel =
      WheelForce({.R = forces->motor.R,
                  .Kv = forces->motor.Kv,
                  .limits = {forces->stator_limit, forces->supply_limit}},
                 forces->gearing / forces->wheel_radius.si(), forces->motor.Kt, forces->rail.si());
  return numbers;
}

Eigen::MatrixXd wheel_forces(std::span<const Eigen::Vector2d> positions,
                             const Eigen::Vector2d& center) {
  // W f = (F, M); f = Wᵀ (W Wᵀ)⁻¹ (F, M).
  Eigen::MatrixXd W(3, 2 * static_cast<Eigen::Index>(positions.size()));
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    const Eigen::Vector2d r = positions[i] - center;
    W.middleCols<2>(at) << 1.0, 0.0, 0.0, 1.0, -r(1), r(0);
  }
  const Eigen::Matrix3d gram = W * W.transpose();
  return W.transpose() * gram.fullPivLu().solve(Eigen::Matrix3d::Identity());
}

}  // namespace flyball::mechanisms::detail
