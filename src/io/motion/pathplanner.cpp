#include <flyball/io/motion/pathplanner.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/text.hpp>
#include <flyball/io/file.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "io/motion/json_fields.hpp"

namespace flyball {

namespace {

using io::JsonNode;
using io::JsonTree;

/// As Dart's encoder indents.
constexpr io::JsonStyle pathplanner_style{.indent = 2, .rows = false, .colon = ": "};

struct DescribePoint {
  template <class A, class P>
  void operator()(A& a, P& p) const {
    a("x", p.x);
    a("y", p.y);
  }
};

struct DescribePathPlannerWaypoint {
  template <class A, class W>
  void operator()(A& a, W& w) const {
    a.object("anchor", w.anchor, DescribePoint{});
    a.nullable("prevControl", w.previous_control, DescribePoint{});
    a.nullable("nextControl", w.next_control, DescribePoint{});
    a("isLocked", w.is_locked);
    a.nullable("linkedName", w.linked_name);
  }
};

struct DescribeWaypoint2023 {
  template <class A, class W>
  void operator()(A& a, W& w) const {
    a.object("anchorPoint", w.anchor, DescribePoint{});
    a.nullable("prevControl", w.previous_control, DescribePoint{});
    a.nullable("nextControl", w.next_control, DescribePoint{});
    a.nullable("holonomicAngle", w.holonomic_angle);
    a("isReversal", w.is_reversal);
    a.nullable("velOverride", w.velocity_override);
    a.maybe("isLocked", w.is_locked);
    a("isStopPoint", w.is_stop_point);
  }
};

struct DescribeConstraints {
  template <class A, class C>
  void operator()(A& a, C& c) const {
    a("maxVelocity", c.max_velocity);
    a("maxAcceleration", c.max_acceleration);
    a("maxAngularVelocity", c.max_angular_velocity);
    a("maxAngularAcceleration", c.max_angular_acceleration);
    a("nominalVoltage", c.nominal_voltage);
    a("unlimited", c.unlimited);
  }
};

struct DescribeRotationTarget {
  template <class A, class R>
  void operator()(A& a, R& r) const {
    a("waypointRelativePos", r.position);
    a("rotationDegrees", r.degrees);
  }
};

struct DescribeZone {
  template <class A, class Z>
  void operator()(A& a, Z& z) const {
    a.maybe("name", z.name);
    a("minWaypointRelativePos", z.from);
    a("maxWaypointRelativePos", z.to);
    a.object("constraints", z.constraints, DescribeConstraints{});
  }
};

struct DescribePointing {
  template <class A, class P>
  void operator()(A& a, P& p) const {
    a.object("fieldPosition", p.place, DescribePoint{});
    a("rotationOffset", p.rotation_offset);
    a("minWaypointRelativePos", p.from);
    a("maxWaypointRelativePos", p.to);
    a.maybe("name", p.name);
  }
};

struct DescribeMarker {
  template <class A, class M>
  void operator()(A& a, M& m) const {
    a.maybe("name", m.name);
    a("waypointRelativePos", m.position);
    a("endWaypointRelativePos", m.end_position);
    a.nullable("command", m.command);
  }
};

struct DescribeMarker2023 {
  template <class A, class M>
  void operator()(A& a, M& m) const {
    a("position", m.position);
    a.maybe("names", m.names);
  }
};

struct DescribePathPlannerState {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a("velocity", s.velocity);
    a("rotation", s.rotation);
  }
};

/// Of 2024, whose preview may be without a velocity.
struct DescribePreview {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a("rotation", s.rotation);
    a.maybe("velocity", s.velocity);
  }
};

struct DescribePath {
  template <class A, class P>
  void operator()(A& a, P& p) const {
    if (p.is_2023) {
      a.list("waypoints", p.waypoints, DescribeWaypoint2023{});
      a("maxVelocity", p.max_velocity);
      a("maxAcceleration", p.max_acceleration);
      a.maybe("isReversed", p.reversed);
      a.list("markers", p.markers, DescribeMarker2023{}, false);
      return;
    }
    a.id("version", p.version);
    a.list("waypoints", p.waypoints, DescribePathPlannerWaypoint{});
    a.list("rotationTargets", p.rotation_targets, DescribeRotationTarget{}, false);
    a.list("constraintZones", p.zones, DescribeZone{}, false);
    a.list("pointTowardsZones", p.pointing, DescribePointing{}, false);
    a.list("eventMarkers", p.markers, DescribeMarker{}, false);
    a.object("globalConstraints", p.constraints, DescribeConstraints{});
    a.object("goalEndState", p.goal_end_state, DescribePathPlannerState{});
    a("reversed", p.reversed);
    a.nullable("folder", p.folder);
    a.object("idealStartingState", p.ideal_starting_state, DescribePathPlannerState{});
    a.object("previewStartingState", p.preview_starting_state, DescribePreview{});
    a("useDefaultConstraints", p.use_default_constraints);
  }
};

struct DescribeAuto {
  template <class A, class R>
  void operator()(A& a, R& r) const {
    a.id("version", r.version);
    a("command", r.command);
    a("resetOdom", r.reset_odometry);
    a.nullable("folder", r.folder);
    a.usual("choreoAuto", r.choreo_auto);
  }
};

struct DescribeSettings {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a("robotWidth", s.robot_width);
    a("robotLength", s.robot_length);
    a("holonomicMode", s.holonomic);
    a("pathFolders", s.path_folders);
    a("autoFolders", s.auto_folders);
    a("defaultMaxVel", s.max_velocity);
    a("defaultMaxAccel", s.max_acceleration);
    a("defaultMaxAngVel", s.max_angular_velocity);
    a("defaultMaxAngAccel", s.max_angular_acceleration);
    a("defaultNominalVoltage", s.nominal_voltage);
    a("robotMass", s.mass);
    a("robotMOI", s.moment_of_inertia);
    a("robotTrackwidth", s.trackwidth);
    a("driveWheelRadius", s.wheel_radius);
    a("driveGearing", s.gearing);
    a("maxDriveSpeed", s.max_drive_speed);
    a("driveMotorType", s.motor);
    a("driveCurrentLimit", s.current_limit);
    a("wheelCOF", s.wheel_friction);
    a("flModuleX", s.fl_x);
    a("flModuleY", s.fl_y);
    a("frModuleX", s.fr_x);
    a("frModuleY", s.fr_y);
    a("blModuleX", s.bl_x);
    a("blModuleY", s.bl_y);
    a("brModuleX", s.br_x);
    a("brModuleY", s.br_y);
    a("bumperOffsetX", s.bumper_offset_x);
    a("bumperOffsetY", s.bumper_offset_y);
    a("robotFeatures", s.features);
  }
};

struct DescribeGrid {
  template <class A, class G>
  void operator()(A& a, G& g) const {
    a.object("field_size", g.field_size, DescribePoint{});
    a("nodeSizeMeters", g.node_size);
    a("grid", g.rows);
  }
};

/// Versions that are known: 2024's 1.0 and 2025's.
void look_at_version(const std::string& version, std::vector<Diagnostic>& diagnostics) {
  if (version != "1" && version != "1.0" && !version.starts_with("2025.")) {
    warn(diagnostics, "unknown_version",
         "the file's version is {}, of which nothing is known (1.0 and 2025 are): it was read as "
         "one of 2025",
         cut(printable(version), 40));
  }
}

tl::unexpected<Errors> wrong_kind(const JsonTree& tree, const std::string& source,
                                  std::string_view expected) {
  return tl::unexpected(Errors(Error(MotionFileError::wrong_kind)
                                   .in(source)
                                   .about("the JSON")
                                   .got(io::outline(tree.root))
                                   .expected(std::string(expected))));
}

void collect_paths(const AutoCommand& command, std::vector<std::string>& paths) {
  if (command.type == "path") {
    paths.push_back(command.name);
  }
  for (const AutoCommand& one : command.commands) {
    collect_paths(one, paths);
  }
}

template <class T>
Expected<void> write(const std::string& path, const T& contents) {
  FLYBALL_TRY(const std::string text, to_pathplanner(contents));
  return write_file_atomically(path, text);
}

}  // namespace

std::vector<std::string> PathPlannerAuto::paths() const {
  std::vector<std::string> all;
  collect_paths(command, all);
  return all;
}

ExpectedAll<PathPlannerPath> parse_pathplanner_path(std::string_view text,
                                                    const std::string& source) {
  FLYBALL_TRY(const auto tree, io::parse_json_tree(text, source));
  const JsonNode* const waypoints = tree->root.find("waypoints");
  PathPlannerPath path;
  path.is_2023 = tree->root.find("version") == nullptr;
  if (waypoints == nullptr || tree->root.find("samples") != nullptr) {
    return wrong_kind(*tree, source, "a path of PathPlanner: version, waypoints, …");
  }
  FLYBALL_TRY(path, io::read_document(tree, source, std::move(path), DescribePath{}));
  if (!path.is_2023) {
    look_at_version(path.version, path.diagnostics);
  }
  return path;
}

ExpectedAll<PathPlannerAuto> parse_pathplanner_auto(std::string_view text,
                                                    const std::string& source) {
  FLYBALL_TRY(const auto tree, io::parse_json_tree(text, source));
  if (tree->root.find("command") == nullptr) {
    return wrong_kind(*tree, source, "an autonomous routine of PathPlanner: version, command, …");
  }
  FLYBALL_TRY(auto routine, io::read_document(tree, source, PathPlannerAuto{}, DescribeAuto{}));
  look_at_version(routine.version, routine.diagnostics);
  return routine;
}

ExpectedAll<PathPlannerSettingsFile> parse_pathplanner_settings_file(std::string_view text,
                                                                     const std::string& source) {
  FLYBALL_TRY(const auto tree, io::parse_json_tree(text, source));
  if (tree->root.find("robotMass") == nullptr && tree->root.find("holonomicMode") == nullptr &&
      tree->root.find("robotWidth") == nullptr) {
    return wrong_kind(*tree, source, "PathPlanner's settings: robotWidth, holonomicMode, …");
  }
  return io::read_document(tree, source, PathPlannerSettingsFile{}, DescribeSettings{});
}

ExpectedAll<PathPlannerGrid> parse_pathplanner_grid(std::string_view text,
                                                    const std::string& source) {
  FLYBALL_TRY(const auto tree, io::parse_json_tree(text, source));
  const JsonNode* const rows = tree->root.find("grid");
  if (rows == nullptr) {
    return wrong_kind(*tree, source,
                      "PathPlanner's navigation grid: field_size, nodeSizeMeters, grid");
  }
  FLYBALL_TRY(auto grid, io::read_document(tree, source, PathPlannerGrid{}, DescribeGrid{}));
  const auto refuse = [&](const JsonNode& node, std::string subject, std::string got,
                          std::string expected) {
    return tl::unexpected(Errors(std::vector<QuotedError>{
        io::quoted_at(tree->text, node.begin, node.end - node.begin, source,
                      Error(MotionFileError::wrong_field)
                          .about(std::move(subject))
                          .got(std::move(got))
                          .expected(std::move(expected)))}));
  };
  if (!(grid.node_size > 0.0)) {
    return refuse(*tree->root.find("nodeSizeMeters"), "nodeSizeMeters",
                  fmt::format("{}", grid.node_size), "positive");
  }
  for (std::size_t i = 1; i < grid.rows.size(); ++i) {
    if (grid.rows[i].size() != grid.rows[0].size()) {
      return refuse(rows->children[i], fmt::format("grid[{}]", i),
                    fmt::format("of {} cells", grid.rows[i].size()),
                    fmt::format("{}, as the first row has", grid.rows[0].size()));
    }
  }
  return grid;
}

ExpectedAll<PathPlannerPath> read_pathplanner_path(const std::string& path) {
  FLYBALL_TRY(const std::string text, read_file(path, io::most_json_bytes));
  return parse_pathplanner_path(text, path);
}

ExpectedAll<PathPlannerAuto> read_pathplanner_auto(const std::string& path) {
  FLYBALL_TRY(const std::string text, read_file(path, io::most_json_bytes));
  return parse_pathplanner_auto(text, path);
}

Expected<std::string> to_pathplanner(const PathPlannerPath& path) {
  return io::checked_text(io::write_document(path, DescribePath{}, pathplanner_style));
}
Expected<std::string> to_pathplanner(const PathPlannerAuto& routine) {
  return io::checked_text(io::write_document(routine, DescribeAuto{}, pathplanner_style));
}
Expected<std::string> to_pathplanner(const PathPlannerSettingsFile& settings) {
  return io::checked_text(io::write_document(settings, DescribeSettings{}, pathplanner_style));
}
Expected<std::string> to_pathplanner(const PathPlannerGrid& grid) {
  return io::checked_text(io::write_document(grid, DescribeGrid{}, pathplanner_style));
}

Expected<void> write_pathplanner(const std::string& path, const PathPlannerPath& contents) {
  return write(path, contents);
}
Expected<void> write_pathplanner(const std::string& path, const PathPlannerAuto& contents) {
  return write(path, contents);
}
Expected<void> write_pathplanner(const std::string& path, const PathPlannerSettingsFile& contents) {
  return write(path, contents);
}
Expected<void> write_pathplanner(const std::string& path, const PathPlannerGrid& contents) {
  return write(path, contents);
}

}  // namespace flyball
