// Other people's recordings: registered only where they are.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <gtest/gtest.h>

#include <flyball/study/answer.hpp>
#include <flyball/study/identify_logs.hpp>
#include <flyball/study/tune.hpp>

namespace flyball::study::real_logs_test {
namespace {

using mechanisms::MechanismKind;

struct RealLog {
  std::string file;
  std::optional<MechanismKind> mechanism;
};

std::vector<RealLog> mechanism_logs() {
  const std::filesystem::path root(FLYBALL_TEST_DATA);
  std::vector<RealLog> logs;
  for (const char* name : {"calcmogul_flywheel_simple", "frc2423_simple_meters_20220307-193058",
                           "frc4392_arm_20230218-170836", "mrt3216_arm_20230302-130355",
                           "sciborgs_elbow_20230222-162953", "sciborgs_elbow_20230222-163221",
                           "sciborgs_elevator_20230227-154527"}) {
    const auto path = root / "sysid-json" / (std::string(name) + ".json");
    if (std::filesystem::exists(path)) {
      logs.push_back({path.string(), std::nullopt});
    }
  }
  const std::vector<std::pair<std::string, std::optional<MechanismKind>>> wpilogs{
      {"frc6998_coralwrist_FRC_20250202_053557", MechanismKind::arm},
      {"frc6998_elevator_FRC_20250202_100203", std::nullopt},
      {"frc6998_elevator_FRC_20250202_115714", std::nullopt},
      {"frc6998_hang_FRC_20250204_033256", MechanismKind::arm}};
  for (const auto& [name, mechanism] : wpilogs) {
    const auto path = root / "wpilog" / (name + ".wpilog");
    if (std::filesystem::exists(path)) {
      logs.push_back({path.string(), mechanism});
    }
  }
  return logs;
}

class RealLogs : public ::testing::TestWithParam<RealLog> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RealLogs);

TEST_P(RealLogs, GiveGainsThatMakeSenseOrAReason) {
  TuneJob job;
  job.identification.log = GetParam().file;
  job.identification.selection.mechanism = GetParam().mechanism;
  const auto result = tune(job);
  ASSERT_TRUE(result) << to_string(result.error());
  const auto& fit = result->identification.report.fit;
  if (!fit) {
    EXPECT_EQ(fit.error().kind(), ErrorKind::no_answer) << to_string(fit.error());
    return;
  }
  EXPECT_GT(fit->kV.value, 0.0);
  EXPECT_TRUE(!fit->kA.determined || fit->kA.value > 0.0);
  if (!fit->kA.determined) {
    EXPECT_GT(fit->kA.upper_bound, 0.0);
    EXPECT_FALSE(fit->kA.reason.empty());
  }
  ASSERT_TRUE(result->design);
  ASSERT_TRUE(*result->design) << to_string(result->design->error());
  EXPECT_TRUE((*result->design)->robust);
}

std::string test_name(const ::testing::TestParamInfo<RealLog>& log) {
  std::string name = std::filesystem::path(log.param.file).stem().string();
  for (char& c : name) {
    c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Study, RealLogs, ::testing::ValuesIn(mechanism_logs()), test_name);

// The same elbow on the same day must give the same gains.
TEST(RealLogRepeats, SciborgsElbowAgreesWithItself) {
  const std::filesystem::path folder = std::filesystem::path(FLYBALL_TEST_DATA) / "sysid-json";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no recordings";
  }
  const auto first =
      identify({.log = (folder / "sciborgs_elbow_20230222-162953.json").string(), .selection = {}});
  const auto second =
      identify({.log = (folder / "sciborgs_elbow_20230222-163221.json").string(), .selection = {}});
  ASSERT_TRUE(first && second);
  ASSERT_TRUE(first->report.fit && second->report.fit);
  const double mean_kV = 0.5 * (first->report.fit->kV.value + second->report.fit->kV.value);
  EXPECT_LT(std::abs(first->report.fit->kV.value - second->report.fit->kV.value), 0.01 * mean_kV);
  const double mean_kG = 0.5 * (first->report.fit->kG->value + second->report.fit->kG->value);
  EXPECT_LT(std::abs(first->report.fit->kG->value - second->report.fit->kG->value), 0.02 * mean_kG);
}

struct BadLog {
  const char* file;
  const char* defect;  // the code of the error or of a diagnostic that names it
};

TEST(RealLogDefects, AreNamed) {
  const std::filesystem::path folder = std::filesystem::path(FLYBALL_TEST_DATA) / "sysid-json-bad";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no recordings";
  }
  for (const BadLog& bad :
       {BadLog{"mrt3216_arm_nomotion_20230301-172022.json", "no_motion"},
        BadLog{"frc1672_drive_inverted_encoder_20230427-151436.json", "inverted_encoder"},
        BadLog{"frc_characterization_2019_nine_column_idle.json", "no_motion"}}) {
    const auto result = identify({.log = (folder / bad.file).string(), .selection = {}});
    ASSERT_TRUE(result) << bad.file << ": " << to_string(result.error());
    ASSERT_FALSE(result->report.fit) << bad.file;
    EXPECT_EQ(result->report.fit.error().kind(), ErrorKind::no_answer);
    std::set<std::string> codes{std::string(result->report.fit.error().code())};
    // What is only inverted can be mended.
    EXPECT_EQ(result->drive && result->drive->fit,
              std::string_view(bad.defect) == "inverted_encoder");
    for (const Diagnostic& diagnostic : result->diagnostics()) {
      codes.insert(diagnostic.code);
    }
    EXPECT_TRUE(codes.contains(bad.defect)) << bad.file;
    if (result->drive && result->drive->fit) {
      const Verdict verdict = answer_of(*result).document.verdict;
      EXPECT_TRUE(std::ranges::any_of(verdict.reasons, [](const std::string& reason) {
        return reason.find("left side's encoder") != std::string::npos;
      })) << bad.file;
    }
  }
}

// A differential drive's straight tests and rotations of one day. Expected: least squares of the
// volts on sgn, the derivative of the positions (rotations: of the gyro's heading), its derivative
// and, straight on, where the fit leaves a drag open, its square, over 120 ms, at the delay that
// fits best, and the heading against the wheels (docs/identification.md); kA of it hangs on that
// delay.
TEST(RealLogDrivetrains, GiveWhatLeastSquaresGives) {
  const std::filesystem::path folder = std::filesystem::path(FLYBALL_TEST_DATA) / "sysid-json";
  const auto straight = folder / "ligerbots_drive_linear_20220316-213040.json";
  const auto rotations = folder / "ligerbots_drive_angular_20220316-213716.json";
  if (!std::filesystem::exists(straight) || !std::filesystem::exists(rotations)) {
    GTEST_SKIP() << "no recordings";
  }
  IdentifyJob job{.log = straight.string(), .selection = {}};
  job.selection.also = rotations.string();
  const auto result = identify(job);
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_TRUE(result->drive);
  ASSERT_TRUE(result->drive->fit) << to_string(result->drive->fit.error());
  const identification::DriveFit& fit = *result->drive->fit;
  ASSERT_TRUE(fit.linear && fit.angular && fit.trackwidth && fit.kS_left);
  const auto holds = [](const identification::GainEstimate& gain, double value) {
    return gain.interval[0] <= value && value <= gain.interval[1];
  };
  EXPECT_TRUE(holds(fit.linear->kV, 1.932));
  EXPECT_TRUE(holds(fit.linear->kS, 0.717));
  EXPECT_TRUE(holds(*fit.kS_left, 0.722));
  EXPECT_TRUE(holds(*fit.kS_right, 0.710));
  EXPECT_NEAR(fit.angular->kV.value, 2.373, 0.02 * 2.373);
  EXPECT_NEAR(fit.trackwidth->value, 0.6405, 0.01 * 0.6405);
  EXPECT_NEAR(identification::per_radian(fit.angular->kV, *fit.trackwidth).value, 0.7638,
              0.02 * 0.7638);
  std::set<std::string> codes;
  for (const Diagnostic& diagnostic : result->diagnostics()) {
    codes.insert(diagnostic.code);
  }
  EXPECT_TRUE(codes.contains("gyro_clockwise"));
  EXPECT_TRUE(codes.contains("gyro_rate"));
  // Both motions get their loops, and the sides one gain that serves both.
  const auto tuned = tune({.identification = job, .design = {}});
  ASSERT_TRUE(tuned);
  EXPECT_FALSE(tuned->design);
  ASSERT_TRUE(tuned->drive && tuned->drive->linear && tuned->drive->angular);
  ASSERT_TRUE(*tuned->drive->linear) << to_string(tuned->drive->linear->error());
  ASSERT_TRUE(*tuned->drive->angular) << to_string(tuned->drive->angular->error());
  EXPECT_TRUE((*tuned->drive->linear)->robust && (*tuned->drive->angular)->robust);
  EXPECT_FALSE(answer_of(*tuned).refusal);

  // The two logs beside each other tell the same as the one with the other.
  const auto logs =
      identify_logs({.logs = {straight.string(), rotations.string()}, .selection = {}});
  ASSERT_TRUE(logs) << to_string(logs.error());
  ASSERT_TRUE(logs->joint.drive && logs->joint.drive->fit);
  EXPECT_DOUBLE_EQ(logs->joint.drive->fit->linear->kV.value, fit.linear->kV.value);
  EXPECT_DOUBLE_EQ(logs->joint.drive->fit->angular->kV.value, fit.angular->kV.value);
}

// One drive, as its vendor's raw frames and as an exporter's channels: no name says a side's
// voltage, so they are asked for; named, they are enough.
TEST(RealLogDrivetrains, AreAskedForTheirSides) {
  const std::filesystem::path folder = std::filesystem::path(FLYBALL_TEST_DATA) / "wpilog";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no recordings";
  }
  for (const char* file : {"miami_drive_FRC_20240119_152551.wpilog",
                           "miami_drive_FRC_20240119_152551_advantagescope_export.wpilog"}) {
    const auto result = identify({.log = (folder / file).string(), .selection = {}});
    ASSERT_FALSE(result) << file;
    EXPECT_EQ(result.error().code(), "no_channel") << file;
    EXPECT_NE(to_string(result.error()).find("--voltage LEFT,RIGHT"), std::string::npos) << file;
  }
  for (const char* file : {"miami_drive_FRC_20240119_152551.wpilog",
                           "miami_drive_FRC_20240119_152551_advantagescope_export.wpilog"}) {
    IdentifyJob job{.log = (folder / file).string(), .selection = {}};
    job.selection.voltage_channel =
        "NT:/URCL/SparkMax-14/AppliedOutputVoltage,NT:/URCL/SparkMax-11/AppliedOutputVoltage";
    const auto named = identify(job);
    ASSERT_TRUE(named) << file << ": " << to_string(named.error());
    ASSERT_TRUE(named->drive && named->drive->fit && named->drive->fit->linear) << file;
    EXPECT_NEAR(named->drive->fit->linear->kV.value, 2.25, 0.1) << file;
  }
}

}  // namespace
}  // namespace flyball::study::real_logs_test
