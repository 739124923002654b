#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/answer.hpp>
#include <flyball/mechanisms/differential_drive.hpp>
#include <flyball/study/drive.hpp>

/// The follower of a drivetrain, designed.
namespace flyball::study {

/// A follower's gain at a velocity.
struct ScheduledGain {
  double velocity = 0.0;  ///< m/s, of the robot; at -v the column of y is negated.
  /// From the error [x, y, θ] in the robot's frame (m, m, rad) to what is added to v and ω, 2 x 3;
  /// of the LTV drive from [x, y, θ, vl, vr] to the sides' voltages, 2 x 5.
  Eigen::MatrixXd K{};
};

/// What a differential drive runs to follow trajectories.
struct FollowerDesign {
  DriveJob job{};
  mechanisms::DifferentialDrive model{};
  mechanisms::DriveGains gains{};
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();  ///< Of the sides' velocities over a period.
  Eigen::Matrix2d B = Eigen::Matrix2d::Zero();
  /// V/(m/s): the LQR's of the sides' velocities, which the cascades run and PIDs of motor
  /// controllers take as kP.
  Eigen::Matrix2d K = Eigen::Matrix2d::Zero();
  double kP = 0.0;                                  ///< The smaller one of its two modes'.
  Eigen::Vector2d poles = Eigen::Vector2d::Zero();  ///< Of that loop: straight on, turning.
  std::vector<ScheduledGain> schedule{};            ///< Ascending from 0 or the least velocity.
  std::optional<double> schedule_error{};           ///< Relative, between entries; LTV drive.
  std::string header{};                             ///< C++17: `drive_follower_header`.
  std::vector<Diagnostic> diagnostics{};
};

/// Designs the follower of a job, whose trajectory it does not need.
///
/// Ramsete's and the unicycle regulator's gains are their own at a velocity straight on (Ramsete's
/// law linearised at e = 0: k = 2ζ √b v, and b v across); those of the LTV drive are its schedule.
/// @errors ProjectError::wrong_value for what is no differential drive; those of the models and
/// followers. Cost: milliseconds.
[[nodiscard]] Expected<FollowerDesign> design_follower(const DriveJob& job);

/// Gains, schedule, constants for WPILib, Phoenix 6 and REVLib, and "follower.hpp". Schema
/// "flyball.design_drive/1".
[[nodiscard]] Answer answer_of(const FollowerDesign& design);
[[nodiscard]] std::string to_json(const FollowerDesign& design);

}  // namespace flyball::study
