#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/planning/drive/optimize_drive.hpp>

/// What an independent simulation says of each interval of a trajectory.
namespace flyball::drive_check {

/// The largest excess in each interval; negative or zero: kept.
struct Excesses {
  Eigen::MatrixXd constraints{};  ///< In their units: constraints x intervals.
  Eigen::MatrixXd shares{};       ///< The same over what they are shares of.
  Eigen::VectorXd wheel_speed{};  ///< Of its limit.
  Eigen::VectorXd motor_line{};   ///< Of the stall force, or the friction.
};

/// @param instants  Of each interval, from its start. @param excesses  Where wanted.
[[nodiscard]] DriveCheck check(const DriveProblem& problem, const std::vector<DriveSample>& samples,
                               const std::vector<int>& waypoint_samples, int instants,
                               Excesses* excesses);

}  // namespace flyball::drive_check
