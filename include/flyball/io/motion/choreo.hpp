#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/io/motion/json_parts.hpp>

/// Choreo's files: trajectories (.traj) and projects (.chor), of 2024, of the 2025 betas and of
/// the schemas since. SI, headings in rad, the field's frame from the blue corner; modules FL, FR,
/// BL, BR. What a version lacks is absent. All structs keep what else stood in their file.
namespace flyball {

/// Where a robot is at a time. A swerve's sample has vx to fy, a differential drive's vl to fr,
/// those of 2024 neither accelerations nor forces.
struct ChoreoSample {
  double time = 0.0;                 ///< s
  double x = 0.0;                    ///< m
  double y = 0.0;                    ///< m
  double heading = 0.0;              ///< rad, not wrapped.
  std::optional<double> vx{}, vy{};  ///< m/s, in the field.
  std::optional<double> vl{}, vr{};  ///< m/s, of the sides.
  std::optional<double> omega{};     ///< rad/s; differential drives have it since version 1.
  std::optional<double> ax{}, ay{};  ///< m/s²
  std::optional<double> al{}, ar{};  ///< m/s²
  std::optional<double> alpha{};     ///< rad/s²
  std::optional<std::array<double, 4>> fx{}, fy{};  ///< N, on each module, in the field.
  std::optional<double> fl{}, fr{};                 ///< N, of the sides.
  JsonOrigin origin{};
};

/// A pose that a path goes through. In a snapshot the numbers have no expressions.
struct ChoreoWaypoint {
  ExpressedNumber x{}, y{};   ///< m
  ExpressedNumber heading{};  ///< rad
  int intervals = 0;          ///< Of the samples until the next waypoint.
  bool split = false;         ///< Whether the trajectory is split here.
  bool fix_translation = true;
  bool fix_heading = true;
  bool override_intervals = false;
  std::optional<double> time{};            ///< s, of 2024, where it was generated.
  std::optional<bool> is_initial_guess{};  ///< Of 2024: in place of neither fixed.
  std::optional<bool> is_stop_point{};     ///< Of 2024's trajectoryWaypoints.
  JsonOrigin origin{};
};

/// What holds at a waypoint, or from one to another.
struct ChoreoConstraint {
  std::string from{};                ///< "first", "last" or an index; of 2024: of `scope`.
  std::optional<std::string> to{};   ///< The same; absent: at `from` alone.
  std::string type{};                ///< "StopPoint", "MaxVelocity", "MaxAngularVelocity",
                                     ///< "MaxAcceleration", "PointAt", "KeepInCircle",
                                     ///< "KeepInRectangle", "KeepInLane", "KeepOutCircle".
  std::vector<NamedNumber> props{};  ///< "max", "x", "y", "r", "w", "h", "tolerance".
  std::optional<bool> flip{};        ///< Of "PointAt": whether the back looks there.
  bool enabled = true;
  JsonOrigin origin{};

  /// A number of `props`, if it is there.
  [[nodiscard]] std::optional<double> prop(std::string_view name) const;
};

/// What a trajectory is generated from.
struct ChoreoParameters {
  std::vector<ChoreoWaypoint> waypoints{};
  std::vector<ChoreoConstraint> constraints{};
  ExpressedNumber target_dt{};  ///< s
  JsonOrigin origin{};
};

/// A place of the robot.
struct ChoreoPlace {
  ExpressedNumber x{}, y{};  ///< m
  JsonOrigin origin{};
};

/// Distances from the robot's middle to its bumpers.
struct ChoreoBumper {
  ExpressedNumber front{}, side{}, back{};  ///< m
  JsonOrigin origin{};
};

/// What a trajectory is generated for.
struct ChoreoConfig {
  ChoreoPlace front_left{}, back_left{};  ///< Modules; the right ones mirror them.
  ExpressedNumber mass{};                 ///< kg
  ExpressedNumber inertia{};              ///< kg m²
  ExpressedNumber gearing{};              ///< Motor turns per wheel turn.
  ExpressedNumber radius{};               ///< m, of the wheels.
  ExpressedNumber vmax{};                 ///< rad/s, of the motor.
  ExpressedNumber tmax{};                 ///< N m, of the motor.
  std::optional<ExpressedNumber> cof{};   ///< Friction of the wheels, since version 1.
  ChoreoBumper bumper{};
  std::optional<ExpressedNumber> differential_track_width{};  ///< m
  JsonOrigin origin{};

  /// m/s that the wheels reach: vmax radius / gearing.
  [[nodiscard]] double wheel_speed() const noexcept {
    return vmax.value * radius.value / gearing.value;
  }
  /// N that all wheels of `motors` motors push with: the motors' torque, at most the friction.
  [[nodiscard]] double wheel_force() const noexcept {
    return tmax.value * gearing.value / radius.value;
  }
};

/// Something that happens at a time of the trajectory.
struct ChoreoEvent {
  std::string name{};
  std::optional<int> target{};               ///< The waypoint that the time counts from.
  std::optional<double> target_timestamp{};  ///< s, of the waypoint; of 2024 of the event.
  ExpressedNumber offset{};                  ///< s
  std::optional<AutoCommand> command{};
  JsonOrigin origin{};

  /// s since the start, if it is known.
  [[nodiscard]] std::optional<double> time() const;
};

/// What was generated.
struct ChoreoGenerated {
  std::optional<ChoreoConfig> config{};      ///< Since version 3.
  std::optional<std::string> sample_type{};  ///< "Swerve", "Differential"; since version 1.
  std::vector<double> waypoints{};           ///< s, when each waypoint is reached.
  std::vector<ChoreoSample> samples{};       ///< Empty: not generated yet.
  std::vector<int> splits{};                 ///< Indices of the samples that a part begins with.
  JsonOrigin origin{};
};

/// A trajectory file.
struct ChoreoTrajectory {
  /// Newest version that is known.
  static constexpr int newest = 3;

  bool is_2024 = false;                        ///< {"samples": […], "eventMarkers": […]}.
  std::string name{};                          ///< Of 2024: the file's.
  std::string version{};                       ///< "3"; "v2025.0.0" of the betas; empty of 2024.
  std::optional<ChoreoParameters> snapshot{};  ///< The parameters that it was generated with.
  ChoreoParameters params{};
  ChoreoGenerated trajectory{};
  std::vector<ChoreoEvent> events{};
  std::vector<Diagnostic> diagnostics{};  ///< A version that is not known.
  JsonOrigin origin{};

  /// Whether its samples are those of a differential drive.
  [[nodiscard]] bool differential() const noexcept;
};

/// A path of a project of 2024, which held them all.
struct ChoreoPath2024 {
  std::string name{};
  std::vector<ChoreoWaypoint> waypoints{};
  std::vector<ChoreoSample> trajectory{};
  std::vector<ChoreoWaypoint> trajectory_waypoints{};
  std::vector<ChoreoEvent> events{};
  JsonOrigin origin{};
};

/// The robot of a project of 2024.
struct ChoreoRobot2024 {
  double mass = 0.0;                ///< kg
  double rotational_inertia = 0.0;  ///< kg m²
  double motor_max_torque = 0.0;    ///< N m
  double motor_max_velocity = 0.0;  ///< Turns a minute, of the motor.
  double gearing = 0.0;             ///< Motor turns per wheel turn.
  double wheelbase = 0.0;           ///< m
  double track_width = 0.0;         ///< m
  double bumper_length = 0.0;       ///< m
  double bumper_width = 0.0;        ///< m
  double wheel_radius = 0.0;        ///< m
  JsonOrigin origin{};
};

/// A project file.
struct ChoreoProject {
  /// Newest version that is known.
  static constexpr int newest = 2;

  std::string name{};
  std::string version{};  ///< "2"; "v2025.0.0" of the betas; "v0.3.1" of 2024.
  std::string type{};     ///< "Swerve", "Differential"; empty of 2024.
  std::optional<ChoreoConfig> config{};
  std::optional<ChoreoRobot2024> robot{};  ///< Of 2024,
  std::vector<ChoreoPath2024> paths{};     ///< and its paths.
  std::vector<Diagnostic> diagnostics{};   ///< A version that is not known.
  JsonOrigin origin{};
};

/// Reads a .traj file of any version: 2024's list of samples, the betas' "v2025.0.0", 0 to 3; one
/// of a newer version as far as it says what those do, with a warning. Nothing is said of the
/// motion itself: times may go back.
/// @param text  The file. @param source  Its name for messages.
/// @errors MotionFileError with line, column and caret. Cost: O(size); at most 64 MiB and half a
/// million values. Source: Choreo, its documentation of the format and its files of each version.
[[nodiscard]] ExpectedAll<ChoreoTrajectory> parse_choreo_trajectory(std::string_view text,
                                                                    const std::string& source);
/// The same of a file. @errors FileError, too.
[[nodiscard]] ExpectedAll<ChoreoTrajectory> read_choreo_trajectory(const std::string& path);

/// Reads a .chor file of any version. @errors as `parse_choreo_trajectory`.
[[nodiscard]] ExpectedAll<ChoreoProject> parse_choreo_project(std::string_view text,
                                                              const std::string& source);
/// The same of a file. @errors FileError, too.
[[nodiscard]] ExpectedAll<ChoreoProject> read_choreo_project(const std::string& path);

/// The file as text. What was read and not changed is written byte by byte as it stood; what is
/// new as Choreo would, a sample a line.
/// @errors MotionFileError::wrong_field for a number that is not finite. Cost: O(size).
[[nodiscard]] Expected<std::string> to_choreo(const ChoreoTrajectory& trajectory);
[[nodiscard]] Expected<std::string> to_choreo(const ChoreoProject& project);
/// The same into a file, which is replaced whole. @errors FileError, too.
[[nodiscard]] Expected<void> write_choreo(const std::string& path,
                                          const ChoreoTrajectory& trajectory);
[[nodiscard]] Expected<void> write_choreo(const std::string& path, const ChoreoProject& project);

}  // namespace flyball
