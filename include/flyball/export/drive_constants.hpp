#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/export/constants.hpp>

namespace flyball::exports {

/// Gains of one of a drivetrain's modes, per unit of a wheel's way.
struct DriveModeGains {
  double kS = 0.0;  ///< V
  double kV = 0.0;  ///< V·s/unit
  double kA = 0.0;  ///< V·s²/unit, 0 if not determined.
};

/// What WPILib's follower of a drivetrain takes. Bryson's tolerances, of which infinite ones do not
/// count.
struct WpilibFollower {
  /// Which of WPILib's controllers.
  enum class Kind { ramsete, ltv_unicycle, ltv_drive };
  Kind kind = Kind::ramsete;
  double b = 2.0;                           ///< rad²/m²
  double zeta = 0.7;                        ///< 1/rad
  double x_tolerance = 0.0;                 ///< m
  double y_tolerance = 0.0;                 ///< m
  double heading_tolerance = 0.0;           ///< rad
  double velocity_tolerance = 0.0;          ///< m/s, of the robot or of a side.
  double angular_velocity_tolerance = 0.0;  ///< rad/s
  double voltage_tolerance = 0.0;           ///< V
  double max_velocity = 0.0;                ///< m/s, of the unicycle's table.
};

/// A drivetrain as other tools know it.
struct DriveConstants {
  std::string unit = "m";                   ///< "m", or "rad" of wheels whose size is not known.
  std::optional<DriveModeGains> linear{};   ///< Of half the sum of the sides.
  std::optional<DriveModeGains> angular{};  ///< Of half their difference.
  std::optional<double> trackwidth{};       ///< m
  double kP = 0.0;                          ///< V/(unit/s), of either side's velocity loop.
  double period = 0.020;                    ///< s
  std::optional<WpilibFollower> follower{};
};

/// For WPILib 2025: the gains of both modes, those of turning per radian where the trackwidth is
/// known (Theorem 14.5.1), and the objects that take them: LinearSystemId,
/// DifferentialDriveFeedforward, DifferentialDriveKinematics, a PIDController a side and the
/// follower. A mode that is not known is left out.
[[nodiscard]] std::string wpilib_drive_constants(const DriveConstants& constants,
                                                 Language language);

/// In every language.
[[nodiscard]] std::vector<PasteText> paste_drive_constants(const DriveConstants& constants);

}  // namespace flyball::exports
