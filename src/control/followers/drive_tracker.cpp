#include <flyball/control/followers/drive_tracker.hpp>

#include <cmath>

#include <flyball/control/lqr.hpp>
#include <flyball/core/signal.hpp>
#include <flyball/mechanisms/friction.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"

namespace flyball {

Eigen::Vector2d within_voltage(const Eigen::Vector2d& voltage, double limit,
                               bool& saturated) noexcept {
  const Eigen::Vector2d wanted(detail::cut(voltage(0)), detail::cut(voltage(1)));
  const double largest = std::max(std::abs(wanted(0)), std::abs(wanted(1)));
  if (!(largest > limit)) {
    return wanted;
  }
  saturated = true;
  // Each quotient is at most 1 in rounding, too.
  return {wanted(0) / largest * limit, wanted(1) / largest * limit};
}

Expected<DriveInversion> DriveInversion::create(const mechanisms::DifferentialDrive& drive,
                                                Time period) {
  constexpr std::string_view where = "DriveInversion";
  FLYBALL_TRY(const DiscretizedMatrices plant, discretize_zoh(drive.A, drive.B, period));
  const Eigen::Matrix2d B = plant.B;
  const double determinant = B(0, 0) * B(1, 1) - B(0, 1) * B(1, 0);
  if (!(std::abs(determinant) > 1e-12 * B.squaredNorm())) {
    return refusal(ArgumentError::out_of_range, where, "drive.B")
        .got("singular")
        .expected("two voltages that move the sides independently");
  }
  return DriveInversion(plant.A, B, {drive.kS_left, drive.kS_right});
}

DriveInversion::DriveInversion(const Eigen::Matrix2d& A, const Eigen::Matrix2d& B,
                               const Eigen::Vector2d& kS)
    : A_(A), B_(B), kS_(kS) {
  B_inverse_ << B(1, 1), -B(0, 1), -B(1, 0), B(0, 0);
  B_inverse_ /= B(0, 0) * B(1, 1) - B(0, 1) * B(1, 0);
}

Eigen::Vector2d DriveInversion::calculate(const Eigen::Vector2d& r,
                                          const Eigen::Vector2d& r_next) const noexcept {
  // u = B⁻¹(r_{k+1} - A r_k)                                                         (7.16)
  const Eigen::Vector2d u = B_inverse_ * (r_next - A_ * r);
  return {detail::signal_or_zero(u(0) + mechanisms::friction_voltage(kS_(0), r_next(0))),
          detail::signal_or_zero(u(1) + mechanisms::friction_voltage(kS_(1), r_next(1)))};
}

Expected<DriveVelocityTracker> DriveVelocityTracker::create(
    const mechanisms::DifferentialDrive& drive, const DriveTrackerSettings& settings) {
  constexpr std::string_view where = "DriveVelocityTracker";
  FLYBALL_CHECK(Checks(where)
                    .positive(settings.velocity_tolerance, "velocity_tolerance", "m/s")
                    .positive(settings.voltage_tolerance, "voltage_tolerance", "V")
                    .positive(settings.voltage_limit, "voltage_limit", "V")
                    .positive(settings.period.si(), "period", "s"));
  FLYBALL_TRY(const DriveInversion inversion, DriveInversion::create(drive, settings.period));
  FLYBALL_TRY(const LqrDesign<> design,
              lqr(inversion.A(), inversion.B(),
                  bryson({settings.velocity_tolerance, settings.velocity_tolerance}),
                  bryson({settings.voltage_tolerance, settings.voltage_tolerance})));
  return DriveVelocityTracker(settings, inversion, design.K);
}

DriveCommand DriveVelocityTracker::calculate(const Eigen::Vector2d& x, const Eigen::Vector2d& r,
                                             const Eigen::Vector2d& r_next) const noexcept {
  if (!is_signal(r) || !is_signal(r_next)) {
    return {Eigen::Vector2d::Zero(), FollowerStatus::no_reference};
  }
  Eigen::Vector2d u = inversion_.calculate(r, r_next);
  const bool measured = is_signal(x);
  if (measured) {
    u += K_ * (r - x);
  }
  bool saturated = false;
  const Eigen::Vector2d voltage = within_voltage(u, settings_.voltage_limit, saturated);
  return {voltage, !measured   ? FollowerStatus::no_pose
                   : saturated ? FollowerStatus::saturated
                               : FollowerStatus::tracking};
}

}  // namespace flyball
