#include <flyball/mechanisms/drivetrain/swerve_dynamics.hpp>

#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>

#include "core/try.hpp"

namespace flyball::mechanisms {

Expected<detail::SwerveParts> detail::check_swerve_dynamics(
    const RobotBody& body, std::span<const Eigen::Vector2d> positions, const DriveShaft& drive,
    const DriveShaft& steer, const Tire& tire, Length wheel_radius, Length patch_radius) {
  constexpr std::string_view where = "swerve_dynamics";
  FLYBALL_CHECK(check_body(body, where));
  FLYBALL_CHECK(check_tire(tire, where));
  FLYBALL_CHECK(Checks(where)
                    .positive(wheel_radius.si(), "wheel_radius", "m")
                    .not_negative(patch_radius.si(), "patch_radius", "m"));
  FLYBALL_CHECK(check_module_positions(positions, where));
  FLYBALL_TRY(const Shaft driving, checked_shaft(drive, where, "drive"));
  FLYBALL_TRY(const Shaft steering, checked_shaft(steer, where, "steer"));
  FLYBALL_TRY(const std::vector<double> shares, load_shares(positions, body.center_of_mass, where));
  return SwerveParts{driving, steering, shares};
}

}  // namespace flyball::mechanisms
