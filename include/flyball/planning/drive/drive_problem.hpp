#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

/// What a time-optimal trajectory of a drivetrain is asked for by. SI; the field's frame is x
/// forward, y left, headings counter-clockwise.
namespace flyball {

/// What a drivetrain moves by.
enum class Drivetrain : std::uint8_t { swerve, differential, mecanum };
[[nodiscard]] std::string_view to_string(Drivetrain drivetrain);

/// A rigid robot on wheels that push.
///
/// A wheel (a swerve module, a mecanum wheel, a side of a differential drive) at the speed v over
/// the floor pushes with at most
///
///   |F| ≤ max_force,  |F| ≤ friction,  |v| ≤ max_speed,  F·v ≤ stall_force (|v| -
///   |v|²/free_speed), F·v + copper_loss |F|² ≤ supply_power
///
/// where the motor's torque over its speed stands only with a free_speed, and what it draws from
/// the battery only with a supply_power. What brakes is not limited by the motor's line. A mecanum
/// wheel's v and F are those of its tread, and its roller pushes the floor with √2 F; a side of a
/// differential drive has grip along and across: F² + (m v ω/2)² ≤ friction².
struct DriveModel {
  Drivetrain drivetrain = Drivetrain::swerve;
  double mass = 0.0;               ///< kg
  double moment_of_inertia = 0.0;  ///< kg m², about the vertical axis.
  /// m, of swerve modules and mecanum wheels: FL, FR, BL, BR.
  std::array<Eigen::Vector2d, 4> wheels{};
  double trackwidth = 0.0;    ///< m, of a differential drive.
  double max_force = 0.0;     ///< N, of a wheel or side: stall torque or current limit.
  double max_speed = 0.0;     ///< m/s, of a wheel or side.
  double stall_force = 0.0;   ///< N, of the motor's line; looked at with free_speed.
  double free_speed = 0.0;    ///< m/s, of the motor's line; 0: force at every speed.
  double friction = 0.0;      ///< N, of a wheel or side: μ times its load; 0: endless.
  double supply_power = 0.0;  ///< W that a wheel or side draws from the battery; 0: endless.
  double copper_loss = 0.0;   ///< W/N² that its motors' windings lose; looked at with supply_power.
  std::vector<Eigen::Vector2d> corners{};  ///< m, of the bumpers, convex; empty: a point.

  /// N that a wheel pushes with at most.
  [[nodiscard]] double force() const noexcept;
  /// Wheels, or sides.
  [[nodiscard]] int wheel_count() const noexcept;
};

/// A place to pass.
struct DriveWaypoint {
  double x = 0.0, y = 0.0;      ///< m
  double heading = 0.0;         ///< rad
  bool fix_translation = true;  ///< Else x, y say only where to look for a way.
  bool fix_heading = true;      ///< Else heading does.
  bool stop = false;  ///< At rest, as the first and the last waypoint are not unless told.
  int intervals = 0;  ///< Of the mesh to the next waypoint; 0: chosen.
};

/// Kinds of constraints, Choreo's and polygons.
enum class DriveConstraintKind : std::uint8_t {
  stop_point,            ///< At rest.
  max_velocity,          ///< limit: m/s of the middle.
  max_acceleration,      ///< limit: m/s² of the middle.
  max_angular_velocity,  ///< limit: rad/s.
  point_at,              ///< The front (the back if flipped) looks at x, y within `tolerance`, rad.
  keep_in_rectangle,     ///< All corners: x, y its least corner, width, height.
  keep_in_circle,        ///< All corners: x, y, radius.
  keep_in_lane,          ///< The middle within `tolerance`, m, of the line from `from` to `to`.
  keep_out_circle,       ///< No part of the bumpers: x, y, radius.
  keep_in_polygon,       ///< All corners in a convex polygon.
  keep_out_polygon,      ///< No part of the bumpers in a convex polygon.
};
[[nodiscard]] std::string_view to_string(DriveConstraintKind kind);

/// What holds at a waypoint, or from one to another.
struct DriveConstraint {
  DriveConstraintKind kind = DriveConstraintKind::stop_point;
  int from = 0;             ///< A waypoint; -1: the last.
  std::optional<int> to{};  ///< Absent: at `from` alone.
  double limit = 0.0;
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0, radius = 0.0;
  double tolerance = 0.0;
  bool flip = false;
  std::vector<Eigen::Vector2d> polygon{};  ///< m, counter-clockwise.
  std::string name{};                      ///< For messages; empty: its kind.
};

/// A trajectory to be found.
struct DriveProblem {
  DriveModel model{};
  std::vector<DriveWaypoint> waypoints{};
  std::vector<DriveConstraint> constraints{};
  double target_interval = 0.04;  ///< s, of the mesh where a waypoint says nothing.
};

}  // namespace flyball
