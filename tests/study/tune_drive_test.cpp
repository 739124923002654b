#include <algorithm>
#include <filesystem>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/io/sysid_json.hpp>
#include <flyball/study/answer.hpp>
#include <flyball/study/identify_logs.hpp>
#include <flyball/study/tune.hpp>

#include "drive_sessions.hpp"
#include "session_file.hpp"

namespace flyball::study::tune_drive_test {
namespace {

/// A drivetrain's session as a SysId JSON, removed with it.
class DriveFile {
 public:
  DriveFile(const drives::Session& session, const std::string& name)
      : path_((std::filesystem::temp_directory_path() / name).string()) {
    SysIdJson log;
    log.layout = SysIdJson::Layout::drive;
    log.test = session.straight ? "Drivetrain" : "Drivetrain (Angular)";
    log.units = "Meters";
    log.units_per_rotation = 1.0;
    const identification::DriveRecording recorded = drives::record(session);
    for (const identification::DriveRun& run : recorded.runs) {
      SysIdJson::Run rows;
      rows.name = sysid_name(run.kind);
      rows.time = run.time;
      rows.voltage = run.left.voltage;
      rows.right_voltage = run.right.voltage;
      rows.position = run.left.position;
      rows.right_position = run.right.position;
      rows.velocity = run.left.velocity;
      rows.right_velocity = run.right.velocity;
      rows.angle = run.heading;
      rows.angle_rate = std::vector<double>(run.time.size(), 0.0);
      log.runs.push_back(rows);
    }
    EXPECT_TRUE(write_sysid_json(path_, log));
  }
  ~DriveFile() { std::filesystem::remove(path_); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Straight tests and rotations: a loop of each motion, for its own delay and gains; the sides' one
// gain is the smaller of the two, and K mixes both: (K_linear ± K_angular)/2.
TEST(TuneDrive, DesignsBothMotions) {
  const DriveFile straight({.turning = false, .seed = 3}, "flyball_drive_straight.json");
  const DriveFile rotations({.straight = false, .seed = 4}, "flyball_drive_turning.json");
  TuneJob job;
  job.identification.log = straight.path();
  job.identification.selection.also = rotations.path();
  const auto result = tune(job);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_TRUE(result->drive && result->drive->linear && result->drive->angular);
  ASSERT_TRUE(*result->drive->linear) << to_string(result->drive->linear->error());
  ASSERT_TRUE(*result->drive->angular) << to_string(result->drive->angular->error());
  const DesignResult& linear = **result->drive->linear;
  const DesignResult& angular = **result->drive->angular;
  const identification::DriveFit& fit = *result->identification.drive->fit;
  EXPECT_EQ(linear.job.plant.gains.kV, fit.linear->kV.value);
  EXPECT_EQ(angular.job.plant.gains.kA, fit.angular->kA.value);
  EXPECT_EQ(*linear.job.controller.delay, fit.linear->velocity_delay);
  EXPECT_TRUE(linear.robust && angular.robust);
  const double a = linear.paste.front().kP;
  const double b = angular.paste.front().kP;
  EXPECT_EQ(result->drive->kP, std::min(a, b));
  ASSERT_TRUE(result->drive->K);
  // One metre a second of both sides is one of the mean, against each other one of the difference.
  EXPECT_NEAR((*result->drive->K * Eigen::Vector2d(1.0, 1.0))(0), a, 1e-12);
  EXPECT_NEAR((*result->drive->K * Eigen::Vector2d(-1.0, 1.0))(1), b, 1e-12);

  const Answer answer = answer_of(*result);
  EXPECT_FALSE(answer.refusal);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json["identification"]["mechanism"], "drivetrain");
  EXPECT_EQ(json["drive"]["kP"].get<double>(), result->drive->kP);
  EXPECT_EQ(json["drive"]["angular"]["K"][0][0].get<double>(), angular.K(0, 0));
  std::set<std::string> ids;
  for (const Section& section : answer.document.sections) {
    EXPECT_TRUE(ids.insert(section.id).second) << section.id;
  }
  EXPECT_TRUE(ids.contains("linear_plant") && ids.contains("sides") && ids.contains("constants"));
  std::set<std::string> files;
  for (const AnswerFile& file : answer.files) {
    EXPECT_TRUE(files.insert(file.name).second) << file.name;
  }
  EXPECT_TRUE(files.contains("data/angular_closed_loop.csv"));
  const auto java = std::find_if(answer.files.begin(), answer.files.end(), [](const auto& file) {
    return file.name == "constants/wpilib_java.txt";
  });
  ASSERT_NE(java, answer.files.end());
  for (const char* part :
       {"kVAngular = ", "V·s/rad", "identifyDrivetrainSystem(",
        "DifferentialDriveKinematics(trackwidth)", "left = new PIDController(kP"}) {
    EXPECT_NE(java->contents.find(part), std::string::npos) << part << " in\n" << java->contents;
  }
}

// Without rotations there is one loop, and constants without a turning motion.
TEST(TuneDrive, DesignsTheMotionThatIsKnown) {
  const DriveFile straight({.turning = false, .seed = 3}, "flyball_drive_alone.json");
  const auto result =
      tune({.identification = {.log = straight.path(), .selection = {}}, .design = {}});
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_TRUE(result->drive && result->drive->linear && *result->drive->linear);
  EXPECT_FALSE(result->drive->angular);
  EXPECT_FALSE(result->drive->K);
  EXPECT_EQ(result->drive->kP, (*result->drive->linear)->paste.front().kP);
  const Answer answer = answer_of(*result);
  EXPECT_FALSE(answer.refusal);
  EXPECT_EQ(answer.json.find("\"angular\":{\"mechanism\""), std::string::npos);
}

TEST(TuneDrive, SeveralLogsAreComparedAndFittedTogether) {
  const DriveFile a({.turning = false, .seed = 5}, "flyball_drive_a.json");
  const DriveFile b({.turning = false, .seed = 6}, "flyball_drive_b.json");
  const auto result = identify_logs({.logs = {a.path(), b.path()}, .selection = {}});
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->repeats());
  ASSERT_TRUE(result->joint.drive && result->joint.drive->fit);
  EXPECT_EQ(result->joint.drive->recording.runs.size(), 8U);
  EXPECT_NEAR(result->joint.drive->fit->linear->kV.value, drives::truth.kV_linear, 0.02);
  const Answer answer = answer_of(*result);
  EXPECT_FALSE(answer.refusal);
  EXPECT_NE(answer.document.verdict.line.find("The 2 logs agree."), std::string::npos);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json["mechanism"], "drivetrain");
  EXPECT_TRUE(json["logs"][1]["gains"].contains("kV"));
  EXPECT_TRUE(json["modes"].contains("linear"));
  std::set<std::string> compared;
  for (const auto& comparison : json["comparisons"]) {
    compared.insert(comparison["gain"].get<std::string>());
  }
  EXPECT_TRUE(compared.contains("kA_linear") && compared.contains("kS_left"));

  // A log of another thing is no log of this drivetrain.
  CharacterizationOptions session;
  session.mechanism = mechanisms::MechanismKind::elevator;
  session.kV = 2.0;
  session.kA = 0.3;
  session.kG = 0.8;
  const SessionFile other(session, "Elevator", "flyball_drive_other.json");
  const auto mixed = identify_logs({.logs = {a.path(), other.path()}, .selection = {}});
  ASSERT_FALSE(mixed);
  EXPECT_NE(to_string(mixed.error()).find("of a mechanism"), std::string::npos)
      << to_string(mixed.error());
}

}  // namespace
}  // namespace flyball::study::tune_drive_test
