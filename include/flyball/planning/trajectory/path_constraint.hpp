#pragma once

#include <limits>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/drivetrain/robot_body.hpp>

/// What a motion along a path must keep to. Whatever is infinite is no limit.
namespace flyball {

/// Of each coordinate of the path alone: |dq_j/dt| <= velocity_j, |d²q_j/dt²| <= acceleration_j,
/// |d³q_j/dt³| <= jerk_j. What an arm of any number of joints needs.
struct CoordinateLimits {
  Eigen::VectorXd velocity;      ///< One a coordinate, unit/s, > 0; empty for none.
  Eigen::VectorXd acceleration;  ///< One a coordinate, unit/s², > 0; empty for none.
  Eigen::VectorXd jerk{};        ///< One a coordinate, unit/s³, > 0; empty for none.
};

/// Of a robot's travel in the plane, the path's first two coordinates (x, y).
struct TravelLimits {
  static constexpr double none = std::numeric_limits<double>::infinity();
  double velocity = none;      ///< m/s, > 0: v = |dp/dt|.
  double acceleration = none;  ///< m/s², > 0: |dv/dt|, along the path.
  double centripetal = none;   ///< m/s², > 0: v² |κ|, across the path.
  /// m/s², > 0: |d²p/dt²|, along and across together. The circle as the polygon of 24 sides within
  /// it, whose corners are ahead, behind and to both sides: there all of it is used, in between at
  /// least 0.991.
  double total_acceleration = none;
  /// rad/s, > 0: of the third coordinate or, where there is none, of the direction of travel, v
  /// |κ|.
  double angular_velocity = none;
  double angular_acceleration = none;  ///< rad/s², > 0, of the same.
  double jerk = none;                  ///< m/s³, > 0: |d²v/dt²|, along the path.
  /// m/s³, > 0: |d³p/dt³|, along and across together: the acceleration as a vector changes no
  /// faster. Places where the curvature jumps become stops. The circle as the polygon of 12 sides
  /// within it, whose corners are ahead, behind and to both sides: there all of it is used, in
  /// between at least 0.965.
  double total_jerk = none;
};

/// A shape of the plane. Its border belongs to it.
struct EllipseRegion {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< m
  double x_radius = 0.0;                             ///< m, > 0.
  double y_radius = 0.0;                             ///< m, > 0.
  double rotation = 0.0;                             ///< rad
};
/// A rectangle with sides along x and y.
struct RectangleRegion {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();   ///< m, one corner.
  Eigen::Vector2d high = Eigen::Vector2d::Zero();  ///< m, the opposite one.
};
/// A polygon; the last corner is joined to the first. Inside is where a ray crosses its sides an
/// odd number of times.
struct PolygonRegion {
  std::vector<Eigen::Vector2d> corners;  ///< m, three or more.
};

/// While (x, y) is inside the region, |dp/dt| <= velocity.
struct RegionLimit {
  std::variant<EllipseRegion, RectangleRegion, PolygonRegion> region;
  double velocity = 0.0;  ///< m/s, > 0.
  std::string name;       ///< For reports; "region 1" and so on if empty.
};

/// Limits of travel from one parameter of the path to another, both among them: PathPlanner's
/// zones, Choreo's constraints between waypoints. Where both are one, the velocities are limited
/// there.
struct StretchLimits {
  double from = 0.0;      ///< Parameter of the path.
  double to = 0.0;        ///< Parameter of the path, `from` or more.
  TravelLimits limits{};  ///< What holds there beside all others.
  std::string name;       ///< For reports; "stretch 1" and so on if empty.
};

/// A robot's drive as its motors limit it. Each shaft turns its wheel or its side's wheels,
///
///     voltage = R I + G Ω/K_v,   K_t G I = r F + J_s dΩ/dt + friction + damping Ω,
///
/// Ω = w/r with the wheel's speed w along the ground. F is what the wheel pushes the robot with: of
/// all forces that move mass and inertia as the path says those of least squares.
struct DriveLimits {
  static constexpr double none = std::numeric_limits<double>::infinity();
  mechanisms::RobotBody body{};
  mechanisms::DriveShaft shaft{};  ///< Each shaft's: motors, gearing, what turns with it, friction.
  Length wheel_radius{};           ///< r
  double voltage = 12.0;           ///< V, > 0: |voltage| at each motor.
  double current = none;           ///< A, > 0: |I| of all motors of a shaft together.
  double wheel_speed = none;       ///< m/s, > 0: |w|.
  /// > 0: the friction of the wheels on the floor; the force on it at most grip · load, the loads
  /// as of a robot at rest.
  double grip = none;
};

/// A drive of two sides; it goes where its path points (travel heading), forwards or backwards.
struct DifferentialDriveLimits {
  DriveLimits drive{};     ///< A shaft is a side. The centre of mass between the wheels.
  Length trackwidth{};     ///< 2 r_b
  bool backwards = false;  ///< Whether it drives with its back in front.
};

/// Swerve modules that point where they move, a shaft each. The path is (x, y, θ); of (x, y) the
/// robot does not turn.
struct SwerveDriveLimits {
  DriveLimits drive{};
  std::vector<Eigen::Vector2d> positions;  ///< m, of the modules in the robot's frame; two or more.
};

/// Four mecanum wheels, rollers in an X, a shaft each. The path as of `SwerveDriveLimits`.
struct MecanumDriveLimits {
  DriveLimits drive{};
  std::vector<Eigen::Vector2d> positions;  ///< m: front left, front right, back left, back right.
};

/// One of them.
using PathConstraint = std::variant<CoordinateLimits, TravelLimits, RegionLimit, StretchLimits,
                                    DifferentialDriveLimits, SwerveDriveLimits, MecanumDriveLimits>;

}  // namespace flyball
