#include <flyball/io/motion/pathplanner.hpp>

#include <filesystem>

#include <gtest/gtest.h>

#include <flyball/io/file.hpp>

namespace flyball::pathplanner_test {
namespace {

const std::string path_2025 = R"({
  "version": "2025.0",
  "waypoints": [
    {
      "anchor": { "x": 1.5, "y": 2.0 },
      "prevControl": null,
      "nextControl": { "x": 2.5, "y": 2.0, "z": 0 },
      "isLocked": false,
      "linkedName": null
    },
    {
      "anchor": { "x": 4, "y": 3.0 },
      "prevControl": { "x": 3.0, "y": 3.0 },
      "nextControl": null,
      "isLocked": true,
      "linkedName": "goal"
    }
  ],
  "rotationTargets": [ { "waypointRelativePos": 0.5, "rotationDegrees": 90.0 } ],
  "constraintZones": [ { "name": "slow", "minWaypointRelativePos": 0.25, "maxWaypointRelativePos": 0.75,
    "constraints": { "maxVelocity": 1.0, "maxAcceleration": 2.0, "maxAngularVelocity": 90.0, "maxAngularAcceleration": 180.0, "nominalVoltage": 12.0, "unlimited": false } } ],
  "pointTowardsZones": [ { "fieldPosition": { "x": 0.4, "y": 5.5 }, "rotationOffset": 180.0, "minWaypointRelativePos": 0.1, "maxWaypointRelativePos": 0.2, "name": "goal" } ],
  "eventMarkers": [
    { "name": "go", "waypointRelativePos": 0.5, "endWaypointRelativePos": null,
      "command": { "type": "parallel", "data": { "commands": [ { "type": "named", "data": { "name": "a" } }, { "type": "wait", "data": { "waitTime": 0.5 } } ] } } }
  ],
  "globalConstraints": { "maxVelocity": 3.0, "maxAcceleration": 3.0, "maxAngularVelocity": 540.0, "maxAngularAcceleration": 720.0, "nominalVoltage": 12.0, "unlimited": false },
  "goalEndState": { "velocity": 0, "rotation": -45.0 },
  "reversed": false,
  "folder": null,
  "idealStartingState": { "velocity": 1.0, "rotation": 0.0 },
  "useDefaultConstraints": true
})";

const std::string path_2024 = R"({
  "version": 1.0,
  "waypoints": [
    {"anchor": {"x": 2.0, "y": 7.0}, "prevControl": null, "nextControl": {"x": 3.0, "y": 6.5}, "isLocked": false, "linkedName": null},
    {"anchor": {"x": 5.0, "y": 6.0}, "prevControl": {"x": 4.0, "y": 6.0}, "nextControl": null, "isLocked": false, "linkedName": null}
  ],
  "rotationTargets": [{"waypointRelativePos": 0.5, "rotationDegrees": 45.0, "rotateFast": false}],
  "constraintZones": [],
  "eventMarkers": [],
  "globalConstraints": {"maxVelocity": 3.0, "maxAcceleration": 3.0, "maxAngularVelocity": 540.0, "maxAngularAcceleration": 720.0},
  "goalEndState": {"velocity": 0, "rotation": 0, "rotateFast": false},
  "reversed": false,
  "folder": "Two piece",
  "previewStartingState": {"rotation": 0, "velocity": 0},
  "useDefaultConstraints": false
})";

const std::string path_2023 = R"({
  "waypoints": [
    {"anchorPoint": {"x": 1.0, "y": 3.0}, "prevControl": null, "nextControl": {"x": 2.0, "y": 3.0}, "holonomicAngle": 0, "isReversal": false, "velOverride": null, "isLocked": false, "isStopPoint": false, "stopEvent": {"names": [], "executionBehavior": "parallel", "waitBehavior": "none", "waitTime": 0}},
    {"anchorPoint": {"x": 3.0, "y": 5.0}, "prevControl": {"x": 3.0, "y": 4.0}, "nextControl": {"x": 3.0, "y": 4.0}, "holonomicAngle": 90.0, "isReversal": true, "velOverride": 1.5, "isLocked": false, "isStopPoint": true, "stopEvent": {"names": ["drop"], "executionBehavior": "parallel", "waitBehavior": "none", "waitTime": 0}},
    {"anchorPoint": {"x": 5.0, "y": 5.0}, "prevControl": {"x": 4.0, "y": 5.0}, "nextControl": null, "holonomicAngle": 0, "isReversal": false, "velOverride": null, "isLocked": false, "isStopPoint": false, "stopEvent": {"names": [], "executionBehavior": "parallel", "waitBehavior": "none", "waitTime": 0}}
  ],
  "maxVelocity": 4.0,
  "maxAcceleration": 3.0,
  "isReversed": null,
  "markers": [{"position": 0.7, "names": ["intake", "lower"]}]
})";

const std::string routine_2025 = R"({
  "version": "2025.0",
  "command": {
    "type": "sequential",
    "data": {
      "commands": [
        { "type": "path", "data": { "pathName": "Out" } },
        { "type": "race", "data": { "commands": [ { "type": "path", "data": { "pathName": "Back" } }, { "type": "wait", "data": { "waitTime": 3.0 } } ] } },
        { "type": "conditional", "data": { "if": "full" } }
      ]
    }
  },
  "resetOdom": true,
  "folder": null,
  "choreoAuto": false
})";

const std::string settings_2025 =
    R"({"robotWidth": 0.9, "holonomicMode": true, "robotMass": 74.088, "driveMotorType": "krakenX60", "flModuleX": 0.273, "robotFeatures": ["{\"name\":\"arm\"}"], "later": null})";

const std::string grid_text =
    R"({"field_size":{"x":16.54,"y":8.02},"nodeSizeMeters":0.3,"grid":[[true,true,false],[true,false,false]]})";

std::string with(std::string text, const std::string& what, const std::string& instead) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

std::string refusal_of(const std::string& text) {
  const auto file = parse_pathplanner_path(text, "a.path");
  return file ? "read" : to_string(static_cast<const Error&>(file.error()));
}

TEST(PathPlanner, WritingWhatWasReadIsTheSameBytes) {
  for (const std::string& text : {path_2025, path_2024, path_2023}) {
    const auto file = parse_pathplanner_path(text, "a.path");
    ASSERT_TRUE(file) << to_string(file.error());
    EXPECT_TRUE(file->diagnostics.empty());
    EXPECT_EQ(to_pathplanner(*file).value(), text);
  }
  const auto routine = parse_pathplanner_auto(routine_2025, "a.auto");
  ASSERT_TRUE(routine) << to_string(routine.error());
  EXPECT_EQ(to_pathplanner(*routine).value(), routine_2025);
  const auto settings = parse_pathplanner_settings_file(settings_2025, "settings.json");
  ASSERT_TRUE(settings) << to_string(settings.error());
  EXPECT_EQ(to_pathplanner(*settings).value(), settings_2025);
  const auto grid = parse_pathplanner_grid(grid_text, "navgrid.json");
  ASSERT_TRUE(grid) << to_string(grid.error());
  EXPECT_EQ(to_pathplanner(*grid).value(), grid_text);
}

TEST(PathPlanner, WhatIsNotThereIsNotWritten) {
  // No folder, no data of a command, null for a name, commands of no kind that is known.
  for (const std::string& text :
       {std::string(R"({"version": 1.0, "command": {"type": "sequential"}})"),
        std::string(
            R"({"version": "2025.0", "command": {"type": "named", "data": {"name": null}}})"),
        std::string(R"({"version": "2025.0", "command": {"type": "conditional"}, "later": {}})")}) {
    const auto routine = parse_pathplanner_auto(text, "a.auto");
    ASSERT_TRUE(routine) << to_string(routine.error());
    EXPECT_EQ(to_pathplanner(*routine).value(), text);
  }
  std::string text = path_2025;
  text = with(text, ",\n  \"folder\": null", "");
  text = with(text, ",\n      \"linkedName\": null", "");
  const auto path = parse_pathplanner_path(text, "a.path");
  ASSERT_TRUE(path) << to_string(path.error());
  EXPECT_EQ(to_pathplanner(*path).value(), text);
}

TEST(PathPlanner, SaysWhatTheFileSays) {
  const auto path = parse_pathplanner_path(path_2025, "a.path").value();
  EXPECT_EQ(path.version, "2025.0");
  ASSERT_EQ(path.waypoints.size(), 2U);
  EXPECT_FALSE(path.waypoints[0].previous_control);
  EXPECT_EQ(path.waypoints[0].next_control->x, 2.5);
  EXPECT_EQ(path.waypoints[1].linked_name, "goal");
  EXPECT_EQ(path.rotation_targets[0].degrees, 90.0);
  EXPECT_EQ(path.zones[0].constraints.max_angular_acceleration, 180.0);
  EXPECT_EQ(path.pointing[0].place.y, 5.5);
  EXPECT_EQ(path.markers[0].command->commands[1].wait.value, 0.5);
  EXPECT_EQ(path.goal_end_state->rotation, -45.0);
  EXPECT_EQ(path.ideal_starting_state->velocity, 1.0);
  EXPECT_EQ(path.use_default_constraints, true);

  const auto first = parse_pathplanner_path(path_2023, "a.path").value();
  EXPECT_TRUE(first.is_2023);
  EXPECT_EQ(first.max_velocity, 4.0);
  EXPECT_EQ(first.waypoints[1].velocity_override, 1.5);
  EXPECT_EQ(first.waypoints[1].is_reversal, true);
  EXPECT_EQ(first.markers[0].names[1], "lower");

  const auto routine = parse_pathplanner_auto(routine_2025, "a.auto").value();
  EXPECT_EQ(routine.paths(), (std::vector<std::string>{"Out", "Back"}));
  EXPECT_EQ(routine.command.commands[2].type, "conditional");

  const auto grid = parse_pathplanner_grid(grid_text, "navgrid.json").value();
  EXPECT_EQ(grid.rows[1], (std::vector<bool>{true, false, false}));
}

TEST(PathPlanner, ChangesWhatIsChangedAndNoMore) {
  auto path = parse_pathplanner_path(path_2025, "a.path").value();
  path.waypoints[0].anchor.x = 1.75;
  path.waypoints[1].linked_name.reset();
  path.reversed = true;
  std::string wanted = with(path_2025, "\"x\": 1.5", "\"x\": 1.75");
  wanted = with(wanted, "\"linkedName\": \"goal\"", "\"linkedName\": null");
  wanted = with(wanted, "\"reversed\": false", "\"reversed\": true");
  EXPECT_EQ(to_pathplanner(path).value(), wanted);

  auto grid = parse_pathplanner_grid(grid_text, "navgrid.json").value();
  grid.rows[0][2] = true;
  grid.rows.push_back({false, false, true});
  const auto again = parse_pathplanner_grid(to_pathplanner(grid).value(), "navgrid.json");
  ASSERT_TRUE(again);
  EXPECT_EQ(again->rows, grid.rows);
}

TEST(PathPlanner, WritesAFileOfItsOwn) {
  PathPlannerPath path;
  path.version = "2025.0";
  path.waypoints.resize(2);
  path.waypoints[0].next_control = PlannerPoint{1.0, 0.0};
  path.waypoints[1].anchor = {3.0, 1.0};
  path.waypoints[1].previous_control = PlannerPoint{2.0, 1.0};
  path.goal_end_state = PathPlannerState{0.0, 90.0};
  path.markers.push_back({.name = "m", .position = 0.5});
  const std::string text = to_pathplanner(path).value();
  const auto again = parse_pathplanner_path(text, "a.path");
  ASSERT_TRUE(again) << to_string(again.error()) << text;
  EXPECT_EQ(again->waypoints[1].previous_control->x, 2.0);
  EXPECT_EQ(to_pathplanner(*again).value(), text);
  EXPECT_TRUE(
      text.starts_with("{\n  \"version\": \"2025.0\",\n  \"waypoints\": [\n    {\n      "
                       "\"anchor\": {\n        \"x\": 0.0,\n"))
      << text;
}

TEST(PathPlanner, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(refusal_of(with(path_2025, "\"x\": 4,", "")),
            "a.path:12:17: waypoints[1].anchor.x is missing");
  EXPECT_EQ(refusal_of(with(path_2025, "\"reversed\": false", "\"reversed\": 0")),
            "a.path:29:15: reversed is 0; it must be true or false");
  EXPECT_EQ(refusal_of(with(path_2025, "{ \"x\": 3.0, \"y\": 3.0 }", "[3, 3]")),
            "a.path:13:22: waypoints[1].prevControl is a list; it must be an object");
  EXPECT_EQ(refusal_of(routine_2025),
            "a.path: the JSON is an object of version, command, resetOdom, folder; it must be a "
            "path of PathPlanner: version, waypoints, …");
  const auto newer = parse_pathplanner_path(with(path_2025, "\"2025.0\"", "\"2031.0\""), "a.path");
  ASSERT_TRUE(newer);
  ASSERT_EQ(newer->diagnostics.size(), 1U);
  EXPECT_EQ(newer->diagnostics[0].code, "unknown_version");
  const auto ragged =
      parse_pathplanner_grid(with(grid_text, "[true,false,false]", "[true]"), "navgrid.json");
  ASSERT_FALSE(ragged);
  EXPECT_EQ(to_string(static_cast<const Error&>(ragged.error())),
            "navgrid.json:1:83: grid[1] is of 1 cells; it must be 3, as the first row has");
}

TEST(PathPlanner, RealFiles) {
  const std::string folder = FLYBALL_TEST_DATA "/pathplanner";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP();
  }
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string path = entry.path().string();
    const std::string text = read_file(path).value();
    SCOPED_TRACE(path);
    if (path.ends_with(".path")) {
      const auto file = read_pathplanner_path(path);
      ASSERT_TRUE(file) << to_string(file.error());
      EXPECT_EQ(to_pathplanner(*file).value(), text);
    } else if (path.ends_with(".auto")) {
      const auto file = read_pathplanner_auto(path);
      ASSERT_TRUE(file) << to_string(file.error());
      EXPECT_EQ(to_pathplanner(*file).value(), text);
      EXPECT_EQ(file->paths(), (std::vector<std::string>{"Pickup", "Score"}));
    } else {
      const auto file = parse_pathplanner_settings_file(text, path);
      ASSERT_TRUE(file) << to_string(file.error());
      EXPECT_EQ(to_pathplanner(*file).value(), text);
      EXPECT_EQ(file->mass, 74.088);
    }
    ++files;
  }
  EXPECT_GE(files, 4);
}

}  // namespace
}  // namespace flyball::pathplanner_test
