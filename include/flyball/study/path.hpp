#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/io/motion/choreo.hpp>
#include <flyball/io/motion/pathplanner.hpp>
#include <flyball/recording/motion_file.hpp>
#include <flyball/study/drive.hpp>
#include <flyball/study/project.hpp>

/// Paths and trajectories of planning tools: timed, turned to the other side, joined, shown and
/// written as each other's files.
namespace flyball::study {

/// What is asked of a path.
struct PathJob {
  std::vector<std::string> files{};    ///< One after the other.
  std::string project{};               ///< A project file with the robot, or empty.
  std::string name{};                  ///< Of a path, where a file has several.
  std::optional<Velocity> velocity{};  ///< Limits in place of the file's.
  std::optional<Acceleration> acceleration{};
  std::optional<Acceleration> centripetal{};
  std::optional<AngularVelocity> angular_velocity{};
  std::optional<AngularAcceleration> angular_acceleration{};
  std::optional<Time> ramp{};  ///< From no to full acceleration: limits the jerk along the path.
  std::optional<Velocity> start_velocity{}, end_velocity{};
  bool differential = false;  ///< It looks where it goes; else only if the file or robot says so.
  bool retime = false;        ///< A trajectory's times are made anew; so they are with limits.
  bool flip = false;          ///< Turned by half a turn about the field's middle.
  bool mirror = false;        ///< Mirrored at the line between the alliances.
  bool mirror_sides = false;  ///< Mirrored at the line along the field's middle.
  bool reverse = false;       ///< Driven from its end to its start, backing.
  Length field_length{17.548}, field_width{8.052};
  /// "choreo", "wpilib", "csv", "c++", "pathplanner", "choreo-project": what is written.
  std::string to{};
};

/// A stretch of a trajectory along which one limit holds it back.
struct PathBinding {
  double from = 0.0, to = 0.0;  ///< s
  std::string limit{};          ///< "velocity", "centripetal acceleration", "wheel speed", …
};

/// Something that files have happen along their paths.
struct PathEvent {
  std::string name{};
  double time = 0.0;                     ///< s
  std::optional<double> end{};           ///< s, of one that lasts.
  std::optional<AutoCommand> command{};  ///< What is run then, if its file says it.
};

/// What Choreo generates a trajectory from, and when its waypoints are reached.
struct ChoreoPlan {
  ChoreoParameters params{};
  std::vector<double> times{};  ///< s, one a waypoint.
};

/// What became of it.
struct PathResult {
  PathJob job{};
  MotionFormat format = MotionFormat::choreo_trajectory;  ///< Of the first file.
  bool timed = false;                                     ///< Whether the times were made here.
  RobotTrajectory trajectory{};                           ///< The whole; empty of a project.
  double length = 0.0;                                    ///< m
  std::vector<PathBinding> binding{};                     ///< Empty of what came with its times.
  std::optional<DriveRobot> robot{};
  std::vector<double> fastest_wheel{};  ///< m/s at each sample, of a robot.
  double wheel_limit = 0.0;             ///< m/s, of its wheels without load.
  std::vector<std::string> parts{};     ///< What it was joined of.
  std::vector<PathEvent> events{};      ///< In the order of their times.
  std::optional<ChoreoPlan> plan{};     ///< Of a motion made of Choreo's files alone.
  std::vector<Diagnostic> diagnostics{};
  std::string written{};  ///< The file that `to` asks for.
};

/// The options of `flyball path`.
[[nodiscard]] std::vector<FieldInfo> path_fields();

/// A job of a command line. @param files  Files of Choreo, PathPlanner, WPILib, CSV; a project file
/// (.toml) among them is the robot's, and alone its waypoints are the path.
/// @errors ProjectError, ArgumentError.
[[nodiscard]] ExpectedAll<PathJob> path_job(const std::vector<std::string>& files,
                                            std::span<const Override> given);

/// Reads the files, times those that are paths, joins, turns and mirrors them.
///
/// A path is timed as fast as the limits let it be, which hold between samples, too
/// (`time_optimal`).
/// @errors FileError, MotionFileError, TrajectoryFileError, ArgumentError, those of the project.
/// Cost: some milliseconds a path; allocates.
[[nodiscard]] ExpectedAll<PathResult> plan_path(const PathJob& job);

/// The motion as a Choreo trajectory: its samples, its events at their times, and, where they are
/// known, the waypoints and constraints that it was generated from.
/// @param name  Of the trajectory. @param left_out  What the format cannot hold is told there.
[[nodiscard]] ChoreoTrajectory choreo_trajectory(const PathResult& result, const std::string& name,
                                                 std::vector<Diagnostic>& left_out);

/// Numbers, pictures over time and on the field, an animation, and the motion as CSV, WPILib's
/// JSON, Choreo's and a C++ table. Schema "flyball.path/1".
[[nodiscard]] Answer answer_of(const PathResult& result);

}  // namespace flyball::study
