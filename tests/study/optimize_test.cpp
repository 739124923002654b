#include <flyball/study/optimize.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/study/project.hpp>

namespace flyball::study::optimize_test {
namespace {

const std::string robot =
    "[drive]\ntype = \"swerve\"\nmotor = \"Kraken X60\"\ngearing = 6.75\nwheel_radius = \"2 in\"\n"
    "mass = \"54 kg\"\nmoment_of_inertia = \"6 kg m^2\"\ntrackwidth = \"0.54 m\"\n"
    "stator_limit = \"80 A\"\n[optimize]\n";

std::string written(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + name;
  std::ofstream(path) << text;
  return path;
}

OptimizeResult optimized(const std::string& path) {
  const auto job = optimize_job(path);
  EXPECT_TRUE(job) << (job ? "" : to_string(job.error()));
  if (!job) {
    return {};
  }
  auto result = optimize(*job);
  EXPECT_TRUE(result) << (result ? "" : to_string(result.error()));
  return result ? *std::move(result) : OptimizeResult{};
}

std::string refusal(const std::string& path) {
  const auto job = optimize_job(path);
  return job ? std::string("no error") : to_string(job.error());
}

TEST(Optimize, AProjectGivesATrajectory) {
  const std::string path = written(
      "optimize.toml", robot +
                           "waypoints = [\"1 m, 1 m, 0 deg\", \"3 m, 2 m\", \"5 m, 1 m, 90 deg\"]\n"
                           "keep_out = [\"3 m, 1 m, 0.3 m\"]\nkeep_in = [\"0 m, 0 m, 10 m, 8 m\"]\n"
                           "max_acceleration = \"5 m/s^2\"\n");
  const OptimizeResult result = optimized(path);
  ASSERT_EQ(result.solutions.size(), 1U);
  const DriveSolution& s = result.solutions[0];
  EXPECT_TRUE(s.solved) << s.message;
  EXPECT_LT(s.waypoint_error, 1e-3);
  const Answer answer = answer_of(result);
  EXPECT_FALSE(answer.refusal);
  EXPECT_EQ(answer.figures.size(), 3U);
  EXPECT_EQ(answer.animations.size(), 1U);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json["schema"], "flyball.optimize/1");
  EXPECT_EQ(json["trajectories"][0]["duration"].get<double>(), s.duration);
  EXPECT_EQ(json["trajectories"][0]["samples"]["time"].size(), s.samples.size());
  // The trajectory as Choreo's file reads back, and again as a task that takes as long.
  ASSERT_EQ(answer.files.size(), 3U);
  EXPECT_EQ(answer.files[1].name, "data/optimize.traj");
  EXPECT_EQ(answer.files[2].name, "data/optimize.chor");
  const std::string again = written("optimize_again.traj", answer.files[1].contents);
  const OptimizeResult second = optimized(again);
  ASSERT_EQ(second.solutions.size(), 1U);
  ASSERT_TRUE(second.job.tasks[0].given_duration);
  EXPECT_NEAR(*second.job.tasks[0].given_duration, s.duration, 1e-9);
}

// Choreo's own types: numbers with what was typed in params, bare ones in what was generated.
void expect_numbers(const nlohmann::json& from, bool expressed, const std::string& where) {
  for (const auto& [key, value] : from.items()) {
    const bool number = value.is_number_float();
    EXPECT_FALSE(expressed && number) << where << key;
    EXPECT_FALSE(!expressed && value.is_object() && value.contains("exp")) << where << key;
    if (value.is_structured() && !(value.is_object() && value.contains("exp"))) {
      expect_numbers(value, expressed, where + key + ".");
    }
  }
}

TEST(Optimize, ChoreoOpensWhatIsWritten) {
  for (const std::string type : {"swerve", "mecanum", "differential"}) {
    std::string text = robot;
    text.replace(text.find("swerve"), 6, type);
    const OptimizeResult result = optimized(written(
        "choreo_" + type + ".toml",
        text + "waypoints = [\"1 m, 1 m, 0 deg\", \"2 m, 1.2 m, 0 deg, stop\", \"4 m, 1.5 m\"]\n"
               "point_at = [\"1, 1, 9 m, 1.2 m, 20 deg\"]\nmax_velocity = \"3 m/s\"\n"
               "keep_in = [\"0 m, 0 m, 10 m, 8 m\"]\n"));
    const Answer answer = answer_of(result);
    ASSERT_EQ(answer.files.size(), 3U) << type;
    const auto file = nlohmann::json::parse(answer.files[1].contents);
    expect_numbers(file["params"], true, type + ": params.");
    expect_numbers(file["snapshot"], false, type + ": snapshot.");
    expect_numbers(file["trajectory"]["config"], false, type + ": config.");
    EXPECT_EQ(file["params"]["waypoints"][0]["x"]["exp"], "1 m");
    EXPECT_EQ(file["trajectory"]["sampleType"], type == "differential" ? "Differential" : "Swerve");
    int stops = 0;
    for (const auto& c : file["params"]["constraints"]) {
      stops += c["data"]["type"] == "StopPoint" ? 1 : 0;
      if (c["data"]["type"] == "PointAt") {
        EXPECT_EQ(c["data"]["props"]["flip"], false);
      }
    }
    EXPECT_EQ(stops, 3);
    const auto project = nlohmann::json::parse(answer.files[2].contents);
    expect_numbers(project["config"], true, type + ": project.");
    EXPECT_EQ(project["version"], 2);
    EXPECT_TRUE(parse_choreo_project(answer.files[2].contents, "what was written"));
    // The forces of a sample add up to m a.
    if (type != "differential") {
      const auto& sample = file["trajectory"]["samples"][3];
      double fx = 0.0;
      for (const double f : sample["fx"]) {
        fx += f;
      }
      EXPECT_NEAR(fx, 54.0 * sample["ax"].get<double>(), 1e-6 * std::abs(fx) + 1e-6) << type;
    }
  }
}

TEST(Optimize, LimitsOfTheSearchAreKept) {
  const std::string way = "waypoints = [\"1 m, 1 m, 0 deg\", \"9 m, 1 m\"]\n";
  const OptimizeResult hurried =
      optimized(written("hurried.toml", robot + way + "longest = \"0.5 s\"\n"));
  EXPECT_EQ(hurried.job.options.longest_segment, 0.5);
  EXPECT_FALSE(hurried.solutions[0].solved);
  EXPECT_NE(hurried.solutions[0].message.find("the longest segment"), std::string::npos)
      << hurried.solutions[0].message;
  const OptimizeResult cut =
      optimized(written("cut.toml", robot + way + "time_limit = \"1 us\"\n"));
  EXPECT_FALSE(cut.solutions[0].solved);
  EXPECT_EQ(cut.solutions[0].message, "the time limit is over");
}

TEST(Optimize, SupplyLimitsSlowIt) {
  const std::string way = "waypoints = [\"1 m, 1 m, 0 deg\", \"5 m, 1 m\"]\n";
  const double free = optimized(written("free.toml", robot + way)).solutions[0].duration;
  std::string text = robot;
  text.replace(text.find("[optimize]"), 10, "supply_limit = \"20 A\"\n[optimize]");
  const OptimizeResult held = optimized(written("held.toml", text + way));
  EXPECT_TRUE(held.solutions[0].solved) << held.solutions[0].message;
  EXPECT_GT(held.solutions[0].duration, 1.02 * free);
}

TEST(Optimize, ContradictionsAreRefusedByName) {
  const OptimizeResult result = optimized(
      written("contradiction.toml", robot + "waypoints = [\"1 m, 1 m, 0 deg\", \"5 m, 1 m\"]\n"
                                            "keep_in = [\"0 m, 0 m, 3 m, 3 m\"]\n"));
  const Answer answer = answer_of(result);
  ASSERT_TRUE(answer.refusal);
  EXPECT_TRUE(answer.refusal->is(OptimizeError::contradiction));
  EXPECT_NE(to_string(*answer.refusal).find("keep in rectangle"), std::string::npos)
      << to_string(*answer.refusal);
}

TEST(Optimize, MistakesOfAProjectAreNamed) {
  const auto says = [](const std::string& text, const std::string& what) {
    const std::string message = refusal(written("mistake.toml", robot + text));
    EXPECT_NE(message.find(what), std::string::npos) << message;
  };
  says("", "optimize.waypoints");
  says("waypoints = [\"1 m, 1 m\"]\n", "one place");
  says("waypoints = [\"1 m\", \"2 m, 1 m\"]\n", "optimize.waypoints[0]");
  says("waypoints = [\"1 m, 1 kg\", \"2 m, 1 m\"]\n", "optimize.waypoints[0]");
  const std::string way = "waypoints = [\"1 m, 1 m\", \"2 m, 1 m\"]\n";
  says(way + "keep_out = [\"1 m, 1 m\"]\n", "optimize.keep_out[0]");
  says(way + "lanes = [\"0, 2, 1 cm\"]\n", "waypoint 2");
  says(way + "point_at = [\"0, 1, 1 m\"]\n", "from, to, x, y, tolerance");
}

/// A trajectory of Choreo, generated not yet.
std::string choreo(const std::string& constraint, bool with_robot) {
  const std::string config =
      R"("config":{"frontLeft":{"x":0.28,"y":0.28},"backLeft":{"x":-0.28,"y":0.28},"mass":60.0,)"
      R"("inertia":6.0,"gearing":6.5,"radius":0.0508,"vmax":600.0,"tmax":1.2,"cof":1.5,)"
      R"("bumper":{"front":0.4,"side":0.4,"back":0.4},"differentialTrackWidth":0.56},)";
  const auto waypoint = [](const std::string& x) {
    return R"({"x":{"exp":")" + x + R"( m","val":)" + x +
           R"(},"y":{"exp":"1 m","val":1.0},"heading":{"exp":"0 rad","val":0.0},)"
           R"("intervals":20,"split":false,"fixTranslation":true,"fixHeading":true,)"
           R"("overrideIntervals":false})";
  };
  return R"({"name":"line","version":3,"snapshot":null,"params":{"waypoints":[)" + waypoint("1.0") +
         "," + waypoint("3.0") + R"(],"constraints":[)" + constraint +
         R"(],"targetDt":{"exp":"0.05 s","val":0.05}},"trajectory":{)" +
         (with_robot ? config : std::string()) +
         R"("sampleType":"Swerve","waypoints":[],"samples":[],"splits":[]},"events":[]})";
}
const std::string stops =
    R"({"from":"first","to":null,"data":{"type":"StopPoint","props":{}},"enabled":true},)"
    R"({"from":"last","to":null,"data":{"type":"StopPoint","props":{}},"enabled":true})";

TEST(Optimize, ChoreosFilesAreSolvedAsTheyStand) {
  const OptimizeResult result = optimized(written("line.traj", choreo(stops, true)));
  ASSERT_EQ(result.solutions.size(), 1U);
  const double a = 4.0 * 1.2 * 6.5 / 0.0508 / 60.0;
  EXPECT_NEAR(result.solutions[0].duration, 2.0 * std::sqrt(2.0 / a), 1e-3);
}

TEST(Optimize, MistakesOfChoreosFilesAreNamed) {
  const std::string folder = testing::TempDir() + "alone/";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "line.traj") << choreo(stops, false);
  EXPECT_NE(refusal(folder + "line.traj").find("trajectory.config"), std::string::npos)
      << refusal(folder + "line.traj");
  EXPECT_NE(refusal(written("unknown.traj",
                            choreo(R"({"from":0,"to":1,"data":{"type":"KeepWarm","props":{}},)"
                                   R"("enabled":true})",
                                   true)))
                .find("KeepWarm"),
            std::string::npos);
  EXPECT_NE(refusal(written("outside.traj",
                            choreo(R"({"from":9,"to":null,"data":{"type":"StopPoint","props":{}},)"
                                   R"("enabled":true})",
                                   true)))
                .find("0 to 1"),
            std::string::npos);
  EXPECT_NE(refusal(written("samples.traj",
                            R"({"samples":[{"timestamp":0,"x":0,"y":0,"heading":0,"velocityX":0,)"
                            R"("velocityY":0,"angularVelocity":0}],"eventMarkers":[]})"))
                .find("samples alone"),
            std::string::npos);
  EXPECT_NE(refusal(folder + "none.traj"), "no error");
  EXPECT_NE(refusal(written("broken.chor", "{")), "no error");
}

#ifdef FLYBALL_TEST_DATA
// A project of 2024 is written back with its new trajectories, all else as it stood.
TEST(Optimize, ProjectsOf2024AreWrittenBack) {
  const std::string path = FLYBALL_TEST_DATA "/choreo/choreo2024_example.chor";
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "no such data here";
  }
  const Answer answer = answer_of(optimized(path));
  const auto file = std::find_if(answer.files.begin(), answer.files.end(), [](const auto& f) {
    return f.name == "data/choreo2024_example.chor";
  });
  ASSERT_NE(file, answer.files.end());
  std::ifstream in(path);
  const auto before = nlohmann::json::parse(in);
  auto after = nlohmann::json::parse(file->contents);
  EXPECT_EQ(after["paths"]["c2sub"]["trajectory"].empty(), false);
  EXPECT_EQ(after["paths"]["c2sub"]["trajectoryWaypoints"].size(),
            after["paths"]["c2sub"]["waypoints"].size());
  for (auto& [name, of] : after["paths"].items()) {
    EXPECT_EQ(of["constraints"], before["paths"][name]["constraints"]) << name;
    EXPECT_EQ(of["waypoints"], before["paths"][name]["waypoints"]) << name;
    EXPECT_EQ(of["usesControlIntervalGuessing"],
              before["paths"][name]["usesControlIntervalGuessing"])
        << name;
  }
  EXPECT_EQ(after["robotConfiguration"], before["robotConfiguration"]);
}

TEST(Optimize, RealFilesOfChoreoAreNotSlower) {
  const std::string folder = FLYBALL_TEST_DATA "/choreo/";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no such data here";
  }
  for (const char* name : {"trajectory_3_swerve.traj", "trajectory_beta-6_swerve.traj",
                           "trajectory_3_differential.traj", "choreo2024_example.chor"}) {
    const OptimizeResult result = optimized(folder + name);
    ASSERT_FALSE(result.solutions.empty()) << name;
    for (std::size_t i = 0; i < result.solutions.size(); ++i) {
      const DriveSolution& s = result.solutions[i];
      const OptimizeTask& task = result.job.tasks[i];
      EXPECT_TRUE(s.solved) << name << " " << task.name << ": " << s.message;
      if (task.given_duration) {
        EXPECT_LT(s.duration, 1.005 * *task.given_duration) << name << " " << task.name;
      }
      EXPECT_LT(s.waypoint_error, 1e-3) << name;
      for (const DriveViolation& v : s.violations) {
        EXPECT_LT(v.share, 1e-3) << name << " " << task.name << ": " << v.name;
      }
    }
  }
}
#endif

}  // namespace
}  // namespace flyball::study::optimize_test
