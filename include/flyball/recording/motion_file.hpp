#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/errors.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/io/log.hpp>
#include <flyball/io/motion/choreo.hpp>
#include <flyball/io/motion/wpilib_trajectory.hpp>
#include <flyball/recording/trajectory_file.hpp>

/// The files of planning tools as motions over time, and motions as those files.
namespace flyball {

/// What a file of a planning tool is; told by what stands in it.
enum class MotionFormat {
  choreo_trajectory,     ///< .traj
  choreo_project,        ///< .chor; of 2024 with paths.
  pathplanner_path,      ///< .path
  pathplanner_auto,      ///< .auto
  pathplanner_settings,  ///< settings.json
  pathplanner_grid,      ///< navgrid.json
  wpilib_trajectory,     ///< WPILib's JSON
  trajectory_table,      ///< CSV: time, x, y, heading, …
};
/// "a Choreo trajectory", …
[[nodiscard]] std::string_view to_string(MotionFormat format);

/// @errors MotionFileError::not_json (with its place), wrong_kind.
[[nodiscard]] ExpectedAll<MotionFormat> motion_format(std::string_view text,
                                                      const std::string& source);

/// The samples of a Choreo trajectory. A differential drive's velocity is the mean of its sides'
/// along its heading, ω, where version 0 has none, what the headings turn by; 2024's accelerations
/// are the differences of its velocities.
/// @errors TrajectoryFileError::too_few (not generated yet), time_order, wrong_sample (neither
///         vx, vy nor vl, vr), each with the place.
[[nodiscard]] Expected<RobotTrajectory> trajectory_of(const ChoreoTrajectory& file,
                                                      const std::string& source);
/// The same of a path of a project of 2024.
[[nodiscard]] Expected<RobotTrajectory> trajectory_of(const ChoreoPath2024& path,
                                                      const std::string& source);

/// A table of a motion: columns time, x, y, heading, and, where they are there, vx, vy, omega, ax,
/// ay, alpha, of the field and in SI or in the units that the header says. What is missing comes of
/// differences.
/// @errors TrajectoryFileError::not_a_trajectory (no x, y), time_order, too_few; those of the log.
[[nodiscard]] Expected<RobotTrajectory> trajectory_of(const Log& table);

/// A file that is a motion over time: Choreo's, WPILib's, a table. Of a project of 2024 with
/// several paths `path` says which. @param path  Its name; empty: the only one.
/// @errors FileError, MotionFileError, TrajectoryFileError, LogError; TrajectoryFileError::
///         not_a_trajectory for a path without times.
[[nodiscard]] ExpectedAll<RobotTrajectory> read_motion(const std::string& file,
                                                       const std::string& path = {});

/// rad/s² at each sample: what the turning rates change by, half from each side.
[[nodiscard]] std::vector<double> angular_accelerations(const RobotTrajectory& trajectory);

/// As WPILib's list of states along the path. @param trajectory  Of a robot that looks where it
/// goes, forwards or backwards; of another the list has PathPlanner's holonomicRotation.
[[nodiscard]] WpilibTrajectory to_wpilib_trajectory(const RobotTrajectory& trajectory);

/// A differential drive's wheels for Choreo's samples.
struct ChoreoSides {
  double trackwidth = 0.0;  ///< m
};
/// As a Choreo trajectory of the newest version: samples, the ends as waypoints; no forces.
/// @param name  Of the trajectory. @param sides  Of a differential drive; absent: a swerve.
/// @param config  The robot, if it is known.
[[nodiscard]] ChoreoTrajectory to_choreo_trajectory(const RobotTrajectory& trajectory,
                                                    const std::string& name,
                                                    const std::optional<ChoreoSides>& sides = {},
                                                    const std::optional<ChoreoConfig>& config = {});

/// As a table: time, x, y, heading (continuous), vx, vy, omega, ax, ay, alpha, curvature.
/// `trajectory_of` reads it back, headings to rounding.
[[nodiscard]] Expected<TimeSeries> to_table(const RobotTrajectory& trajectory);

}  // namespace flyball
