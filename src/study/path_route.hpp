#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <flyball/io/motion/choreo.hpp>
#include <flyball/io/motion/pathplanner.hpp>
#include <flyball/io/motion/wpilib_trajectory.hpp>
#include <flyball/planning/splines/spline.hpp>
#include <flyball/recording/trajectory_file.hpp>
#include <flyball/study/path.hpp>

/// Paths as lines of points, and times along them.
namespace flyball::study {

/// What a motion keeps to; infinite is no limit.
struct RouteLimits {
  double velocity = 0.0;                                  ///< m/s
  double acceleration = 0.0;                              ///< m/s², along and across together.
  double centripetal = 0.0;                               ///< m/s², across.
  double angular_velocity = 0.0;                          ///< rad/s
  double angular_acceleration = 0.0;                      ///< rad/s²
  double jerk = std::numeric_limits<double>::infinity();  ///< m/s³, along and across together.
  Place place{0, 0};                                      ///< In the file; line 0: nowhere.
};

/// A place along a path: 1.5 is halfway along the second segment's parameter.
struct RouteHeading {
  double position = 0.0;
  double heading = 0.0;  ///< rad
};

/// Limits from a place to another.
struct RouteZone {
  double from = 0.0, to = 0.0;
  RouteLimits limits{};
  std::string name{};
};

/// A place that is looked at from a place to another.
struct RoutePointing {
  double from = 0.0, to = 0.0;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double offset = 0.0;  ///< rad
};

/// A path before it has times.
struct RouteShape {
  std::string source{};
  Spline segments{};
  std::vector<RouteHeading> headings{};  ///< Of a robot that looks elsewhere; empty: where it goes.
  bool dense_headings = false;  ///< So many that the headings go straight from each to the next.
  std::vector<RouteZone> zones{};
  std::vector<RoutePointing> pointing{};
  std::vector<double> stops{};  ///< Places at which it stops.
  std::vector<double> marks{};  ///< Places whose times are asked for.
  RouteLimits limits{};
  bool reversed = false;                            ///< Of one that looks where it goes: it backs.
  double start_velocity = 0.0, end_velocity = 0.0;  ///< m/s
  std::vector<Diagnostic> diagnostics{};
};

/// The shapes that files say. @param holonomic  Whether the robot may look elsewhere.
/// @errors ArgumentError, TrajectoryFileError.
[[nodiscard]] Expected<RouteShape> shape_of(const PathPlannerPath& path, const std::string& source,
                                            bool holonomic);
[[nodiscard]] Expected<RouteShape> shape_of(const ChoreoTrajectory& trajectory,
                                            const std::string& source);
[[nodiscard]] Expected<RouteShape> shape_of(const RobotTrajectory& trajectory);

/// A path with times, and what held it back.
struct TimedRoute {
  RobotTrajectory trajectory{};
  std::vector<PathBinding> binding{};
  std::vector<double> mark_times{};  ///< s, of the shape's marks.
};

/// The fastest motion along a shape under its limits and those of a robot's wheels, motors and grip
/// (`time_optimal`), which hold between samples, too. The path is cut at corners of more than 3°,
/// at which it stops. Samples are 10 ms apart or less.
/// @param robot  Absent: only the limits count. @param voltage  V, of its motors.
/// @errors ArgumentError::out_of_range (an end's velocity that cannot be), not_positive, empty.
/// Cost: some milliseconds; allocates.
[[nodiscard]] Expected<TimedRoute> time_route(const RouteShape& shape,
                                              const std::optional<DriveRobot>& robot,
                                              double voltage);

/// A file as a motion.
struct LoadedMotion {
  MotionFormat format = MotionFormat::choreo_trajectory;
  bool timed = false;  ///< Whether its times were made here.
  RobotTrajectory trajectory{};
  std::vector<PathBinding> binding{};
  std::vector<std::string> parts{};
  std::vector<PathEvent> events{};
  std::optional<ChoreoPlan> plan{};  ///< Of one made of Choreo's files alone.
};

/// Reads a file and times it, if it is a path or the job says so; a routine's paths are those
/// beside it (also in ../paths and ../../choreo), joined, its waits between them.
/// @param job  Its limits, name, `retime` and `differential`. @param robot  Absent: none is known.
[[nodiscard]] ExpectedAll<LoadedMotion> load_motion(const std::string& file, const PathJob& job,
                                                    const std::optional<DriveRobot>& robot,
                                                    double voltage);

/// One motion after the other. @param wait  s, at rest between them.
/// @errors ArgumentError::out_of_range where they are more than 10 cm apart.
[[nodiscard]] Expected<void> append(LoadedMotion& motion, const LoadedMotion& next, double wait);

/// A motion from its end to its start.
[[nodiscard]] RobotTrajectory reversed(const RobotTrajectory& trajectory);

/// The field turned or mirrored: x' = sx x + ox, y' = sy y + oy, θ' = sx sy θ + turn.
struct FieldChange {
  double sx = 1.0, ox = 0.0, sy = 1.0, oy = 0.0, turn = 0.0;

  [[nodiscard]] static FieldChange of(const PathJob& job);
  [[nodiscard]] bool none() const noexcept { return sx > 0.0 && sy > 0.0; }
  [[nodiscard]] double hand() const noexcept { return sx * sy; }
  [[nodiscard]] Eigen::Vector2d place(const Eigen::Vector2d& p) const {
    return {sx * p(0) + ox, sy * p(1) + oy};
  }
  [[nodiscard]] Eigen::Vector2d vector(const Eigen::Vector2d& v) const {
    return {sx * v(0), sy * v(1)};
  }
  /// rad
  [[nodiscard]] double heading(double theta) const;
  /// The same with the turn by π to the side that a first heading does not leave its turn by:
  /// twice is none, of headings that are not wrapped, too.
  [[nodiscard]] FieldChange facing(double first) const;
};
[[nodiscard]] RobotTrajectory changed(RobotTrajectory trajectory, const FieldChange& change);
[[nodiscard]] ChoreoTrajectory changed(ChoreoTrajectory file, const FieldChange& change);
[[nodiscard]] PathPlannerPath changed(PathPlannerPath path, const FieldChange& change,
                                      bool reverse);
[[nodiscard]] ChoreoParameters changed(ChoreoParameters parameters, const FieldChange& change);
[[nodiscard]] WpilibTrajectory changed(WpilibTrajectory file, const FieldChange& change);

[[nodiscard]] ChoreoPath2024 changed(ChoreoPath2024 path, const FieldChange& change);

/// A routine as PathPlanner's .auto: itself, or one that drives a job's .path or .traj files one
/// after the other. @errors ArgumentError::out_of_range for what the format cannot hold.
[[nodiscard]] ExpectedAll<std::string> written_routine(const PathJob& job);
/// A project as Choreo's .chor: itself, one of 2024 with its paths turned, or that of the robot of
/// a [drive]. @errors ArgumentError::out_of_range for what the format cannot hold.
[[nodiscard]] ExpectedAll<std::string> written_project(const PathJob& job);

/// Files driven from their end to their start, the same side in front. Waypoints, what holds
/// between them, and events keep the places where they are: an event at t is at the end less t.
[[nodiscard]] ChoreoTrajectory reversed(ChoreoTrajectory file);
[[nodiscard]] ChoreoParameters reversed(ChoreoParameters parameters);
[[nodiscard]] WpilibTrajectory reversed(WpilibTrajectory file);

// ---- what happens along a motion ----------------------------------------------------------------

/// What a Choreo file has happen, and when; what it has waypoints for, and when they are reached.
void take_choreo(LoadedMotion& motion, const ChoreoTrajectory& file);
/// The same of a path of a project of 2024: its events.
void take_choreo(LoadedMotion& motion, const ChoreoPath2024& path);

/// Times of one timing of a way as those of another: where the same share of its length is done.
[[nodiscard]] double time_at_share(const RobotTrajectory& from, const RobotTrajectory& to,
                                   double time);

}  // namespace flyball::study
