#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/geometry/se2.hpp>

/// Trajectories and robots as the planning tools of robotics teams write them.
namespace flyball {

/// Why a file of a planning tool cannot be used.
enum class TrajectoryFileError {
  not_json,          ///< Broken JSON, told with line and column.
  not_a_trajectory,  ///< JSON of something else.
  wrong_sample,      ///< A sample without what it needs, or with what is no number.
  time_order,        ///< Times that repeat or go back.
  too_few,           ///< Fewer than two samples.
  too_tight,         ///< A curvature or a speed that the drivetrain cannot have.
};
[[nodiscard]] ErrorInfo error_info(TrajectoryFileError code);

/// Where a robot is to be at a time, and how it moves there.
struct MotionSample {
  double time = 0.0;                                       ///< s since the start.
  Pose2d pose{};                                           ///< Of the robot, in the field.
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();      ///< m/s, in the field.
  double omega = 0.0;                                      ///< rad/s
  Eigen::Vector2d acceleration = Eigen::Vector2d::Zero();  ///< m/s², in the field.
  Place place{};  ///< Where the sample stands in its file; line 0: nowhere.

  /// m/s along the robot's forward axis: negative where it backs.
  [[nodiscard]] double forward() const noexcept {
    return velocity(0) * pose.rotation().cos() + velocity(1) * pose.rotation().sin();
  }
};

/// A motion over time, from a file or from waypoints.
struct RobotTrajectory {
  std::string source{};                 ///< The file, for messages.
  std::vector<MotionSample> samples{};  ///< Two or more, times ascending from zero.
  bool holonomic = false;               ///< Whether the robot looks another way than it goes.
  std::vector<Diagnostic> diagnostics{};

  [[nodiscard]] double duration() const noexcept { return samples.back().time; }
  /// At a time: the pose on the arc between two samples, velocities in proportion; before the start
  /// (and NaN) the first sample, after the end the last at rest. Cost: O(log samples), noexcept,
  /// allocation-free.
  [[nodiscard]] MotionSample at(double t) const noexcept;
};

/// Reads a WPILib trajectory JSON (docs: io): a list of states {time, velocity, acceleration,
/// curvature, pose {translation {x, y}, rotation {radians}}}, as PathWeaver wrote it; with
/// holonomicRotation (degrees) and holonomicAngularVelocity (degrees a second) as PathPlanner 2023
/// wrote it, then the robot looks that way; and the object {"samples": [{time, pose, velocity {vx,
/// vy, omega}, …}]} of WPILib 2027, whose velocities are taken in the frame, robot's or field's, in
/// which the poses move. Keys that are not known are left alone. A diagnostic warns of velocities
/// or turning rates that tell of another motion than the poses (more than half of the way apart).
/// @param text  The file. @param source  Its name for messages.
/// @errors TrajectoryFileError::not_json, not_a_trajectory, wrong_sample, time_order, too_few, each
///         with line and column, the value, and how to mend it.
/// Cost: O(size); allocates. Source: WPILib, TrajectoryUtil; PathPlanner 2023, its exporter.
[[nodiscard]] Expected<RobotTrajectory> parse_trajectory(std::string_view text,
                                                         const std::string& source);
/// The same of a file. @errors FileError, too.
[[nodiscard]] Expected<RobotTrajectory> read_trajectory(const std::string& path);

/// What PathPlanner's settings.json says of a robot, in SI; what it does not say is absent.
struct PathPlannerSettings {
  std::optional<double> robot_width{};   ///< m, with bumpers, across.
  std::optional<double> robot_length{};  ///< m, with bumpers, along.
  std::optional<bool> holonomic{};
  std::vector<std::string> path_folders{}, auto_folders{}, features{};
  std::optional<double> max_velocity{};              ///< m/s, default of a path.
  std::optional<double> max_acceleration{};          ///< m/s²
  std::optional<double> max_angular_velocity{};      ///< rad/s; the file has °/s.
  std::optional<double> max_angular_acceleration{};  ///< rad/s²; the file has °/s².
  std::optional<double> nominal_voltage{};           ///< V
  std::optional<double> mass{};                      ///< kg
  std::optional<double> moment_of_inertia{};         ///< kg m²
  std::optional<double> trackwidth{};                ///< m
  std::optional<double> wheel_radius{};              ///< m
  std::optional<double> gearing{};                   ///< Motor turns per wheel turn.
  std::optional<double> max_drive_speed{};           ///< m/s, of the wheels under load.
  std::string motor{};                               ///< "krakenX60": of the motor table.
  std::optional<double> current_limit{};             ///< A, of a motor: the stator's.
  std::optional<double> wheel_friction{};            ///< μ
  /// m, of the modules FL, FR, BL, BR in the robot's frame; those that are said whole.
  std::array<std::optional<Eigen::Vector2d>, 4> modules{};
  Eigen::Vector2d bumper_offset = Eigen::Vector2d::Zero();  ///< m, of the bumpers' middle.
  std::vector<Diagnostic> diagnostics{};                    ///< Keys that are not known.
};

/// Whether four modules are where their names say: the front ones ahead of the back ones, the left
/// ones left of the right ones. @return Nothing, or what is not so, such as "the front left module,
/// (-0.27, 0.27) m, is not ahead of the back left one, (0.27, 0.27) m".
/// @param modules  m, in the robot's frame (x ahead, y left): FL, FR, BL, BR.
[[nodiscard]] std::optional<std::string> misplaced_module(
    const std::array<Eigen::Vector2d, 4>& modules);

/// Reads PathPlanner's settings.json (2025). @errors TrajectoryFileError::not_json,
/// not_a_trajectory (JSON of something else), wrong_sample (a field of another type, or that cannot
/// be: a negative mass, modules that are not where their names say). Cost: O(size).
[[nodiscard]] Expected<PathPlannerSettings> parse_pathplanner_settings(std::string_view text,
                                                                       const std::string& source);
/// The same of a file. @errors FileError, too.
[[nodiscard]] Expected<PathPlannerSettings> read_pathplanner_settings(const std::string& path);

/// What a drivetrain's wheels can do along a trajectory.
struct DrivetrainReach {
  double wheel_speed = 0.0;  ///< m/s, of a wheel.
  double trackwidth = 0.0;  ///< m, of a differential drive, or twice the farthest module's distance
                            ///< from the middle.
  bool sideways = false;    ///< Whether it moves in any direction.
};

/// Whether a drivetrain can have every sample's motion: the wheels' speeds |v| + |ω| trackwidth/2,
/// and of one that does not move sideways a velocity along its heading (to 5° and 5 cm/s); and
/// whether each pose can be got to from the one before (by half more than the wheels go, or 10 cm).
/// @errors TrajectoryFileError::too_tight with the place, the numbers and the speed that would do.
[[nodiscard]] Expected<void> check_reach(const RobotTrajectory& trajectory,
                                         const DrivetrainReach& reach);

}  // namespace flyball
