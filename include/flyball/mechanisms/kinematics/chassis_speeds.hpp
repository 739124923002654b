#pragma once

#include <Eigen/Core>

#include <flyball/geometry/so2.hpp>

namespace flyball::mechanisms {

/// How a robot moves in its own frame: x forward, y left, counter-clockwise.
struct ChassisSpeeds {
  double vx = 0.0;     ///< m/s
  double vy = 0.0;     ///< m/s
  double omega = 0.0;  ///< rad/s

  /// (vx, vy, ω), the tangent of SE(2).
  [[nodiscard]] Eigen::Vector3d vector() const noexcept { return {vx, vy, omega}; }
  /// The speeds of such a vector.
  [[nodiscard]] static ChassisSpeeds from(const Eigen::Vector3d& twist) noexcept {
    return {twist(0), twist(1), twist(2)};
  }

  /// v_B = v_A + ω × r: those of another point of the robot.
  /// @param r  m, from the point whose speeds these are to the other one.
  /// A turn about the point c is `speeds.at(-c)`: the speeds at the robot's origin of which c has
  /// these. Source: book, section 11.4.
  [[nodiscard]] ChassisSpeeds at(const Eigen::Vector2d& r) const noexcept {
    return {vx - omega * r(1), vy + omega * r(0), omega};
  }
  /// The same in the frame of the field. @param heading  Of the robot in the field.
  [[nodiscard]] ChassisSpeeds to_field(const Rotation2d& heading) const noexcept {
    const Eigen::Vector2d v = heading * Eigen::Vector2d(vx, vy);
    return {v(0), v(1), omega};
  }
  /// Speeds in the frame of the field, in that of the robot.
  [[nodiscard]] ChassisSpeeds to_robot(const Rotation2d& heading) const noexcept {
    return to_field(heading.inverse());
  }
};

}  // namespace flyball::mechanisms
