#include <flyball/io/sysid_json.hpp>

#include <string>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/core/argument.hpp>
#include <flyball/io/log_error.hpp>

#include "io/examples.hpp"
#include "io/temporary_folder.hpp"

namespace flyball::sysid_json_test {
namespace {

using Layout = SysIdJson::Layout;

Expected<SysIdJson> parse(const std::string& text) {
  return parse_sysid_json(text, "log.json");
}

TEST(SysIdJson, ReadsFourColumns) {
  const Expected<SysIdJson> log = parse(R"({
    "slow-forward": [[0.5, 1, 2.5, 3], [0.505, 1.25, 2.75, 3.5]],
    "slow-backward": [[1, -1, 0, 0]], "fast-forward": [[2, 7, 0, 0]], "fast-backward": [[3, -7, 0, 0]],
    "sysid": true, "test": "Arm", "units": "Degrees", "unitsPerRotation": 360})");
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(log->layout, Layout::mechanism);
  EXPECT_FALSE(log->is_drive());
  EXPECT_EQ(log->test, "Arm");
  EXPECT_EQ(log->units, "Degrees");
  EXPECT_EQ(log->units_per_rotation, 360.0);
  EXPECT_TRUE(log->missing.empty());
  EXPECT_TRUE(log->diagnostics.empty());
  const SysIdJson::Run* run = log->find("slow-forward");
  ASSERT_NE(run, nullptr);
  EXPECT_TRUE(run->quasistatic());
  EXPECT_TRUE(run->forward());
  EXPECT_FALSE(log->find("fast-backward")->quasistatic());
  EXPECT_FALSE(log->find("fast-backward")->forward());
  EXPECT_EQ(run->time, (std::vector<double>{0.5, 0.505}));
  EXPECT_EQ(run->voltage, (std::vector<double>{1, 1.25}));
  EXPECT_EQ(run->position, (std::vector<double>{2.5, 2.75}));
  EXPECT_EQ(run->velocity, (std::vector<double>{3, 3.5}));
}

TEST(SysIdJson, TellsTheFourLayoutsApart) {
  const std::string nine = R"({"slow-forward": [[0, 1, 2, 3, 4, 5, 6, 7, 8]])";
  const Expected<SysIdJson> drive = parse(nine + R"(, "sysid": true, "test": "Drivetrain"})");
  ASSERT_TRUE(drive) << to_string(drive.error());
  EXPECT_EQ(drive->layout, Layout::drive);
  EXPECT_EQ(drive->runs[0].voltage[0], 1);
  EXPECT_EQ(drive->runs[0].right_voltage[0], 2);
  EXPECT_EQ(drive->runs[0].position[0], 3);
  EXPECT_EQ(drive->runs[0].right_velocity[0], 6);
  EXPECT_EQ(drive->runs[0].angle[0], 7);
  EXPECT_EQ(drive->runs[0].angle_rate[0], 8);

  const Expected<SysIdJson> older = parse(nine + "}");
  EXPECT_EQ(older->layout, Layout::characterization_2019);
  EXPECT_EQ(older->runs[0].voltage[0], 3);
  EXPECT_EQ(older->runs[0].right_velocity[0], 8);
  EXPECT_TRUE(older->runs[0].angle.empty());
  EXPECT_EQ(older->missing,
            (std::vector<std::string>{"slow-backward", "fast-forward", "fast-backward", "test",
                                      "units", "unitsPerRotation"}));
  EXPECT_TRUE(has_diagnostic(older->diagnostics, "frc_characterization"));

  const Expected<SysIdJson> ten = parse(R"({"slow-forward": [[0, 12, 0, 3, 4, 5, 6, 7, 8, 9]]})");
  EXPECT_EQ(ten->layout, Layout::characterization_2020);
  EXPECT_EQ(ten->runs[0].angle[0], 9);
  EXPECT_TRUE(ten->is_drive());

  // Cut before its `test` and `units`: SysId's keys are sorted, its forerunner's were not.
  EXPECT_EQ(parse(R"({"fast-backward": [[0, 1, 2, 3, 4, 5, 6, 7, 8], [)")->layout, Layout::drive);
  EXPECT_EQ(parse(R"({"slow-forward": [[0, 1, 2, 3, 4, 5, 6, 7, 8], [)")->layout,
            Layout::characterization_2019);
}

TEST(SysIdJson, NamesWhatIsMissing) {
  const Expected<SysIdJson> log =
      parse(R"({"slow-forward": [[0, 1, 2, 3]], "fast-forward": [], "sysid": true})");
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(log->missing, (std::vector<std::string>{"slow-backward", "fast-backward", "test",
                                                    "units", "unitsPerRotation"}));
  EXPECT_EQ(log->runs.size(), 1U);
  EXPECT_FALSE(log->units_per_rotation.has_value());
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "missing_run"));
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "missing_key"));
}

TEST(SysIdJson, DropsRowsThatAreNotNumbers) {
  const Expected<SysIdJson> log = parse(
      R"({"slow-forward": [[0, 1, 2, 3], [1, null, 2, 3], [2, NaN, 2, 3], [3, -Infinity, 2, 3],
          [4, "NaN", 2, 3], [5, 1, 2, 3], [6, 1, 2], [7, 1, {"a": [1]}, 3], 8, [9, 1, 2, 3, 4]],
          "test": "NaN \" NaN", "units": "Meters", "unitsPerRotation": 1.0, "sysid": true})");
  ASSERT_TRUE(log) << to_string(log.error());
  EXPECT_EQ(log->find("slow-forward")->time, (std::vector<double>{0, 5}));
  EXPECT_EQ(log->test, "NaN \" NaN");
  ASSERT_TRUE(has_diagnostic(log->diagnostics, "non_finite_rows"));
  ASSERT_TRUE(has_diagnostic(log->diagnostics, "malformed_rows"));
  for (const Diagnostic& diagnostic : log->diagnostics) {
    if (diagnostic.code == "non_finite_rows" || diagnostic.code == "malformed_rows") {
      EXPECT_TRUE(diagnostic.message.starts_with("4 rows")) << diagnostic.message;
    }
  }
}

TEST(SysIdJson, ALogOfNothingButNanIsRefusedWithTheReason) {
  const Expected<SysIdJson> log = parse(R"({"slow-forward": [[0, NaN, 2, 3]], "sysid": true})");
  ASSERT_FALSE(log);
  EXPECT_TRUE(log.error().is(LogError::no_data));
  EXPECT_TRUE(contains(to_string(log.error()), "1 row with null, NaN or infinity"))
      << to_string(log.error());
}

TEST(SysIdJson, NumbersBeyondDoubleAreBroken) {
  const Expected<SysIdJson> log = parse("{\"slow-forward\": [[0, 1, 2,\n 1e999]]}");
  ASSERT_FALSE(log);
  EXPECT_TRUE(log.error().is(LogError::malformed));
  EXPECT_TRUE(contains(to_string(log.error()), "log.json:2:"));
}

TEST(SysIdJson, SortsByTime) {
  const Expected<SysIdJson> log =
      parse(R"({"slow-forward": [[2, 1, 0, 0], [1, 2, 0, 0], [3, 3, 0, 0]], "sysid": true})");
  ASSERT_TRUE(log);
  EXPECT_EQ(log->runs[0].time, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(log->runs[0].voltage, (std::vector<double>{2, 1, 3}));
  EXPECT_TRUE(has_diagnostic(log->diagnostics, "unsorted_time"));
}

TEST(SysIdJson, ACutAnywhereGivesTheRowsBeforeIt) {
  const std::string text = to_sysid_json(example_sysid(4)).value();
  const SysIdJson whole = parse(text).value();
  std::size_t last = 0;
  const std::size_t end = text.rfind('}');
  for (std::size_t cut = 1; cut <= end; ++cut) {
    const Expected<SysIdJson> log = parse(text.substr(0, cut));
    std::size_t rows = 0;
    if (log) {
      EXPECT_TRUE(has_diagnostic(log->diagnostics, "truncated_log")) << cut;
      for (const SysIdJson::Run& run : log->runs) {
        const SysIdJson::Run* same = whole.find(run.name);
        ASSERT_NE(same, nullptr);
        EXPECT_TRUE(std::equal(run.velocity.begin(), run.velocity.end(), same->velocity.begin()));
        rows += run.time.size();
      }
    } else {
      EXPECT_TRUE(log.error().is(LogError::no_data)) << cut << ": " << to_string(log.error());
    }
    EXPECT_GE(rows, last);
    last = rows;
  }
  EXPECT_EQ(last, 16U);
  // A file that was allocated and never filled.
  EXPECT_TRUE(has_diagnostic(parse(text.substr(0, end) + std::string(99, '\0'))->diagnostics,
                             "truncated_log"));
}

// Zeros at the end are a tail that was never filled; what stands behind one is not passed over.
TEST(SysIdJson, NothingIsBehindAZeroByte) {
  const std::string text = to_sysid_json(example_sysid(2)).value();
  for (const std::string& more : {std::string("garbage after"), text, std::string("\0x", 2)}) {
    const auto log = parse(text + '\0' + more);
    ASSERT_FALSE(log) << more;
    EXPECT_TRUE(log.error().is(LogError::malformed));
    EXPECT_TRUE(contains(to_string(log.error()), "zero byte")) << to_string(log.error());
  }
  const auto padded = parse(text + std::string(5, '\0'));
  ASSERT_TRUE(padded) << to_string(padded.error());
  EXPECT_TRUE(has_diagnostic(padded->diagnostics, "unfilled_tail"));
}

TEST(SysIdJson, RubbishAfterTheEndIsNotATruncation) {
  const std::string text = to_sysid_json(example_sysid(2)).value();
  EXPECT_TRUE(parse(text + "}").error().is(LogError::malformed));
}

TEST(SysIdJson, DeepNestingIsHarmless) {
  const std::string deep(1'000'000, '[');
  EXPECT_FALSE(parse(deep));
  EXPECT_FALSE(parse("{\"slow-forward\": " + deep));
}

SysIdJson random_log() {
  SysIdJson log;
  log.layout = *rc::gen::element(Layout::mechanism, Layout::drive, Layout::characterization_2019,
                                 Layout::characterization_2020);
  if (log.layout == Layout::mechanism || log.layout == Layout::drive) {
    log.test = *rc::gen::element<std::string>("Elevator", "Arm \"ü\"\n", "Simple");
    log.units = "Meters";
    log.units_per_rotation = *rc::gen::positive<double>();
  }
  const auto finite = rc::gen::suchThat(rc::gen::arbitrary<double>(),
                                        [](double value) { return std::isfinite(value); });
  for (const char* name : {"slow-forward", "slow-backward", "fast-forward", "fast-backward"}) {
    const auto rows = *rc::gen::inRange<std::size_t>(1, 6);
    const auto column = [&] { return *rc::gen::container<std::vector<double>>(rows, finite); };
    SysIdJson::Run run;
    run.name = name;
    run.time = column();
    std::sort(run.time.begin(), run.time.end());
    run.voltage = column();
    run.position = column();
    run.velocity = column();
    if (log.is_drive()) {
      run.right_voltage = column();
      run.right_position = column();
      run.right_velocity = column();
      run.angle = log.layout == Layout::characterization_2019 ? run.angle : column();
      run.angle_rate = log.layout == Layout::drive ? column() : run.angle_rate;
    }
    log.runs.push_back(run);
  }
  return log;
}

TEST(SysIdJson, ReadsBackWhatItWrites) {
  const bool ok = rc::check("read(write(log)) == log, to the last bit", [] {
    const SysIdJson log = random_log();
    const Expected<std::string> text = to_sysid_json(log);
    RC_ASSERT(text.has_value());
    const Expected<SysIdJson> back = parse(*text);
    RC_ASSERT(back.has_value());
    RC_ASSERT(back->layout == log.layout);
    RC_ASSERT(back->test == log.test);
    RC_ASSERT(back->units == log.units);
    RC_ASSERT(back->units_per_rotation == log.units_per_rotation);
    RC_ASSERT(back->runs.size() == log.runs.size());
    for (std::size_t i = 0; i < log.runs.size(); ++i) {
      RC_ASSERT(back->runs[i].name == log.runs[i].name);
      RC_ASSERT(back->runs[i].time == log.runs[i].time);
      RC_ASSERT(back->runs[i].voltage == log.runs[i].voltage);
      RC_ASSERT(back->runs[i].position == log.runs[i].position);
      RC_ASSERT(back->runs[i].velocity == log.runs[i].velocity);
      RC_ASSERT(back->runs[i].right_voltage == log.runs[i].right_voltage);
      RC_ASSERT(back->runs[i].right_position == log.runs[i].right_position);
      RC_ASSERT(back->runs[i].right_velocity == log.runs[i].right_velocity);
      RC_ASSERT(back->runs[i].angle == log.runs[i].angle);
      RC_ASSERT(back->runs[i].angle_rate == log.runs[i].angle_rate);
    }
  });
  EXPECT_TRUE(ok);
}

TEST(SysIdJson, WriterRefusesWhatCannotBeRead) {
  SysIdJson uneven = example_sysid(3);
  uneven.runs[1].velocity.pop_back();
  EXPECT_TRUE(to_sysid_json(uneven).error().is(ArgumentError::wrong_shape));
  SysIdJson infinite = example_sysid(3);
  infinite.runs[1].velocity[1] = std::nan("");
  EXPECT_TRUE(to_sysid_json(infinite).error().is(ArgumentError::not_finite));
  infinite = example_sysid(3);
  infinite.units_per_rotation = std::nan("");
  EXPECT_TRUE(to_sysid_json(infinite).error().is(ArgumentError::not_finite));
}

TEST(SysIdJson, WritesAFile) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_sysid_json(folder.file("log.json"), example_sysid(3, true)));
  EXPECT_EQ(folder.get("log.json"), to_sysid_json(example_sysid(3, true)).value());
  EXPECT_EQ(folder.names(), std::set<std::string>{"log.json"});
}

}  // namespace
}  // namespace flyball::sysid_json_test
