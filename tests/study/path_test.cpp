#include <flyball/study/path.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/io/file.hpp>

namespace flyball::study::path_test {
namespace {

constexpr double pi = std::numbers::pi;

class Folder {
 public:
  Folder() {
    path_ = std::filesystem::temp_directory_path() /
            ("flyball_path_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string write(const std::string& name, const std::string& contents) const {
    std::ofstream(path_ / name) << contents;
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

/// A path of PathPlanner along control points, a Bézier curve each three of them.
PathPlannerPath path_of(const std::vector<PlannerPoint>& points) {
  PathPlannerPath path;
  path.version = "2025.0";
  for (std::size_t i = 0; i < points.size(); i += 3) {
    PathPlannerWaypoint waypoint{.anchor = points[i]};
    if (i > 0) {
      waypoint.previous_control = points[i - 1];
    }
    if (i + 1 < points.size()) {
      waypoint.next_control = points[i + 1];
    }
    path.waypoints.push_back(waypoint);
  }
  path.constraints.max_velocity = 2.0;
  path.constraints.max_acceleration = 2.0;
  path.goal_end_state = PathPlannerState{};
  path.ideal_starting_state = PathPlannerState{};
  return path;
}

PathPlannerPath straight() {
  return path_of({{1, 1}, {2, 1}, {4, 1}, {5, 1}});
}

PathResult plan(const Folder& folder, const PathPlannerPath& path, PathJob job = {}) {
  job.files = {folder.write("a.path", to_pathplanner(path).value())};
  auto result = plan_path(job);
  EXPECT_TRUE(result) << to_string(static_cast<const Error&>(result.error()));
  return std::move(result).value();
}

TEST(Path, AStraightLineIsATrapezoid) {
  const Folder folder;
  const PathResult result = plan(folder, straight());
  // 4 m at 2 m/s with 2 m/s²: 1 s up, 1 s along, 1 s down.
  EXPECT_NEAR(result.length, 4.0, 1e-9);
  EXPECT_NEAR(result.trajectory.duration(), 3.0, 3e-3);
  ASSERT_EQ(result.binding.size(), 3U);
  EXPECT_EQ(result.binding[0].limit, "acceleration");
  EXPECT_EQ(result.binding[1].limit, "velocity");
  EXPECT_EQ(result.binding[2].limit, "acceleration");
  EXPECT_NEAR(result.binding[1].from, 1.0, 0.05);
  EXPECT_NEAR(result.binding[1].to, 2.0, 0.05);
  // The same with ends that move: 2 m/s all along.
  PathJob moving;
  moving.start_velocity = Velocity(2.0);
  moving.end_velocity = Velocity(2.0);
  EXPECT_NEAR(plan(folder, straight(), moving).trajectory.duration(), 2.0, 5e-4);
}

// A waypoint that is there twice, its control points beyond each other: the curve between goes on,
// back past it and on again, so that it stops twice more.
TEST(Path, AWaypointThatIsThereTwice) {
  const Folder folder;
  const PathResult result = plan(folder, path_of({{1, 1},
                                                  {2, 1},
                                                  {2.5, 1},
                                                  {3, 1},
                                                  {3.5, 1},
                                                  {2.5, 1},
                                                  {3, 1},
                                                  {3.5, 1},
                                                  {4, 1},
                                                  {5, 1}}));
  // Out to the cubic's extremes, 1.5 t (1 - t)(1 - 2 t) at t = (1 ± 1/√3)/2: 0.144 m to both sides.
  EXPECT_NEAR(result.length, 4.0 + 4.0 * 0.144338, 0.02);
  EXPECT_GT(result.trajectory.duration(), 3.2);
  EXPECT_NEAR(result.trajectory.samples.back().pose.translation().x(), 5.0, 1e-9);
}

// From a line into an arc of 1 m the acceleration across would jump by v²: with a ramp the whole
// acceleration changes by no more than its limit in that time.
TEST(Path, ARampHoldsAcrossThePathToo) {
  const Folder folder;
  const double k = 4.0 / 3.0 * std::tan(pi / 8.0);
  const PathPlannerPath path =
      path_of({{1, 1}, {2, 1}, {3, 1}, {4, 1}, {4 + k, 1}, {5, 2 - k}, {5, 2}});
  PathJob job;
  job.acceleration = Acceleration(2.0);
  job.ramp = Time(0.25);
  const PathResult result = plan(folder, path, job);
  const auto& samples = result.trajectory.samples;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    ASSERT_LE((samples[i].acceleration - samples[i - 1].acceleration).norm(),
              8.0 * (samples[i].time - samples[i - 1].time) * (1.0 + 1e-9) + 1e-9)
        << samples[i].time;
  }
  for (const MotionSample& sample : samples) {  // it does not stop where the arc begins
    if (std::abs(sample.pose.x() - 4.0) < 0.5 && sample.pose.y() < 1.5) {
      ASSERT_GT(sample.velocity.norm(), 0.5) << sample.time;
    }
  }
}

TEST(Path, ACurveIsDrivenAtItsCentripetalLimit) {
  const Folder folder;
  // Nearly a half circle of 2 m: the speed is √(a r) in its middle.
  const double k = 2.0 * 4.0 / 3.0 * std::tan(pi / 8.0);
  const PathPlannerPath path =
      path_of({{2, 2}, {2 + k, 2}, {4, 4 - k}, {4, 4}, {4, 4 + k}, {2 + k, 6}, {2, 6}});
  PathJob job;
  job.velocity = Velocity(10.0);
  job.acceleration = Acceleration(20.0);
  job.centripetal = Acceleration(2.0);
  const PathResult result = plan(folder, path, job);
  EXPECT_NEAR(result.length, 2.0 * pi, 2e-3);
  const MotionSample middle = result.trajectory.at(0.5 * result.trajectory.duration());
  EXPECT_NEAR(middle.velocity.norm(), 2.0, 0.03);
  const auto longest = std::max_element(
      result.binding.begin(), result.binding.end(),
      [](const PathBinding& a, const PathBinding& b) { return a.to - a.from < b.to - b.from; });
  EXPECT_EQ(longest->limit, "centripetal acceleration");
}

TEST(Path, KeepsItsLimits) {
  const Folder folder;
  Random random(16);
  const auto place = [&] { return PlannerPoint{16.0 * random.uniform(), 8.0 * random.uniform()}; };
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<PlannerPoint> points{place(), place(), place(), place()};
    const PlannerPoint joint = points.back();
    const double share = 0.3 + random.uniform();  // the next curve goes on in the same direction
    points.push_back(
        {joint.x + share * (joint.x - points[2].x), joint.y + share * (joint.y - points[2].y)});
    points.push_back(place());
    points.push_back(place());
    PathPlannerPath path = path_of(points);
    path.rotation_targets.push_back({0.7, 360.0 * random.uniform()});
    path.goal_end_state->rotation = 180.0 * random.uniform();
    path.zones.push_back({.name = "slow", .from = 0.4, .to = 0.9});
    path.zones[0].constraints.max_velocity = 1.0;
    path.zones[0].constraints.max_acceleration = 1.5;
    const PathResult result = plan(folder, path);
    const auto& samples = result.trajectory.samples;
    ASSERT_GT(samples.size(), 100U);
    double slow = 0.0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const MotionSample& sample = samples[i];
      const double v = sample.velocity.norm();
      EXPECT_LE(v, 2.0 * (1.0 + 1e-9));
      EXPECT_LE(std::abs(sample.omega), 3.0 * pi * (1.0 + 1e-9));
      EXPECT_LE(sample.acceleration.norm(), 2.0 * (1.0 + 1e-9));
      slow += v > 1.0 + 1e-9 ? 0.0 : 1.0;
      if (i > 0) {
        ASSERT_GT(sample.time, samples[i - 1].time);
        const double dv = std::abs(v - samples[i - 1].velocity.norm());
        EXPECT_LE(dv, 2.0 * (sample.time - samples[i - 1].time) * (1.0 + 1e-6) + 1e-9);
        // Poses are where velocities lead.
        const Eigen::Vector2d step = sample.pose.translation() - samples[i - 1].pose.translation();
        const Eigen::Vector2d told =
            0.5 * (sample.time - samples[i - 1].time) * (sample.velocity + samples[i - 1].velocity);
        // Where it hardly turns between the two.
        if (sample.velocity.dot(samples[i - 1].velocity) >
            0.95 * v * samples[i - 1].velocity.norm()) {
          EXPECT_LE((step - told).norm(), 0.1 * step.norm() + 1e-4);
        }
      }
    }
    EXPECT_GT(slow, 0.05 * static_cast<double>(samples.size()));
    EXPECT_EQ(samples.front().velocity.norm(), 0.0);
    EXPECT_EQ(samples.back().velocity.norm(), 0.0);
    EXPECT_NEAR(
        std::remainder(samples.back().pose.angle() - path.goal_end_state->rotation * pi / 180.0,
                       2.0 * pi),
        0.0, 1e-9);
  }
}

TEST(Path, ARobotsWheelsAndMotorsCount) {
  const Folder folder;
  const std::string robot = folder.write("robot.toml", R"([drive]
type = "differential"
motor = "NEO"
gearing = 8.45
wheel_radius = "3 in"
mass = "54 kg"
moment_of_inertia = "6 kg m^2"
trackwidth = "0.6 m"
grip = 5.0
)");
  PathPlannerPath path = path_of({{1, 1}, {4, 1}, {10, 1}, {16, 1}});
  path.constraints.unlimited = true;
  PathJob job;
  job.project = robot;
  const PathResult result = plan(folder, path, job);
  ASSERT_TRUE(result.robot);
  EXPECT_FALSE(result.trajectory.holonomic);
  const double fastest =
      *std::max_element(result.fastest_wheel.begin(), result.fastest_wheel.end());
  EXPECT_LE(fastest, result.wheel_limit * (1.0 + 1e-9));
  EXPECT_GT(fastest, 0.9 * result.wheel_limit);
  EXPECT_EQ(result.binding.front().limit, "left side: voltage");
  // From rest: two sides' stall force over the mass.
  const double force = 2.0 * result.robot->motor.Kt / result.robot->motor.R * 12.0 * 8.45 / 0.0762;
  const double mass = 54.0 + 2.0 * result.robot->wheel_inertia / (0.0762 * 0.0762);
  EXPECT_NEAR(result.trajectory.samples[0].acceleration.norm(), force / mass, 0.04 * force / mass);
}

TEST(Path, CornersAndReversalsAreStops) {
  const Folder folder;
  const PathPlannerPath corner = path_of({{1, 1}, {2, 1}, {3, 1}, {4, 1}, {4, 2}, {4, 3}, {4, 4}});
  const PathResult result = plan(folder, corner);
  double least = 1.0;
  for (const MotionSample& sample : result.trajectory.samples) {
    if ((sample.pose.translation() - Eigen::Vector2d(4.0, 1.0)).norm() < 1e-6) {
      least = std::min(least, sample.velocity.norm());
    }
  }
  EXPECT_EQ(least, 0.0);
  // Back the way it came: a differential drive backs, and does not turn round.
  const PathPlannerPath back = path_of({{1, 1}, {2, 1}, {3, 1}, {4, 1}, {3, 1}, {2, 1}, {1, 1}});
  PathJob job;
  job.differential = true;
  const PathResult backing = plan(folder, back, job);
  EXPECT_NEAR(backing.length, 6.0, 1e-6);
  EXPECT_NEAR(backing.trajectory.samples.back().pose.angle(), 0.0, 1e-9);
  EXPECT_LT(backing.trajectory.at(0.75 * backing.trajectory.duration()).forward(), -1.0);
}

TEST(Path, TurnsAndMirrorsAreUndoneByThemselves) {
  const Folder folder;
  PathPlannerPath path = path_of({{1, 1}, {2, 3}, {4, 1}, {5, 2}});
  path.goal_end_state->rotation = 30.0;
  const PathResult plain = plan(folder, path);
  for (bool PathJob::* change : {&PathJob::flip, &PathJob::mirror, &PathJob::mirror_sides}) {
    PathJob job;
    job.*change = true;
    const PathResult once = plan(folder, path, job);
    EXPECT_NEAR(once.trajectory.duration(), plain.trajectory.duration(), 1e-12);
    // The path as a file, changed, is timed to the changed motion.
    job.to = "pathplanner";
    const PathResult file = plan(folder, path, job);
    const PathPlannerPath changed = parse_pathplanner_path(file.written, "a.path").value();
    const PathResult timed = plan(folder, changed);
    for (const double t : {0.0, 0.7, 1.9, plain.trajectory.duration()}) {
      const MotionSample a = once.trajectory.at(t);
      const MotionSample b = timed.trajectory.at(t);
      EXPECT_NEAR((a.pose.translation() - b.pose.translation()).norm(), 0.0, 1e-9);
      EXPECT_NEAR(std::remainder(a.pose.angle() - b.pose.angle(), 2.0 * pi), 0.0, 1e-9);
      EXPECT_NEAR((a.velocity - b.velocity).norm(), 0.0, 1e-9);
      EXPECT_NEAR(a.omega, b.omega, 1e-9);
    }
    // Twice is none.
    const PathPlannerPath again =
        parse_pathplanner_path(plan(folder, changed, job).written, "a.path").value();
    EXPECT_NEAR(again.waypoints[1].anchor.y, 2.0, 1e-12);
    EXPECT_NEAR(again.goal_end_state->rotation, 30.0, 1e-12);
  }
  PathJob back;
  back.reverse = true;
  const PathResult reverse = plan(folder, path, back);
  EXPECT_NEAR(reverse.trajectory.samples.front().pose.x(), 5.0, 1e-9);
  EXPECT_NEAR(reverse.trajectory.samples.back().pose.x(), 1.0, 1e-9);
}

TEST(Path, AWpilibFileStaysAsItIs) {
  const Folder folder;
  const auto row = [](double time, double x) {
    return "{\"time\":" + std::to_string(time) +
           ",\"pose\":{\"translation\":{\"x\":" + std::to_string(x) +
           ",\"y\":1},\"rotation\":{\"radians\":0}},\"velocity\":1,"
           "\"acceleration\":0,\"curvature\":0.5,\"extra\":[7]}";
  };
  const std::string text = "[" + row(0.0, 1.0) + ", " + row(1.0, 2.0) + "]";
  PathJob job;
  job.files = {folder.write("a.wpilib.json", text)};
  job.to = "wpilib";
  const auto result = plan_path(job);
  ASSERT_TRUE(result) << to_string(static_cast<const Error&>(result.error()));
  EXPECT_EQ(result->written, text);
}

TEST(Path, TranslatesToEachFormat) {
  const Folder folder;
  const PathPlannerPath path = path_of({{1, 1}, {2, 3}, {4, 1}, {5, 2}});
  for (const char* to : {"choreo", "wpilib", "csv"}) {
    PathJob job;
    job.to = to;
    const PathResult result = plan(folder, path, job);
    const auto back = read_motion(folder.write(std::string("back.") + to, result.written));
    ASSERT_TRUE(back) << to_string(static_cast<const Error&>(back.error()));
    EXPECT_NEAR(back->duration(), result.trajectory.duration(), 1e-12);
    const double t = 0.4 * back->duration();
    EXPECT_NEAR(
        (back->at(t).pose.translation() - result.trajectory.at(t).pose.translation()).norm(), 0.0,
        1e-9);
  }
  PathJob code;
  code.to = "c++";
  EXPECT_NE(plan(folder, path, code).written.find("inline constexpr std::array<Row, "),
            std::string::npos);
  // A Choreo trajectory that is turned keeps all else that its file says.
  PathJob choreo;
  choreo.to = "choreo";
  std::string text = plan(folder, path, choreo).written;
  text.insert(text.find("\"name\""), "\"mine\":[1,2], ");
  PathJob flip{.files = {folder.write("mine.traj", text)}, .flip = true, .to = "choreo"};
  const auto flipped = plan_path(flip);
  ASSERT_TRUE(flipped) << to_string(static_cast<const Error&>(flipped.error()));
  EXPECT_NE(flipped->written.find("\"mine\":[1,2], \"name\""), std::string::npos);
  const auto first = parse_choreo_trajectory(flipped->written, "a").value().trajectory.samples[0];
  EXPECT_NEAR(first.x, 17.548 - 1.0, 1e-12);
  EXPECT_NEAR(first.y, 8.052 - 1.0, 1e-12);
}

// Waypoints in one place, control points on their anchors, joints that are off by a degree.
TEST(Path, DrivesThroughWhatFilesRound) {
  const Folder folder;
  const auto noticed = [](const PathResult& result, std::string_view code) {
    return std::any_of(result.diagnostics.begin(), result.diagnostics.end(),
                       [&](const Diagnostic& diagnostic) { return diagnostic.code == code; });
  };
  const double at_once = plan(folder, straight()).trajectory.duration();
  const PathResult twice =
      plan(folder, path_of({{1, 1}, {1, 1}, {1, 1}, {1, 1}, {2, 1}, {4, 1}, {5, 1}}));
  EXPECT_TRUE(noticed(twice, "waypoints_coincide"));
  EXPECT_NEAR(twice.trajectory.duration(), at_once, 1e-9);

  const PathResult on_anchor =
      plan(folder, path_of({{1, 1}, {1, 1}, {3, 1}, {3, 1}, {3, 1}, {5, 1}, {5, 1}}));
  EXPECT_TRUE(noticed(on_anchor, "control_on_anchor"));
  EXPECT_NEAR(on_anchor.trajectory.duration(), at_once, 0.01);

  const PathResult bent =
      plan(folder, path_of({{1, 1}, {2, 1}, {2, 1}, {3, 1}, {4, 1.02}, {4, 1}, {5, 1}}));
  EXPECT_TRUE(noticed(bent, "corners_smoothed"));
  EXPECT_NEAR(bent.trajectory.duration(), at_once, 0.05);
}

// The wheels' accelerations, of samples alone: no jump where a line becomes a bend.
TEST(Path, ADifferentialDriveRoundsTheCurvature) {
  const Folder folder;
  const PathPlannerPath path =
      path_of({{1, 1}, {2, 1}, {3, 1}, {4, 1}, {5.1, 1}, {6, 1.9}, {6, 3}});
  PathJob job;
  job.differential = true;
  job.velocity = Velocity(2.0);
  job.acceleration = Acceleration(2.0);
  job.angular_velocity = AngularVelocity(3.0);
  job.angular_acceleration = AngularAcceleration(6.0);
  const PathResult result = plan(folder, path, job);
  const auto& samples = result.trajectory.samples;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double dt = samples[i].time - samples[i - 1].time;
    EXPECT_LE(std::abs(samples[i].omega - samples[i - 1].omega), 6.0 * dt * (1.0 + 1e-6));
    if (samples[i].time > 1.0 && samples[i].time < result.trajectory.duration() - 1.0) {
      EXPECT_GT(samples[i].velocity.norm(), 0.3);
    }
  }
}

// A limit of a single place, as PathPlanner 2023 has it.
TEST(Path, AVelocityAtAWaypoint) {
  const Folder folder;
  const std::string file = folder.write("old.path", R"({"waypoints": [
      {"anchorPoint": {"x": 1, "y": 1}, "prevControl": null, "nextControl": {"x": 2, "y": 1},
       "holonomicAngle": 0, "isReversal": false, "velOverride": null, "isLocked": false,
       "isStopPoint": false},
      {"anchorPoint": {"x": 4, "y": 1}, "prevControl": {"x": 3, "y": 1},
       "nextControl": {"x": 5, "y": 1}, "holonomicAngle": 0, "isReversal": false,
       "velOverride": 0.5, "isLocked": false, "isStopPoint": false},
      {"anchorPoint": {"x": 7, "y": 1}, "prevControl": {"x": 6, "y": 1}, "nextControl": null,
       "holonomicAngle": 0, "isReversal": false, "velOverride": null, "isLocked": false,
       "isStopPoint": false}], "maxVelocity": 3, "maxAcceleration": 2, "isReversed": null})");
  const auto result = plan_path({.files = {file}});
  ASSERT_TRUE(result) << to_string(static_cast<const Error&>(result.error()));
  double nearest = 1e9;
  double there = 0.0;
  for (const MotionSample& sample : result->trajectory.samples) {
    if (const double d = std::abs(sample.pose.x() - 4.0); d < nearest) {
      nearest = d;
      there = sample.velocity.norm();
    }
  }
  EXPECT_NEAR(there, 0.5, 0.03);
}

TEST(Path, JoinsFiles) {
  const Folder folder;
  const std::string a = folder.write("a.path", to_pathplanner(straight()).value());
  const std::string b =
      folder.write("b.path", to_pathplanner(path_of({{5, 1}, {6, 1}, {7, 1}, {8, 1}})).value());
  const auto both = plan_path({.files = {a, b}});
  ASSERT_TRUE(both);
  EXPECT_NEAR(both->length, 7.0, 1e-6);
  EXPECT_EQ(both->parts.size(), 2U);
  const auto apart = plan_path({.files = {b, a}});
  ASSERT_FALSE(apart);
  EXPECT_NE(to_string(static_cast<const Error&>(apart.error())).find("7 m from the one's end"),
            std::string::npos);
  // A routine of both with a second between them.
  const std::string routine =
      folder.write("r.auto",
                   R"({"version": "2025.0", "command": {"type": "sequential", "data": {"commands": [
          {"type": "path", "data": {"pathName": "a"}}, {"type": "wait", "data": {"waitTime": 1.0}},
          {"type": "path", "data": {"pathName": "b"}}]}}, "resetOdom": true, "folder": null,
          "choreoAuto": false})");
  const auto whole = plan_path({.files = {routine}});
  ASSERT_TRUE(whole) << to_string(static_cast<const Error&>(whole.error()));
  EXPECT_NEAR(whole->trajectory.duration(), both->trajectory.duration() + 1.0, 1e-9);
}

TEST(Path, TellsWhatIsWrong) {
  const Folder folder;
  const auto refusal_of = [&](const PathPlannerPath& path, PathJob job = {}) {
    job.files = {folder.write("a.path", to_pathplanner(path).value())};
    const auto result = plan_path(job);
    if (result) {
      return std::string("planned");
    }
    const std::string text = to_string(static_cast<const Error&>(result.error()));
    return text.substr(text.find("a.path") + 6);
  };
  PathPlannerPath path = straight();
  path.constraints.max_velocity = 0.0;
  EXPECT_NE(refusal_of(path).find(": the velocity limit is 0; it must be positive"),
            std::string::npos);
  EXPECT_GT(std::atoi(refusal_of(path).c_str() + 1), 1) << refusal_of(path);  // the line
  const auto unasked = plan_path(
      {.files = {folder.write("a.path", to_pathplanner(straight()).value())}, .name = "mine"});
  ASSERT_FALSE(unasked);
  EXPECT_NE(to_string(static_cast<const Error&>(unasked.error())).find("--name is given"),
            std::string::npos);
  path = straight();
  path.waypoints.pop_back();
  EXPECT_EQ(refusal_of(path), ": the path is of 1 waypoints; it must be two or more");
  path = straight();
  for (PlannerPoint* point : {&path.waypoints[1].anchor, &*path.waypoints[0].next_control,
                              &*path.waypoints[1].previous_control}) {
    *point = path.waypoints[0].anchor;
  }
  EXPECT_EQ(refusal_of(path),
            ": the path is all in one place; it must be one that goes somewhere; move a waypoint");
  path = straight();
  path.waypoints[1].anchor.x = 5e5;
  EXPECT_NE(refusal_of(path).find("places are in metres"), std::string::npos);
  PathJob fast;
  fast.start_velocity = Velocity(9.0);
  EXPECT_NE(refusal_of(straight(), fast)
                .find("start velocity is 9; it must be at most 2 under the limits"),
            std::string::npos);
  fast.start_velocity.reset();
  fast.end_velocity = Velocity(1.9);
  EXPECT_EQ(refusal_of(path_of({{1, 1}, {1.1, 1}, {1.2, 1}, {1.3, 1}}), fast).substr(0, 31),
            ": end velocity is 1.9; it must ");
  const auto table_refusal = [&](const std::string& text) {
    const auto result = plan_path({.files = {folder.write("t.csv", text)}});
    const std::string told =
        result ? "planned" : to_string(static_cast<const Error&>(result.error()));
    return told.substr(told.find("t.csv") + 5);
  };
  EXPECT_EQ(table_refusal("time,x,y\n0,0,0\n1,abc,0\n2,3,0\n"),
            ":3:3: x is \"abc\"; it must be a number");
  EXPECT_EQ(table_refusal("time,x,y\n0,0,0\n1,1,0\n0.5,3,0\n"),
            ":4:1: time is 0.5 s; it must be more than the 1 s of the row before it");
  EXPECT_EQ(table_refusal("time,x,y\n0,0,0\n1,1\n2,3,0\n"),
            ":3:1: the row is of 2 cells; it must be of 3, a number in each column");
  const std::string table = folder.write("t.csv", "time,x,y\n0,0,0\n1,1,0\n2,3,0\n");
  const auto unlimited = plan_path({.files = {table}, .retime = true});
  ASSERT_FALSE(unlimited);
  EXPECT_NE(to_string(static_cast<const Error&>(unlimited.error())).find("a velocity limit"),
            std::string::npos);
}

TEST(Path, RealFiles) {
  const std::string folder = FLYBALL_TEST_DATA;
  if (!std::filesystem::exists(folder + "/pathplanner")) {
    GTEST_SKIP();
  }
  const auto score = plan_path({.files = {folder + "/pathplanner/pp2025_Score.path"}});
  ASSERT_TRUE(score) << to_string(static_cast<const Error&>(score.error()));
  EXPECT_TRUE(score->trajectory.holonomic);
  EXPECT_GT(score->trajectory.duration(), score->length / 3.0);
  const auto routine = plan_path({.files = {folder + "/pathplanner/pp2025_Example_Auto.auto"}});
  ASSERT_TRUE(routine) << to_string(static_cast<const Error&>(routine.error()));
  EXPECT_EQ(routine->parts.size(), 2U);
  // Times made anew by a file's own largest speed and acceleration are near its own.
  const auto choreo = plan_path({.files = {folder + "/choreo/trajectory_3_differential.traj"}});
  ASSERT_TRUE(choreo);
  const auto anew = plan_path({.files = {folder + "/choreo/trajectory_3_differential.traj"},
                               .velocity = Velocity(3.0),
                               .acceleration = Acceleration(4.51)});
  ASSERT_TRUE(anew) << to_string(static_cast<const Error&>(anew.error()));
  EXPECT_NEAR(anew->trajectory.duration(), choreo->trajectory.duration(), 0.02);
  for (const char* name : {"choreo/trajectory_3_swerve.traj", "choreo/choreo2024_test1.traj",
                           "wpilib-trajectory/firebears-frc_New_Path.wpilib.json"}) {
    const auto again = plan_path({.files = {folder + "/" + name},
                                  .velocity = Velocity(3.0),
                                  .acceleration = Acceleration(3.0),
                                  .angular_velocity = AngularVelocity(6.0),
                                  .angular_acceleration = AngularAcceleration(12.0)});
    EXPECT_TRUE(again) << name << to_string(static_cast<const Error&>(again.error()));
  }
}

}  // namespace
}  // namespace flyball::study::path_test
