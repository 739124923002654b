// Other people's recordings: registered only where they are.
#include <cmath>
#include <filesystem>
#include <set>

#include <gtest/gtest.h>

#include <flyball/study/tune.hpp>

namespace flyball::study {
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
    for (const Diagnostic& diagnostic : result->diagnostics()) {
      codes.insert(diagnostic.code);
    }
    EXPECT_TRUE(codes.contains(bad.defect)) << bad.file;
  }
}

// One drive, as its vendor's raw frames and as an exporter's channels.
TEST(RealLogDrivetrains, AreRecognised) {
  const std::filesystem::path folder = std::filesystem::path(FLYBALL_TEST_DATA) / "wpilog";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no recordings";
  }
  for (const char* file : {"miami_drive_FRC_20240119_152551.wpilog",
                           "miami_drive_FRC_20240119_152551_advantagescope_export.wpilog"}) {
    const auto result = identify({.log = (folder / file).string(), .selection = {}});
    ASSERT_TRUE(result) << file << ": " << to_string(result.error());
    ASSERT_FALSE(result->report.fit) << file;
    EXPECT_EQ(result->report.fit.error().code(), "drivetrain") << file;
    EXPECT_EQ(result->report.fit.error().kind(), ErrorKind::no_answer);
  }
}

}  // namespace
}  // namespace flyball::study
