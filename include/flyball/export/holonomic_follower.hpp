#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <flyball/export/constants.hpp>

namespace flyball::exports {

/// A swerve or a mecanum drive's follower with its loops, in numbers.
struct HolonomicProgram {
  bool swerve = true;                               ///< Or mecanum.
  double period = 0.020;                            ///< s
  Eigen::Vector3d gains = Eigen::Vector3d::Zero();  ///< 1/s, of x, y, heading (section 8.6).
  double max_velocity = 0.0;                        ///< m/s, of the robot in any direction.
  double max_wheel_velocity = 0.0;                  ///< m/s, of a swerve module.
  std::array<Eigen::Vector2d, 4> modules{};         ///< m: FL, FR, BL, BR, of a swerve drive.
  Eigen::Matrix<double, 4, 3> M =
      Eigen::Matrix<double, 4, 3>::Zero();  ///< Mecanum: wheels' speeds of (vx, vy, ω).
  double A = 0.0, B = 1.0;                  ///< Of a wheel's speed: v[k+1] = A v[k] + B V.
  double K = 0.0;                           ///< V/(m/s)
  double kS = 0.0;                          ///< V
  double voltage_limit = 12.0;              ///< V
  Eigen::RowVector2d steer = Eigen::RowVector2d::Zero();  ///< V/rad, V/(rad/s), of a direction.
  double creep = 0.02;  ///< m/s, below which a module's direction stays.
};

/// A C++17 header, without Flyball, of the namespace `follower`: each period `calculate` takes the
/// pose and what the wheels do, measured, and where the robot is to be with its velocity in the
/// field now and a period later, and answers the voltages of the wheels and of the modules'
/// steering,
///
///     Command calculate(pose, wheels, reference, r, r_next) noexcept          (mecanum)
///     Command calculate(pose, modules, reference, r, r_next) noexcept         (swerve)
///
/// It is the law that `flyball drive` simulates, to rounding; voltages are finite and within their
/// limit whatever comes. It neither allocates, throws nor keeps anything between periods.
/// @param origin  What it was made from, for a comment.
[[nodiscard]] std::string holonomic_follower_header(const HolonomicProgram& program,
                                                    std::string_view origin);

/// A drivetrain that moves in any direction, as WPILib knows it.
struct HolonomicConstants {
  bool swerve = true;
  double period = 0.020;                            ///< s
  std::array<Eigen::Vector2d, 4> modules{};         ///< m: FL, FR, BL, BR.
  double kS = 0.0, kV = 0.0, kA = 0.0;              ///< V, V·s/m, V·s²/m of a wheel.
  double kP = 0.0;                                  ///< V·s/m of a wheel's speed.
  double steer_kP = 0.0, steer_kD = 0.0;            ///< V/rad, V·s/rad, of a swerve drive.
  Eigen::Vector3d gains = Eigen::Vector3d::Zero();  ///< 1/s, of x, y, heading.
  double max_velocity = 0.0;                        ///< m/s
};

/// For WPILib 2025 in every language: the numbers, and the objects that take them
/// (SwerveDriveKinematics or MecanumDriveKinematics, SimpleMotorFeedforward, a PIDController a
/// wheel, a steering and a coordinate).
[[nodiscard]] std::vector<PasteText> paste_holonomic_constants(const HolonomicConstants& constants);

}  // namespace flyball::exports
