#include <filesystem>
#include <map>
#include <numeric>
#include <string>

#include <gtest/gtest.h>

#include <flyball/io/log.hpp>
#include <flyball/io/wpilog.hpp>

#include "io/examples.hpp"

/// Other people's recordings, where they are. Counts and sums were taken from the files by an
/// independent reader: Python's json module for SysId, and for WPILOG forty lines of Python over
/// struct.unpack.
namespace flyball::recordings_test {
namespace {

namespace fs = std::filesystem;

const fs::path recordings = FLYBALL_TEST_DATA;

#define NEEDS_RECORDINGS()                             \
  if (!fs::exists(recordings / "sysid-json")) {        \
    GTEST_SKIP() << "no recordings in " << recordings; \
  }

TEST(Recordings, EveryLogIsReadWithoutAComplaint) {
  NEEDS_RECORDINGS();
  for (const char* folder : {"sysid-json", "sysid-json-bad", "wpilog"}) {
    for (const fs::directory_entry& file : fs::directory_iterator(recordings / folder)) {
      const Expected<Log> log = read_log(file.path().string());
      ASSERT_TRUE(log) << to_string(log.error());
      for (const Diagnostic& diagnostic : log->diagnostics) {
        EXPECT_EQ(diagnostic.severity, Severity::info)
            << file.path() << ": " << diagnostic.code << ": " << diagnostic.message;
      }
      EXPECT_EQ(log->sysid.has_value(), file.path().extension() == ".json");
    }
  }
}

TEST(Recordings, SysIdElevator) {
  NEEDS_RECORDINGS();
  const Log log =
      read_log((recordings / "sysid-json/sciborgs_elevator_20230227-154527.json").string()).value();
  ASSERT_TRUE(log.sysid);
  EXPECT_EQ(log.sysid->layout, SysIdJson::Layout::mechanism);
  EXPECT_EQ(log.sysid->test, "Elevator");
  EXPECT_EQ(log.sysid->units, "Meters");
  EXPECT_EQ(log.sysid->units_per_rotation, 0.1144);
  const std::map<std::string, std::size_t> rows = {{"slow-forward", 2191},
                                                   {"slow-backward", 1835},
                                                   {"fast-forward", 1351},
                                                   {"fast-backward", 1352}};
  for (const auto& [name, count] : rows) {
    EXPECT_EQ(log.sysid->find(name)->time.size(), count) << name;
  }
  const SysIdJson::Run& run = *log.sysid->find("slow-forward");
  EXPECT_EQ(run.time.back(), 30.89572);
  EXPECT_EQ(run.position.back(), 5.949707);
  EXPECT_EQ(run.velocity.back(), 1.168486);
  EXPECT_NEAR(std::accumulate(run.voltage.begin(), run.voltage.end(), 0.0), 5090.323263999996,
              1e-9);
}

TEST(Recordings, SysIdDriveAndItsForerunner) {
  NEEDS_RECORDINGS();
  const Log drive =
      read_log((recordings / "sysid-json/elite48_drive_linear1.json").string()).value();
  EXPECT_EQ(drive.sysid->layout, SysIdJson::Layout::drive);
  EXPECT_EQ(drive.sysid->find("slow-forward")->time.size(), 3099U);
  EXPECT_EQ(drive.sysid->find("fast-backward")->right_position[0], 54.359722);
  EXPECT_EQ(drive.sysid->find("fast-backward")->angle[0], 6.830529);
  const Log older =
      read_log(
          (recordings / "sysid-json-bad/frc_characterization_2019_nine_column_idle.json").string())
          .value();
  EXPECT_EQ(older.sysid->layout, SysIdJson::Layout::characterization_2019);
  EXPECT_EQ(older.sysid->find("slow-backward")->time.size(), 61U);
}

TEST(Recordings, WpilogOfARoutine) {
  NEEDS_RECORDINGS();
  const Log log =
      read_log((recordings / "wpilog/frc6998_elevator_FRC_20250202_100203.wpilog").string())
          .value();
  const Signal* voltage = log.find_signal("voltage-elevator-ElevatorSubsystem");
  ASSERT_NE(voltage, nullptr);
  EXPECT_EQ(voltage->unit, "Volt");
  EXPECT_EQ(voltage->time.size(), 901U);
  EXPECT_NEAR(voltage->time.front(), 9.139205, 1e-12);
  EXPECT_NEAR(std::accumulate(voltage->value.begin(), voltage->value.end(), 0.0), 354.36, 1e-9);
  EXPECT_EQ(log.find_signal("velocity-elevator-ElevatorSubsystem")->unit, "Meter per Second");
  const TextSignal* state = log.find_text("sysid-test-state-ElevatorSubsystem");
  ASSERT_NE(state, nullptr);
  std::map<std::string, int> states;
  for (const std::string& value : state->value) {
    ++states[value];
  }
  EXPECT_EQ(states, (std::map<std::string, int>{{"quasistatic-forward", 250},
                                                {"quasistatic-reverse", 246},
                                                {"dynamic-forward", 222},
                                                {"dynamic-reverse", 183},
                                                {"none", 4}}));
  // 28 scalars with data and what the one double[] adds; 11 texts.
  EXPECT_EQ(log.texts.size(), 11U);
  EXPECT_GE(log.signals.size(), 28U);
}

TEST(Recordings, ARecordingSurvivesOurWriter) {
  NEEDS_RECORDINGS();
  const Log log =
      read_log((recordings / "wpilog/frc6998_coralwrist_FRC_20250202_053557.wpilog").string())
          .value();
  const Log back = parse_wpilog(to_wpilog(log).value(), "copy").value();
  ASSERT_EQ(back.signals.size(), log.signals.size());
  ASSERT_EQ(back.texts.size(), log.texts.size());
  for (const Signal& signal : log.signals) {
    const Signal* same = back.find_signal(signal.name);
    ASSERT_NE(same, nullptr);
    EXPECT_EQ(same->time, signal.time) << signal.name;
    EXPECT_EQ(same->value, signal.value) << signal.name;
  }
}

}  // namespace
}  // namespace flyball::recordings_test
