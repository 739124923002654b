#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/answer.hpp>
#include <flyball/study/drive.hpp>

/// The follower of a swerve or a mecanum drive, designed.
namespace flyball::study {

/// What a drivetrain that moves in any direction runs to follow trajectories.
struct HolonomicDesign {
  DriveJob job{};
  Eigen::Vector3d gains = Eigen::Vector3d::Zero();  ///< 1/s, of x, y and the heading (section 8.6).
  double kS = 0.0, kV = 0.0, kA = 0.0;              ///< V, V·s/m, V·s²/m of one wheel.
  double A = 0.0, B = 1.0;     ///< Of a wheel's speed over a period, with its share of the robot.
  double kP = 0.0;             ///< V/(m/s), the LQR's of a wheel's speed.
  double pole = 0.0;           ///< Of that loop.
  double spinning_pole = 0.0;  ///< Of the same where the floor no longer holds the wheel.
  double spinning_A = 0.0, spinning_B = 1.0;  ///< Of such a wheel.
  double steer_kV = 0.0, steer_kA = 0.0;  ///< V·s/rad, V·s²/rad, of a swerve module's direction.
  Eigen::RowVector2d steer = Eigen::RowVector2d::Zero();  ///< V/rad, V/(rad/s).
  Eigen::Matrix2d steer_A = Eigen::Matrix2d::Zero();  ///< Of its direction and rate over a period.
  Eigen::Vector2d steer_B = Eigen::Vector2d::Zero();
  Eigen::Vector2cd steer_poles = Eigen::Vector2cd::Zero();
  std::string header{};  ///< C++17: `holonomic_follower_header`.
  std::vector<Diagnostic> diagnostics{};
};

/// Designs the holonomic follower of a job and the loops of its wheels and modules. The job's
/// trajectory is not needed.
/// @errors ProjectError::wrong_value for a differential drive and for pure pursuit; those of the
/// models and followers. Cost: milliseconds.
[[nodiscard]] Expected<HolonomicDesign> design_holonomic(const DriveJob& job);

/// Gains, responses of the loops, constants for WPILib, Phoenix 6 and REVLib, and "follower.hpp".
/// Schema "flyball.design_holonomic/1".
[[nodiscard]] Answer answer_of(const HolonomicDesign& design);
[[nodiscard]] std::string to_json(const HolonomicDesign& design);

}  // namespace flyball::study
