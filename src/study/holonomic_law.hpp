#pragma once

#include <memory>

#include <Eigen/Core>

#include <flyball/control/followers/holonomic.hpp>
#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

#include "study/drive_law.hpp"
#include "study/drive_wheel.hpp"

/// What moves in any direction follows by.
namespace flyball::study {

/// The numbers that a swerve or a mecanum drive's law runs on.
struct HolonomicParts {
  HolonomicFollower follower;
  WheelLaw wheel{};
  Eigen::Matrix<double, 4, 3> M =
      Eigen::Matrix<double, 4, 3>::Zero();  ///< Mecanum: wheels of (vx, vy, ω).
  Eigen::RowVector2d steer =
      Eigen::RowVector2d::Zero();  ///< Swerve: V/rad, V/(rad/s), of a module's direction.
  Eigen::Matrix2d steer_A = Eigen::Matrix2d::Zero();  ///< Of its direction and rate over a period.
  Eigen::Vector2d steer_B = Eigen::Vector2d::Zero();
  double fastest = 0.0;  ///< m/s, of a wheel.
};

/// @errors Those of the follower, the wheel's loop, the kinematics and the steering's.
[[nodiscard]] Expected<HolonomicParts> holonomic_parts(const DriveJob& job);

/// m/s, below which a module's direction is not worth turning to.
constexpr double creep = 0.02;

/// The law of a swerve or a mecanum drive. @errors As `holonomic_parts`, and those of the pursuit.
[[nodiscard]] Expected<std::unique_ptr<DriveLaw>> make_holonomic_law(const DriveJob& job);

}  // namespace flyball::study
