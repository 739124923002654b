#include <flyball/io/motion/choreo.hpp>

#include <filesystem>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/io/file.hpp>

namespace flyball::choreo_test {
namespace {

/// Every version's layout in little, with members that nobody knows and odd blanks and numbers.
const std::string version_3 = R"({
 "name":"lob", "note": {"by" : "me" },
 "version":3,
 "snapshot":null,
 "params":{
  "waypoints":[
    {"x":{"exp":"1 m", "val":1.0}, "y":{"exp":"2 ft","val":0.6096}, "heading":{"exp":"0 rad", "val":0.0}, "intervals":14, "split":false, "fixTranslation":true, "fixHeading":true, "overrideIntervals":false, "colour":"red"},
    {"x":{"exp":"3 m", "val":3.00}, "y":{"exp":"1 m", "val":1}, "heading":{"exp":"0 rad", "val":0.0}, "intervals":40, "split":true, "fixTranslation":true, "fixHeading":false, "overrideIntervals":false}],
  "constraints":[
    {"from":"first", "to":null, "data":{"type":"StopPoint", "props":{}}, "enabled":true},
    {"from":0, "to":1, "data":{"type":"PointAt", "props":{"x":{"exp":"4 m", "val":4.0}, "y":{"exp":"5 m", "val":5.0}, "tolerance":{"exp":"1 deg", "val":0.0174}, "flip":false}}, "enabled":false}],
  "targetDt":{"exp":"0.05 s", "val":5e-2}
 },
 "trajectory":{
  "config":{"frontLeft":{"x":0.2794,"y":0.2794}, "backLeft":{"x":-0.2794,"y":0.2794}, "mass":68.0, "inertia":6.0, "gearing":6.5, "radius":0.0508, "vmax":628.0, "tmax":1.2, "cof":1.5, "bumper":{"front":0.4,"side":0.4,"back":0.4}, "differentialTrackWidth":0.5588},
  "sampleType":"Swerve",
  "waypoints":[0.0,1.5],
  "samples":[
    {"t":0.0, "x":1.0, "y":0.6096, "heading":0.0, "vx":0.0, "vy":-0.0, "omega":0.0, "ax":2.0, "ay":0.0, "alpha":0.0, "fx":[1.0,2.0,3.0,4.0], "fy":[0.0,0.0,0.0,1e-3]},
    {"t":1.5, "x":3.0, "y":1.0, "heading":0.0, "vx":1.0, "vy":0.0, "omega":0.0, "ax":2.0, "ay":0.0, "alpha":0.0, "fx":[1.0,2.0,3.0,4.0], "fy":[0.0,0.0,0.0,0.0], "extra":[1, 2]}],
  "splits":[0]
 },
 "events":[
   {"name":"shoot", "from":{"target":1, "targetTimestamp":1.5, "offset":{"exp":"-0.5 s", "val":-0.5}}, "event":{"type":"sequential", "data":{"commands":[{"type":"named","data":{"name":"spin"}},{"type":"wait","data":{"waitTime":{"exp":"1 s","val":1.0}}},{"type":"ours","data":{"a":[]}}]}}},
   {"name":"idle", "from":{"target":null, "targetTimestamp":null, "offset":{"exp":"0 s", "val":0.0}}, "event":null}]
}
)";

const std::string beta = R"({"name":"d","version":"v2025.0.0","snapshot":null,
 "params":{"waypoints":[],"constraints":[],"targetDt":{"exp":"0.05 s","val":0.05}},
 "trajectory":{"waypoints":[0.0,1.0],"samples":[
  {"t":0.0,"x":1.0,"y":1.0,"heading":0.0,"vl":0.0,"vr":0.0,"al":4.5,"ar":4.5,"fl":153.4,"fr":153.4},
  {"t":1.0,"x":2.0,"y":1.0,"heading":0.0,"vl":2.0,"vr":2.0,"al":4.5,"ar":4.5,"fl":153.4,"fr":153.4}],
 "splits":[0]},"events":[]})";

const std::string year_2024 = R"({
    "samples": [
        { "timestamp": 0, "x": 2.5, "y": 4.25, "heading": 0, "velocityX": -1.5e-32, "velocityY": 0, "angularVelocity": -0.5 },
        { "timestamp": 0.5, "x": 2.75, "y": 4.5, "heading": -0.015, "velocityX": 0.5, "velocityY": 0.25, "angularVelocity": -0.25 }
    ],
    "eventMarkers": [{"timestamp": 0.25, "command": {"type": "named", "data": {"name": "intake"}}}]
})";

const std::string project_2 = R"({
 "name":"swerve", "version":2, "type":"Swerve",
 "variables":{"expressions":{}, "poses":{}},
 "config":{"frontLeft":{"x":{"exp":"11 in","val":0.2794},"y":{"exp":"11 in","val":0.2794}},
  "backLeft":{"x":{"exp":"-11 in","val":-0.2794},"y":{"exp":"11 in","val":0.2794}},
  "mass":{"exp":"150 lbs","val":68.0388555}, "inertia":{"exp":"6 kg m ^ 2","val":6.0},
  "gearing":{"exp":"6.5","val":6.5}, "radius":{"exp":"2 in","val":0.0508},
  "vmax":{"exp":"6000 RPM","val":628.3185307179587}, "tmax":{"exp":"1.2 N * m","val":1.2},
  "bumper":{"front":{"exp":"16 in","val":0.4064},"side":{"exp":"16 in","val":0.4064},"back":{"exp":"16 in","val":0.4064}}},
 "generationFeatures":[], "codegen":{"root":"."}
})";

std::string with(std::string text, const std::string& what, const std::string& instead) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

/// What a hostile text is answered with.
std::string refusal_of(const std::string& text) {
  const auto file = parse_choreo_trajectory(text, "a.traj");
  return file ? "read" : to_string(static_cast<const Error&>(file.error()));
}

TEST(Choreo, WritingWhatWasReadIsTheSameBytes) {
  for (const std::string& text : {version_3, beta, year_2024}) {
    const auto file = parse_choreo_trajectory(text, "a.traj");
    ASSERT_TRUE(file) << to_string(file.error());
    EXPECT_EQ(to_choreo(*file).value(), text);
  }
  const auto project = parse_choreo_project(project_2, "a.chor");
  ASSERT_TRUE(project) << to_string(project.error());
  EXPECT_EQ(to_choreo(*project).value(), project_2);
}

TEST(Choreo, SaysWhatTheFileSays) {
  const auto file = parse_choreo_trajectory(version_3, "a.traj").value();
  EXPECT_EQ(file.name, "lob");
  EXPECT_EQ(file.version, "3");
  EXPECT_FALSE(file.snapshot);
  EXPECT_FALSE(file.differential());
  EXPECT_TRUE(file.diagnostics.empty());
  ASSERT_EQ(file.params.waypoints.size(), 2U);
  EXPECT_EQ(file.params.waypoints[0].y.value, 0.6096);
  EXPECT_EQ(file.params.waypoints[0].y.expression, "2 ft");
  EXPECT_TRUE(file.params.waypoints[1].split);
  EXPECT_EQ(file.params.target_dt.value, 0.05);
  ASSERT_EQ(file.params.constraints.size(), 2U);
  EXPECT_EQ(file.params.constraints[1].from, "0");
  EXPECT_EQ(file.params.constraints[1].to, "1");
  EXPECT_EQ(file.params.constraints[1].prop("tolerance"), 0.0174);
  EXPECT_FALSE(file.params.constraints[0].to);
  ASSERT_TRUE(file.trajectory.config);
  EXPECT_NEAR(file.trajectory.config->wheel_speed(), 628.0 * 0.0508 / 6.5, 1e-15);
  ASSERT_EQ(file.trajectory.samples.size(), 2U);
  EXPECT_EQ(file.trajectory.samples[1].vx, 1.0);
  EXPECT_EQ((*file.trajectory.samples[0].fy)[3], 1e-3);
  EXPECT_EQ(file.events[0].time(), 1.0);
  ASSERT_TRUE(file.events[0].command);
  ASSERT_EQ(file.events[0].command->commands.size(), 3U);
  EXPECT_EQ(file.events[0].command->commands[0].name, "spin");
  EXPECT_EQ(file.events[0].command->commands[1].wait.value, 1.0);
  EXPECT_FALSE(file.events[1].time());
  EXPECT_EQ(file.trajectory.samples[1].origin.place().line, 20U);

  const auto old = parse_choreo_trajectory(beta, "a.traj").value();
  EXPECT_TRUE(old.differential());
  EXPECT_FALSE(old.trajectory.samples[0].omega);
  EXPECT_TRUE(old.diagnostics.empty());

  const auto first = parse_choreo_trajectory(year_2024, "a.traj").value();
  EXPECT_TRUE(first.is_2024);
  EXPECT_EQ(first.trajectory.samples[1].omega, -0.25);
  EXPECT_EQ(first.events[0].time(), 0.25);

  const auto project = parse_choreo_project(project_2, "a.chor").value();
  EXPECT_EQ(project.config->front_left.x.expression, "11 in");
  EXPECT_FALSE(project.config->cof);
}

TEST(Choreo, ChangesWhatIsChangedAndNoMore) {
  auto file = parse_choreo_trajectory(version_3, "a.traj").value();
  file.trajectory.samples[1].x = 3.25;
  file.events[0].name = "sho\"ot";
  std::string wanted = with(version_3, R"("t":1.5, "x":3.0)", R"("t":1.5, "x":3.25)");
  wanted = with(wanted, R"("name":"shoot")", R"("name":"sho\"ot")");
  EXPECT_EQ(to_choreo(file).value(), wanted);

  // Samples keep what is theirs when they change their places, and others join them.
  std::swap(file.trajectory.samples[0], file.trajectory.samples[1]);
  ChoreoSample added;
  added.time = 2.0;
  added.vx = 0.5;
  file.trajectory.samples.push_back(added);
  file.trajectory.splits.push_back(2);
  const std::string text = to_choreo(file).value();
  const auto again = parse_choreo_trajectory(text, "a.traj");
  ASSERT_TRUE(again) << to_string(again.error()) << text;
  ASSERT_EQ(again->trajectory.samples.size(), 3U);
  EXPECT_EQ(again->trajectory.samples[0].x, 3.25);
  EXPECT_EQ(again->trajectory.samples[2].vx, 0.5);
  EXPECT_LT(text.find("\"extra\":[1, 2]"), text.find("\"x\":1.0, \"y\":0.6096"));
  EXPECT_NE(text.find("\"splits\":[0, 2]"), std::string::npos) << text;
  EXPECT_EQ(to_choreo(*again).value(), text);
}

TEST(Choreo, WritesAFileOfItsOwn) {
  ChoreoTrajectory file;
  file.name = "new";
  file.version = "3";
  file.params.target_dt = {0.05, "0.05 s", {}};
  file.params.waypoints.resize(2);
  file.params.waypoints[1].x = {2.5, "2.5 m", {}};
  file.params.constraints.push_back({.from = "first", .type = "StopPoint"});
  file.params.constraints.push_back(
      {.from = "0", .to = "last", .type = "MaxVelocity", .props = {{"max", {3.0, "3 m / s", {}}}}});
  file.trajectory.sample_type = "Differential";
  file.trajectory.waypoints = {0.0, 1.0};
  file.trajectory.samples.resize(2);
  for (ChoreoSample& sample : file.trajectory.samples) {
    sample.vl = sample.vr = 1.0;
  }
  file.trajectory.samples[1].time = 1.0;
  AutoCommand group{.type = "parallel"};
  group.commands.push_back({.type = "wait", .wait = {0.5, "0.5 s", {}}});
  file.events.push_back({.name = "mark", .target = 0, .target_timestamp = 0.0, .command = group});
  const std::string text = to_choreo(file).value();
  const auto again = parse_choreo_trajectory(text, "new.traj");
  ASSERT_TRUE(again) << to_string(again.error()) << text;
  EXPECT_EQ(again->params.waypoints[1].x.expression, "2.5 m");
  EXPECT_EQ(again->params.constraints[1].prop("max"), 3.0);
  EXPECT_EQ(again->params.constraints[1].from, "0");
  EXPECT_EQ(again->params.constraints[0].to, std::nullopt);
  EXPECT_TRUE(again->differential());
  EXPECT_EQ(again->events[0].command->commands[0].wait.value, 0.5);
  EXPECT_EQ(to_choreo(*again).value(), text);
  EXPECT_NE(text.find("\"version\":3,"), std::string::npos) << text;
}

TEST(Choreo, OfANewerVersionWhatIsKnown) {
  const auto file =
      parse_choreo_trajectory(with(version_3, "\"version\":3", "\"version\":7"), "a.traj");
  ASSERT_TRUE(file);
  ASSERT_EQ(file->diagnostics.size(), 1U);
  EXPECT_EQ(file->diagnostics[0].code, "unknown_version");
  EXPECT_EQ(file->trajectory.samples.size(), 2U);
  EXPECT_NE(to_choreo(*file).value().find("\"version\":7"), std::string::npos);
}

TEST(Choreo, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(refusal_of(""), "a.traj:1:1: the text is empty; it must be JSON");
  EXPECT_EQ(refusal_of(version_3.substr(0, 2) + "\"name\":\"lob\", "),
            "a.traj:2:15: the text is cut off; it must be a key in quotes; copy the file again");
  EXPECT_EQ(refusal_of(with(version_3, "\"vx\":1.0", "\"vx\":\"fast\"")),
            "a.traj:20:53: trajectory.samples[1].vx is \"fast\"; it must be a number");
  EXPECT_EQ(refusal_of(with(version_3, "\"vx\":1.0", "\"vx\":NaN")),
            "a.traj:20:53: a number is \"NaN, \"vy\":0.…\"; it must be a finite number; the tool "
            "that wrote it divided by zero: generate the path again");
  EXPECT_EQ(refusal_of(with(version_3, "\"vx\":1.0", "\"vx\":1e999")),
            "a.traj:20:53: a number is 1e999, larger than a double holds; it must be a finite "
            "number");
  EXPECT_EQ(refusal_of(with(version_3, "\"t\":1.5, ", "")),
            "a.traj:20:5: trajectory.samples[1].t is missing");
  EXPECT_EQ(refusal_of(with(version_3, "\"t\":1.5", "\"t\":null")),
            "a.traj:20:10: trajectory.samples[1].t is null; it must be a number; the tool that "
            "wrote it had no number there: generate it again");
  EXPECT_EQ(refusal_of(with(version_3, "[1.0,2.0,3.0,4.0]", "[1.0,2.0,3.0]")),
            "a.traj:19:123: trajectory.samples[0].fx is a list of 3 values; it must be a list of "
            "four numbers");
  EXPECT_EQ(refusal_of(with(version_3, "\"intervals\":14", "\"intervals\":1.5")),
            "a.traj:7:119: params.waypoints[0].intervals is 1.5; it must be a whole number");
  EXPECT_EQ(refusal_of(with(version_3, "\"waypoints\":[0.0,1.5]", "\"waypoints\":{}")),
            "a.traj:17:15: trajectory.waypoints is an object; it must be a list");
  EXPECT_EQ(refusal_of(with(version_3, "\"version\":3", "\"name\":3")),
            "a.traj:3:2: the key \"name\" is there twice; it must be once in its object");
  EXPECT_EQ(refusal_of(project_2),
            "a.traj: the JSON is an object of name, version, type, variables; it must be a Choreo "
            "trajectory: name, version, params, trajectory; that is a project (.chor): give one "
            "of its .traj files");
  EXPECT_EQ(refusal_of("[]"),
            "a.traj: the JSON is a list; it must be a Choreo trajectory: name, version, params, "
            "trajectory");
  const std::string deep = std::string(100'000, '[') + std::string(100'000, ']');
  EXPECT_NE(refusal_of(deep).find("more than 200 brackets inside each other"), std::string::npos);
  std::string many = "[";
  many.append(1'000'010, '0');
  for (std::size_t i = 2; i < many.size(); i += 2) {
    many[i] = ',';
  }
  EXPECT_NE(refusal_of(many + "]").find("more than 500000 values"), std::string::npos);
}

TEST(Choreo, PointsAtIt) {
  const auto file = parse_choreo_trajectory(
      with(version_3, "\"sampleType\":\"Swerve\"", "\"sampleType\":4"), "a");
  ASSERT_FALSE(file);
  const std::vector<QuotedError> all = file.error().all();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].excerpt,
            "   16 |   \"sampleType\":4,\n"
            "      |                ^");
}

TEST(Choreo, EndlessNumbersAreNotWritten) {
  auto file = parse_choreo_trajectory(version_3, "a.traj").value();
  file.trajectory.samples[0].x = std::numeric_limits<double>::quiet_NaN();
  const auto text = to_choreo(file);
  ASSERT_FALSE(text);
  EXPECT_TRUE(text.error().is(MotionFileError::wrong_field));
}

#ifdef FLYBALL_TEST_DATA
TEST(Choreo, RealFilesOfAllVersions) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(FLYBALL_TEST_DATA "/choreo")) {
    const std::string path = entry.path().string();
    const std::string text = read_file(path).value();
    SCOPED_TRACE(path);
    if (path.ends_with(".chor")) {
      const auto file = read_choreo_project(path);
      ASSERT_TRUE(file) << to_string(file.error());
      EXPECT_TRUE(file->diagnostics.empty());
      EXPECT_EQ(to_choreo(*file).value(), text);
    } else {
      const auto file = read_choreo_trajectory(path);
      ASSERT_TRUE(file) << to_string(file.error());
      EXPECT_TRUE(file->diagnostics.empty());
      EXPECT_GT(file->trajectory.samples.size(), 20U);
      EXPECT_EQ(to_choreo(*file).value(), text);
    }
    ++files;
  }
  EXPECT_GE(files, 7);
}
#endif

}  // namespace
}  // namespace flyball::choreo_test
