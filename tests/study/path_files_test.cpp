// What a file has beside its samples stays when it is turned, mirrored, driven back, joined and
// translated, or is told to be left out.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/io/file.hpp>
#include <flyball/study/path.hpp>

namespace flyball::study::path_files_test {
namespace {

constexpr double pi = std::numbers::pi;

class PathFiles : public ::testing::Test {
 protected:
  PathFiles()
      : folder_(std::filesystem::temp_directory_path() /
                ("flyball_path_files_test_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~PathFiles() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& contents) const {
    std::ofstream(folder_ / name) << contents;
    return (folder_ / name).string();
  }

 private:
  std::filesystem::path folder_;
};

PathResult plan(const PathJob& job) {
  auto result = plan_path(job);
  EXPECT_TRUE(result) << to_string(static_cast<const Error&>(result.error()));
  return result ? *std::move(result) : PathResult{};
}

bool noticed(const PathResult& result, std::string_view code) {
  return std::any_of(result.diagnostics.begin(), result.diagnostics.end(),
                     [&](const Diagnostic& diagnostic) { return diagnostic.code == code; });
}

/// 4 m straight on in 3 s, an event at 2.5 m: after a second up to 2 m/s and 0.75 s at it.
std::string line_with_marker() {
  PathPlannerPath path;
  path.version = "2025.0";
  path.waypoints = {{.anchor = {1, 1}, .next_control = PlannerPoint{2, 1}},
                    {.anchor = {5, 1}, .previous_control = PlannerPoint{4, 1}}};
  path.constraints.max_velocity = 2.0;
  path.constraints.max_acceleration = 2.0;
  path.goal_end_state = PathPlannerState{};
  path.ideal_starting_state = PathPlannerState{};
  // x(s) = 1 + 3 s + 3 s² - 2 s³ is 3.5 there.
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 60; ++i) {
    const double s = 0.5 * (low + high);
    (1.0 + s * (3.0 + s * (3.0 - 2.0 * s)) < 3.5 ? low : high) = s;
  }
  PathPlannerMarker marker{.name = "shoot", .position = low, .end_position = 1.0};
  marker.command = AutoCommand{.type = "sequential"};
  marker.command->commands = {{.type = "named", .name = "shoot now"},
                              {.type = "wait", .wait = {0.25}}};
  path.markers = {marker};
  return to_pathplanner(path).value();
}

/// Two waypoints a second and a half apart, an event 0.4 s after the first, a limit between both.
std::string choreo_file() {
  return R"({"name":"a", "version":3, "snapshot":null, "params":{"waypoints":[
 {"x":1.0, "y":2.0, "heading":4.0, "intervals":3, "split":false, "fixTranslation":true, "fixHeading":true, "overrideIntervals":true},
 {"x":2.0, "y":2.5, "heading":4.3, "intervals":5, "split":false, "fixTranslation":true, "fixHeading":true, "overrideIntervals":false},
 {"x":3.0, "y":2.0, "heading":4.5, "intervals":7, "split":false, "fixTranslation":true, "fixHeading":true, "overrideIntervals":false}],
 "constraints":[{"from":"first", "to":1, "data":{"type":"MaxVelocity", "props":{"max":2.0}}, "enabled":true},
                {"from":"last", "to":null, "data":{"type":"StopPoint", "props":{}}, "enabled":true}],
 "targetDt":0.05},
 "trajectory":{"sampleType":"Swerve", "waypoints":[0.0,1.0,1.5], "samples":[
  {"t":0.0, "x":1.0, "y":2.0, "heading":4.0, "vx":0.0, "vy":0.0, "omega":0.0, "ax":1.0, "ay":0.5, "alpha":0.3, "fx":[1,2,3,4], "fy":[5,6,7,8]},
  {"t":1.0, "x":2.0, "y":2.5, "heading":4.3, "vx":1.0, "vy":0.2, "omega":0.3, "ax":1.0, "ay":0.5, "alpha":0.3, "fx":[1,2,3,4], "fy":[5,6,7,8]},
  {"t":1.5, "x":3.0, "y":2.0, "heading":4.5, "vx":0.0, "vy":0.0, "omega":0.0, "ax":-1.0, "ay":-0.5, "alpha":0.3, "fx":[1,2,3,4], "fy":[5,6,7,8]}],
  "splits":[0, 1]},
 "events":[{"name":"go", "from":{"target":0, "targetTimestamp":0.0, "offset":{"exp":"0.4 s", "val":0.4}}, "event":null}],
 "mine":7})";
}

TEST_F(PathFiles, EventsHaveTheTimesOfTheirPlaces) {
  const std::string path = write("a.path", line_with_marker());
  const PathResult result = plan({.files = {path}});
  ASSERT_EQ(result.events.size(), 1U);
  EXPECT_NEAR(result.events[0].time, 1.75, 2e-3);
  EXPECT_NEAR(result.events[0].end.value(), 3.0, 2e-3);
  const PathResult back = plan({.files = {path}, .reverse = true});
  EXPECT_NEAR(back.events.at(0).end.value(), result.trajectory.duration() - result.events[0].time,
              1e-12);
  EXPECT_EQ(back.events[0].time, 0.0);
  // As a Choreo trajectory, mirrored: from the waypoint before it, its command as Choreo has it.
  const PathResult choreo = plan({.files = {path}, .mirror = true, .to = "choreo"});
  EXPECT_TRUE(noticed(choreo, "events_shortened"));
  const ChoreoTrajectory file = parse_choreo_trajectory(choreo.written, "a").value();
  ASSERT_EQ(file.events.size(), 1U);
  EXPECT_NEAR(file.events[0].time().value(), result.events[0].time, 1e-12);
  ASSERT_EQ(file.events[0].command->commands.size(), 2U);
  EXPECT_EQ(file.events[0].command->commands[0].name, "shoot now");
  EXPECT_EQ(file.events[0].command->commands[1].wait.expression, "0.25 s");
  // Read again it is where it was; joined it is later by what is before it.
  const std::string traj = write("a.traj", choreo.written);
  EXPECT_NEAR(plan({.files = {traj}}).events.at(0).time, result.events[0].time, 1e-12);
  for (const char* to : {"wpilib", "csv", "c++"}) {
    EXPECT_TRUE(noticed(plan({.files = {path}, .to = to}), "events_left_out")) << to;
  }
  // With other times it stays at its place.
  const PathResult slow = plan({.files = {traj},
                                .velocity = Velocity(1.0),
                                .acceleration = Acceleration(1.0),
                                .angular_velocity = AngularVelocity(5.0),
                                .angular_acceleration = AngularAcceleration(5.0)});
  const double x = slow.trajectory.at(slow.events.at(0).time).pose.x();
  EXPECT_NEAR(x, 17.548 - 3.5, 5e-3);
}

TEST_F(PathFiles, ARoutinesCommandsAreEvents) {
  write("a.path", line_with_marker());
  const std::string routine = write("r.auto", R"({"version": "2025.0", "command": {
      "type": "sequential", "data": {"commands": [
        {"type": "named", "data": {"name": "first"}},
        {"type": "parallel", "data": {"commands": [
          {"type": "path", "data": {"pathName": "a"}},
          {"type": "sequential", "data": {"commands": [
            {"type": "wait", "data": {"waitTime": 0.5}},
            {"type": "named", "data": {"name": "second"}}]}}]}},
        {"type": "named", "data": {"name": "third"}}]}}, "resetOdom": true, "folder": null,
      "choreoAuto": false})");
  const PathResult result = plan({.files = {routine}});
  std::vector<std::pair<std::string, double>> events;
  for (const PathEvent& event : result.events) {
    events.emplace_back(event.name, event.time);
  }
  const double end = result.trajectory.duration();
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[0], (std::pair<std::string, double>("first", 0.0)));
  EXPECT_EQ(events[1], (std::pair<std::string, double>("sequential", 0.0)));
  EXPECT_EQ(events[2].first, "shoot");
  EXPECT_EQ(events[3], (std::pair<std::string, double>("third", end)));
  // Itself, byte by byte; turned it would name other files.
  EXPECT_EQ(plan({.files = {routine}, .to = "pathplanner"}).written, read_file(routine).value());
  EXPECT_FALSE(plan_path({.files = {routine}, .flip = true, .to = "pathplanner"}));
}

TEST_F(PathFiles, AChoreoFileDrivenBackKeepsWhatItSays) {
  const std::string file = write("a.traj", choreo_file());
  const PathResult back = plan({.files = {file}, .reverse = true, .to = "choreo"});
  const ChoreoTrajectory read = parse_choreo_trajectory(back.written, "a").value();
  EXPECT_NE(back.written.find("\"mine\":7"), std::string::npos);
  EXPECT_NEAR(read.events.at(0).time().value(), 1.1, 1e-12);
  EXPECT_EQ(read.events[0].target, 2);
  EXPECT_EQ(read.params.waypoints[0].x.value, 3.0);
  EXPECT_EQ(read.params.waypoints[0].intervals, 5);
  EXPECT_EQ(read.params.waypoints[1].intervals, 3);
  EXPECT_TRUE(read.params.waypoints[1].override_intervals);
  EXPECT_EQ(read.params.constraints[0].from, "1");
  EXPECT_EQ(read.params.constraints[0].to, "last");
  EXPECT_EQ(read.params.constraints[1].from, "first");
  EXPECT_EQ(read.trajectory.waypoints, (std::vector<double>{0.0, 0.5, 1.5}));
  EXPECT_EQ(read.trajectory.splits, (std::vector<int>{0, 1}));
  EXPECT_EQ(read.trajectory.samples[1].vx, -1.0);
  EXPECT_EQ(read.trajectory.samples[1].ax, 1.0);
  // Twice each is none.
  for (bool PathJob::* change :
       {&PathJob::reverse, &PathJob::flip, &PathJob::mirror, &PathJob::mirror_sides}) {
    PathJob job{.files = {file}, .to = "choreo"};
    job.*change = true;
    const std::string once = write("once.traj", plan(job).written);
    job.files = {once};
    const ChoreoTrajectory twice = parse_choreo_trajectory(plan(job).written, "a").value();
    const ChoreoTrajectory first = parse_choreo_trajectory(choreo_file(), "a").value();
    for (std::size_t i = 0; i < 3; ++i) {
      const ChoreoSample& a = first.trajectory.samples[i];
      const ChoreoSample& b = twice.trajectory.samples[i];
      EXPECT_NEAR(a.time, b.time, 1e-12);
      EXPECT_NEAR(a.x, b.x, 1e-12);
      EXPECT_NEAR(a.heading, b.heading, 1e-12);  // not a turn more
      EXPECT_NEAR(a.vy.value(), b.vy.value(), 1e-12);
      EXPECT_EQ(a.fx, b.fx);
      EXPECT_NEAR(first.params.waypoints[i].heading.value, twice.params.waypoints[i].heading.value,
                  1e-12);
      EXPECT_EQ(first.params.waypoints[i].intervals, twice.params.waypoints[i].intervals);
    }
    EXPECT_NEAR(twice.events.at(0).time().value(), 0.4, 1e-12);
    EXPECT_TRUE(twice.params.constraints[0].from == "0" ||
                twice.params.constraints[0].from == "first");
  }
  EXPECT_TRUE(noticed(plan({.files = {file}, .to = "wpilib"}), "constraints_left_out"));
}

TEST_F(PathFiles, JoinedTrajectoriesKeepTheirWaypointsAndEvents) {
  const std::string first = write("a.traj", choreo_file());
  const PathResult back = plan({.files = {first}, .reverse = true, .to = "choreo"});
  const std::string second = write("b.traj", back.written);
  const PathResult both = plan({.files = {first, second}, .to = "choreo"});
  const ChoreoTrajectory read = parse_choreo_trajectory(both.written, "a").value();
  ASSERT_EQ(read.params.waypoints.size(), 5U);
  EXPECT_EQ(read.trajectory.waypoints, (std::vector<double>{0.0, 1.0, 1.5, 2.0, 3.0}));
  ASSERT_EQ(read.events.size(), 2U);
  EXPECT_NEAR(read.events[0].time().value(), 0.4, 1e-12);
  EXPECT_NEAR(read.events[1].time().value(), 1.5 + 1.1, 1e-12);
  ASSERT_EQ(read.params.constraints.size(), 4U);
  EXPECT_EQ(read.params.constraints[0].to, "1");
  EXPECT_EQ(read.params.constraints[2].from, "3");
  EXPECT_EQ(read.params.constraints[2].to, "4");
}

TEST_F(PathFiles, WpilibsFieldsAreTurnedWithIt) {
  const std::string text =
      R"([{"time":0.0, "pose":{"rotation":{"radians":0.5}, "translation":{"x":1.0, "y":2.0}}, "velocity":0.0, "acceleration":1.0, "curvature":0.2, "holonomicRotation":40.0, "angularVelocity":0.3, "holonomicAngularVelocity":5.0, "mine":[1]},)"
      R"({"time":1.0, "pose":{"rotation":{"radians":0.6}, "translation":{"x":1.4, "y":2.3}}, "velocity":1.0, "acceleration":1.0, "curvature":0.2, "holonomicRotation":45.0, "angularVelocity":0.3, "holonomicAngularVelocity":5.0, "mine":[2]}])";
  const std::string file = write("a.json", text);
  const PathResult mirrored = plan({.files = {file}, .mirror_sides = true, .to = "wpilib"});
  const WpilibTrajectory read = parse_wpilib_trajectory(mirrored.written, "a").value();
  const WpilibState& last = read.states[1];
  EXPECT_NEAR(last.y, 8.052 - 2.3, 1e-12);
  EXPECT_NEAR(last.angle, -0.6, 1e-12);
  EXPECT_NEAR(last.holonomic_rotation.value(), -45.0, 1e-12);
  EXPECT_NEAR(last.angular_velocity.value(), -0.3, 1e-12);
  EXPECT_NEAR(last.holonomic_angular_velocity.value(), -5.0, 1e-12);
  EXPECT_NEAR(last.curvature, -0.2, 1e-12);
  EXPECT_NE(mirrored.written.find("\"mine\":[2]"), std::string::npos);
  const PathResult back = plan({.files = {file}, .reverse = true, .to = "wpilib"});
  const WpilibTrajectory reversed = parse_wpilib_trajectory(back.written, "a").value();
  EXPECT_EQ(reversed.states[0].velocity, -1.0);
  EXPECT_EQ(reversed.states[0].acceleration, 1.0);
  EXPECT_EQ(reversed.states[0].curvature, 0.2);
  EXPECT_EQ(reversed.states[0].holonomic_rotation.value(), 45.0);
  EXPECT_EQ(reversed.states[0].angular_velocity.value(), -0.3);
  const std::string again = write("b.json", back.written);
  const WpilibTrajectory twice =
      parse_wpilib_trajectory(plan({.files = {again}, .reverse = true, .to = "wpilib"}).written,
                              "a")
          .value();
  EXPECT_EQ(twice.states[1].velocity, 1.0);
  EXPECT_NE(back.written.find("\"mine\":[1]"), std::string::npos);
}

// {"samples"} of 2027: speeds in the robot's frame, turned with the accelerations.
TEST_F(PathFiles, TheNewerLayoutStaysWhatItIs) {
  std::string rows;
  for (int i = 0; i <= 10; ++i) {  // sideways to the left, looking along y
    const double t = 0.1 * i;
    rows += (i > 0 ? "," : "") + std::string(R"({"time":)") + std::to_string(t) +
            R"(,"pose":{"translation":{"x":)" + std::to_string(5.0 - 0.5 * t * t) +
            R"(,"y":2},"rotation":{"radians":)" + std::to_string(0.5 * pi) +
            R"(}},"velocity":{"vx":0,"vy":)" + std::to_string(t) +
            R"(,"omega":0},"acceleration":{"ax":0,"ay":1.0,"alpha":0}})";
  }
  const std::string file = write("a.json", "{\"samples\":[" + rows + "],\"mine\":true}");
  const PathResult read = plan({.files = {file}});
  EXPECT_NEAR(read.trajectory.samples[5].acceleration(0), -1.0, 1e-6);
  const PathResult mirrored = plan({.files = {file}, .mirror = true, .to = "wpilib"});
  EXPECT_NE(mirrored.written.find("\"mine\":true"), std::string::npos);
  const WpilibTrajectory other = parse_wpilib_trajectory(mirrored.written, "a").value();
  ASSERT_TRUE(other.is_object);
  EXPECT_NEAR(other.states[10].speeds.vy, -1.0, 1e-9);
  EXPECT_NEAR(other.states[10].accelerations->ay, -1.0, 1e-9);
  EXPECT_NEAR(other.states[10].angle, 0.5 * pi, 1e-6);
}

TEST_F(PathFiles, CurvaturesGoOnThroughStops) {
  // A quarter of a circle of 2 m: 0.5 1/m from its start, where it stands, to its end.
  PathPlannerPath path;
  path.version = "2025.0";
  const double k = 2.0 * 4.0 / 3.0 * std::tan(pi / 8.0);
  path.waypoints = {{.anchor = {2, 2}, .next_control = PlannerPoint{2 + k, 2}},
                    {.anchor = {4, 4}, .previous_control = PlannerPoint{4, 4 - k}}};
  path.goal_end_state = PathPlannerState{};
  path.ideal_starting_state = PathPlannerState{};
  const std::string file = write("a.path", to_pathplanner(path).value());
  const WpilibTrajectory states =
      parse_wpilib_trajectory(plan({.files = {file}, .to = "wpilib"}).written, "a").value();
  for (const WpilibState& state : states.states) {
    EXPECT_NEAR(state.curvature, 0.5, 0.02) << state.time;
  }
  const std::string table = plan({.files = {file}, .to = "csv"}).written;
  std::size_t rows = 0;
  for (std::size_t at = table.find('\n') + 1; at < table.size(); ++rows) {
    const std::size_t end = table.find('\n', at);
    const std::string row = table.substr(at, end - at);
    EXPECT_NEAR(std::stod(row.substr(row.rfind(',') + 1)), 0.5, 0.02) << row;
    at = end + 1;
  }
  EXPECT_GT(rows, 100U);
}

TEST_F(PathFiles, RoutinesAndProjectsAreWritten) {
  const std::string a = write("a.path", line_with_marker());
  PathPlannerPath path = parse_pathplanner_path(line_with_marker(), "a").value();
  for (PathPlannerWaypoint& waypoint : path.waypoints) {
    waypoint.anchor.x += 4.0;
    for (std::optional<PlannerPoint>* point :
         {&waypoint.previous_control, &waypoint.next_control}) {
      if (*point) {
        (*point)->x += 4.0;
      }
    }
  }
  const std::string b = write("b.path", to_pathplanner(path).value());
  const PathResult both = plan({.files = {a, b}, .to = "pathplanner"});
  const PathPlannerAuto routine = parse_pathplanner_auto(both.written, "r").value();
  EXPECT_EQ(routine.paths(), (std::vector<std::string>{"a", "b"}));
  EXPECT_NEAR(plan({.files = {write("r.auto", both.written)}}).trajectory.duration(),
              both.trajectory.duration(), 1e-12);
  // A link is no longer one where the path is turned.
  path.waypoints[0].linked_name = "station";
  const std::string linked = write("c.path", to_pathplanner(path).value());
  EXPECT_TRUE(
      noticed(plan({.files = {linked}, .flip = true, .to = "pathplanner"}), "links_left_out"));
  EXPECT_FALSE(
      noticed(plan({.files = {linked}, .reverse = true, .to = "pathplanner"}), "links_left_out"));

  const std::string robot = write("robot.toml", R"([drive]
type = "swerve"
motor = "NEO"
gearing = 6.75
wheel_radius = "2 in"
mass = "50 kg"
moment_of_inertia = "6 kg m^2"
trackwidth = "0.6 m"
wheelbase = "0.5 m"
)");
  const PathResult project = plan({.project = robot, .to = "choreo-project"});
  const ChoreoProject read = parse_choreo_project(project.written, "a").value();
  EXPECT_EQ(read.type, "Swerve");
  EXPECT_NEAR(read.config->front_left.x.value, 0.25, 1e-12);
  EXPECT_NEAR(read.config->front_left.y.value, 0.3, 1e-12);
  EXPECT_NEAR(read.config->back_left.x.value, -0.25, 1e-12);
  EXPECT_EQ(read.config->mass.value, 50.0);
  EXPECT_EQ(to_choreo(read).value(), project.written);
  // With it a trajectory beside it is found by its name.
  const std::string chor = write("robot.chor", project.written);
  write("a.traj", choreo_file());
  EXPECT_NEAR(plan({.files = {chor}, .name = "a"}).trajectory.duration(), 1.5, 1e-12);
}

TEST_F(PathFiles, EachProjectOfChoreoIsItself) {
  const std::string folder = std::string(FLYBALL_TEST_DATA) + "/choreo/";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP();
  }
  for (const char* name :
       {"choreo2024_example.chor", "project_2_differential.chor", "project_2_swerve.chor"}) {
    const PathResult result = plan({.files = {folder + name}, .to = "choreo-project"});
    EXPECT_EQ(result.written, read_file(folder + name).value()) << name;
  }
  const PathResult turned =
      plan({.files = {folder + "choreo2024_example.chor"}, .flip = true, .to = "choreo-project"});
  const std::string file = write("turned.chor", turned.written);
  const ChoreoProject twice =
      parse_choreo_project(plan({.files = {file}, .flip = true, .to = "choreo-project"}).written,
                           "a")
          .value();
  const ChoreoProject first = read_choreo_project(folder + "choreo2024_example.chor").value();
  for (std::size_t i = 0; i < first.paths.size(); ++i) {
    for (std::size_t k = 0; k < first.paths[i].trajectory.size(); ++k) {
      ASSERT_NEAR(first.paths[i].trajectory[k].heading, twice.paths[i].trajectory[k].heading,
                  1e-12);
      ASSERT_NEAR(first.paths[i].trajectory[k].x, twice.paths[i].trajectory[k].x, 1e-12);
    }
  }
}

}  // namespace
}  // namespace flyball::study::path_files_test
