#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/io/motion/json_parts.hpp>

/// PathPlanner's files: paths (.path) of 2023, 2024 and 2025, autonomous routines (.auto),
/// settings.json and navgrid.json. As in the files, lengths are in m and angles in degrees. All
/// structs keep what else stood in their file.
namespace flyball {

/// A place of the field.
struct PlannerPoint {
  double x = 0.0;  ///< m
  double y = 0.0;  ///< m
  JsonOrigin origin{};
};

/// A point of a path with its Bézier curves' control points.
struct PathPlannerWaypoint {
  PlannerPoint anchor{};
  std::optional<PlannerPoint> previous_control{};  ///< Absent at the start.
  std::optional<PlannerPoint> next_control{};      ///< Absent at the end.
  bool is_locked = false;
  std::optional<std::string> linked_name{};   ///< Waypoints of one name are in one place.
  std::optional<double> holonomic_angle{};    ///< °, of 2023: the way that the robot looks,
  std::optional<bool> is_reversal{};          ///< whether it goes back from here,
  std::optional<double> velocity_override{};  ///< m/s, how fast it is here,
  std::optional<bool> is_stop_point{};        ///< and whether it stops.
  JsonOrigin origin{};
};

/// What a path's motion keeps to.
struct PathPlannerConstraints {
  double max_velocity = 3.0;                ///< m/s
  double max_acceleration = 3.0;            ///< m/s²
  double max_angular_velocity = 540.0;      ///< °/s
  double max_angular_acceleration = 720.0;  ///< °/s²
  std::optional<double> nominal_voltage{};  ///< V, since 2025,
  std::optional<bool> unlimited{};          ///< and whether only the robot limits it.
  JsonOrigin origin{};
};

/// Where a robot looks along a path.
struct PathPlannerRotation {
  double position = 0.0;  ///< 1.5: halfway from the second waypoint to the third.
  double degrees = 0.0;   ///< °
  JsonOrigin origin{};
};

/// A part of a path with limits of its own.
struct PathPlannerZone {
  std::string name{};
  double from = 0.0, to = 0.0;  ///< As `PathPlannerRotation::position`.
  PathPlannerConstraints constraints{};
  JsonOrigin origin{};
};

/// A part of a path along which the robot looks at a place.
struct PathPlannerPointing {
  std::string name{};
  PlannerPoint place{};
  double rotation_offset = 0.0;  ///< °, of the side that looks there.
  double from = 0.0, to = 0.0;
  JsonOrigin origin{};
};

/// Something that happens along a path.
struct PathPlannerMarker {
  std::string name{};
  double position = 0.0;
  std::optional<double> end_position{};  ///< Of one that lasts.
  std::optional<AutoCommand> command{};  ///< Since 2024,
  std::vector<std::string> names{};      ///< before a list of names.
  JsonOrigin origin{};
};

/// How a robot is at an end of a path.
struct PathPlannerState {
  double velocity = 0.0;  ///< m/s
  double rotation = 0.0;  ///< °
  JsonOrigin origin{};
};

/// A path file.
struct PathPlannerPath {
  bool is_2023 = false;   ///< Without a version.
  std::string version{};  ///< "2025.0"; "1.0" of 2024.
  std::vector<PathPlannerWaypoint> waypoints{};
  std::vector<PathPlannerRotation> rotation_targets{};
  std::vector<PathPlannerZone> zones{};
  std::vector<PathPlannerPointing> pointing{};  ///< Since 2025.
  std::vector<PathPlannerMarker> markers{};
  PathPlannerConstraints constraints{};
  std::optional<double> max_velocity{}, max_acceleration{};  ///< Of 2023.
  std::optional<PathPlannerState> goal_end_state{};
  std::optional<PathPlannerState> ideal_starting_state{};    ///< Since 2025,
  std::optional<PathPlannerState> preview_starting_state{};  ///< of 2024.
  bool reversed = false;
  std::optional<std::string> folder{};
  std::optional<bool> use_default_constraints{};
  std::vector<Diagnostic> diagnostics{};  ///< A version that is not known.
  JsonOrigin origin{};
};

/// An autonomous routine: paths and commands, one after the other or beside each other.
struct PathPlannerAuto {
  std::string version{};  ///< "2025.0"; "1.0" of 2024.
  AutoCommand command{};
  std::optional<bool> reset_odometry{};  ///< Since 2025.
  std::optional<std::string> folder{};
  bool choreo_auto = false;  ///< Whether its paths are Choreo's.
  std::vector<Diagnostic> diagnostics{};
  JsonOrigin origin{};

  /// The paths in the order in which they come, groups gone through.
  [[nodiscard]] std::vector<std::string> paths() const;
};

/// settings.json: what PathPlanner knows of a robot; what it does not say is absent.
struct PathPlannerSettingsFile {
  std::optional<double> robot_width{}, robot_length{};  ///< m, with bumpers.
  std::optional<bool> holonomic{};
  std::optional<std::vector<std::string>> path_folders{}, auto_folders{};
  std::optional<double> max_velocity{};              ///< m/s
  std::optional<double> max_acceleration{};          ///< m/s²
  std::optional<double> max_angular_velocity{};      ///< °/s
  std::optional<double> max_angular_acceleration{};  ///< °/s²
  std::optional<double> nominal_voltage{};           ///< V
  std::optional<double> mass{};                      ///< kg
  std::optional<double> moment_of_inertia{};         ///< kg m²
  std::optional<double> trackwidth{};                ///< m
  std::optional<double> wheel_radius{};              ///< m
  std::optional<double> gearing{};                   ///< Motor turns per wheel turn.
  std::optional<double> max_drive_speed{};           ///< m/s
  std::optional<std::string> motor{};                ///< "krakenX60"
  std::optional<double> current_limit{};             ///< A
  std::optional<double> wheel_friction{};            ///< μ
  /// m, x and y of the modules FL, FR, BL, BR.
  std::optional<double> fl_x{}, fl_y{}, fr_x{}, fr_y{}, bl_x{}, bl_y{}, br_x{}, br_y{};
  std::optional<double> bumper_offset_x{}, bumper_offset_y{};  ///< m
  std::optional<std::vector<std::string>> features{};          ///< Drawings, JSON in texts.
  JsonOrigin origin{};
};

/// navgrid.json: where a robot may be, cell by cell.
struct PathPlannerGrid {
  PlannerPoint field_size{};              ///< m
  double node_size = 0.3;                 ///< m, of a cell's side.
  std::vector<std::vector<bool>> rows{};  ///< Whether there is an obstacle, from y = 0 and x = 0.
  JsonOrigin origin{};
};

/// Reads a .path file of any year; one of a newer version as far as it says what those do, with a
/// warning. @param text  The file. @param source  Its name for messages.
/// @errors MotionFileError with line, column and caret. Cost: O(size); at most 64 MiB and half a
/// million values. Source: PathPlanner, its documentation and its files of each year.
[[nodiscard]] ExpectedAll<PathPlannerPath> parse_pathplanner_path(std::string_view text,
                                                                  const std::string& source);
/// The same of a file. @errors FileError, too.
[[nodiscard]] ExpectedAll<PathPlannerPath> read_pathplanner_path(const std::string& path);
/// Reads an .auto file. @errors as `parse_pathplanner_path`.
[[nodiscard]] ExpectedAll<PathPlannerAuto> parse_pathplanner_auto(std::string_view text,
                                                                  const std::string& source);
/// The same of a file. @errors FileError, too.
[[nodiscard]] ExpectedAll<PathPlannerAuto> read_pathplanner_auto(const std::string& path);
/// Reads settings.json. @errors as `parse_pathplanner_path`.
[[nodiscard]] ExpectedAll<PathPlannerSettingsFile> parse_pathplanner_settings_file(
    std::string_view text, const std::string& source);
/// Reads navgrid.json: rows of one length, as many as the field has cells.
/// @errors as `parse_pathplanner_path`.
[[nodiscard]] ExpectedAll<PathPlannerGrid> parse_pathplanner_grid(std::string_view text,
                                                                  const std::string& source);

/// The file as text. What was read and not changed is written byte by byte as it stood; what is
/// new as PathPlanner would.
/// @errors MotionFileError::wrong_field for a number that is not finite. Cost: O(size).
[[nodiscard]] Expected<std::string> to_pathplanner(const PathPlannerPath& path);
[[nodiscard]] Expected<std::string> to_pathplanner(const PathPlannerAuto& routine);
[[nodiscard]] Expected<std::string> to_pathplanner(const PathPlannerSettingsFile& settings);
[[nodiscard]] Expected<std::string> to_pathplanner(const PathPlannerGrid& grid);
/// The same into a file, which is replaced whole. @errors FileError, too.
[[nodiscard]] Expected<void> write_pathplanner(const std::string& path,
                                               const PathPlannerPath& contents);
[[nodiscard]] Expected<void> write_pathplanner(const std::string& path,
                                               const PathPlannerAuto& contents);
[[nodiscard]] Expected<void> write_pathplanner(const std::string& path,
                                               const PathPlannerSettingsFile& contents);
[[nodiscard]] Expected<void> write_pathplanner(const std::string& path,
                                               const PathPlannerGrid& contents);

}  // namespace flyball
