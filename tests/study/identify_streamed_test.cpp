#include <flyball/study/identify_streamed.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/identification/streamed_one_step.hpp>
#include <flyball/io/wpilog.hpp>
#include <flyball/recording/stream_recording.hpp>
#include <flyball/study/answer.hpp>

#include "session_file.hpp"

namespace flyball::study::identify_streamed_test {
namespace {

namespace fs = std::filesystem;
using identification::FeedforwardFit;
using identification::GainEstimate;
using identification::TestKind;
using identification::TestRun;

CharacterizationOptions session(mechanisms::MechanismKind kind, std::uint64_t seed) {
  CharacterizationOptions options;
  options.mechanism = kind;
  options.kS = 0.3;
  options.kV = 2.0;
  options.kA = 0.25;
  options.kG = kind == mechanisms::MechanismKind::flywheel ? 0.0 : 0.6;
  options.resolution = 1e-4;
  options.sensor_delay = 0.01;
  options.seed = seed;
  return options;
}

/// The tests of so many sessions, one after the other on one clock.
std::vector<TestRun> tests_of(mechanisms::MechanismKind kind, std::uint64_t sessions) {
  std::vector<TestRun> runs;
  double begin = 10.0;
  for (std::uint64_t seed = 1; seed <= sessions; ++seed) {
    const auto recording = record_characterization(session(kind, seed));
    EXPECT_TRUE(recording);
    for (TestRun run : recording->runs) {
      const double first = run.time.front();
      for (double& time : run.time) {
        time = std::round((begin + time - first) * 1e6) * 1e-6;
      }
      begin = run.time.back() + 3.0;
      runs.push_back(std::move(run));
    }
  }
  return runs;
}

class TemporaryLog {
 public:
  TemporaryLog(const std::string& name, const std::string& bytes)
      : path_((fs::temp_directory_path() / ("flyball_streamed_" + name)).string()) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~TemporaryLog() { fs::remove(path_); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A table; between tests, nothing is driven and nothing moves.
std::string csv_of(const std::vector<TestRun>& runs, const std::string& unit, bool named) {
  std::string table = fmt::format("Timestamp,{}voltage (V),position ({}),velocity ({}/s)\n",
                                  named ? "state," : "", unit, unit);
  for (const TestRun& run : runs) {
    for (std::size_t i = 0; i < run.time.size(); ++i) {
      table += fmt::format("{},{}{},{},{}\n", run.time[i],
                           named ? std::string(to_string(run.kind)) + "," : "", run.voltage[i],
                           run.position[i], run.velocity[i]);
    }
    for (int i = 1; i <= 50; ++i) {
      table += fmt::format("{},{}0,{},0\n", run.time.back() + 0.02 * i, named ? "none," : "",
                           run.position.back());
    }
  }
  return table;
}

std::string wpilog_of(const std::vector<TestRun>& runs, const std::string& name) {
  WpilogWriter writer;
  const auto state = writer.start("sysid-test-state-" + name, "string");
  const auto voltage = writer.start("voltage-" + name, "double", "Volt");
  const auto velocity = writer.start("velocity-" + name, "double", "Meter per Second");
  const auto position = writer.start("position-" + name, "double", "Meter");
  const auto other = writer.start("battery voltage", "double", "Volt");
  for (const TestRun& run : runs) {
    for (std::size_t i = 0; i < run.time.size(); ++i) {
      const double t = run.time[i];
      writer.append(velocity, t, run.velocity[i]);
      writer.append(position, t, run.position[i]);
      writer.append(voltage, t + 2e-5, run.voltage[i]);
      writer.append(other, t, 12.5);
      if (i == 0) {
        writer.append(state, t, to_string(run.kind));
      }
    }
    writer.append(state, run.time.back() + 0.01, "none");
  }
  return writer.bytes();
}

const Diagnostic* found(const IdentifyResult& result, std::string_view code) {
  const auto& all = result.report.diagnostics;
  const auto at =
      std::find_if(all.begin(), all.end(), [&](const Diagnostic& one) { return one.code == code; });
  return at == all.end() ? nullptr : &*at;
}

void expect_near(const GainEstimate& gain, double truth, double within) {
  EXPECT_TRUE(gain.determined);
  EXPECT_NEAR(gain.value, truth, within * truth);
}

void expect_truth(const FeedforwardFit& fit) {
  expect_near(fit.kS, 0.3, 0.05);
  expect_near(fit.kV, 2.0, 0.01);
  expect_near(fit.kA, 0.25, 0.05);
}

// What fits into a fit whole is what a log in memory gives, to the last digit.
TEST(IdentifyStreamed, AShortLogIsFittedAsInMemory) {
  using mechanisms::MechanismKind;
  for (const MechanismKind kind : {MechanismKind::elevator, MechanismKind::flywheel}) {
    const bool elevator = kind == MechanismKind::elevator;
    const std::vector<TestRun> runs = tests_of(kind, 1);
    const TemporaryLog log("short.csv", csv_of(runs, elevator ? "m" : "rad", true));
    IdentifyJob job{.log = log.path(), .selection = {}};
    job.selection.mechanism = kind;
    const auto whole = identify(job);
    const auto streamed = identify_streamed(job);
    ASSERT_TRUE(whole && whole->report.fit) << to_string(whole.error());
    ASSERT_TRUE(streamed && *streamed);
    ASSERT_TRUE((*streamed)->report.fit) << to_string((*streamed)->report.fit.error());
    const FeedforwardFit& a = *whole->report.fit;
    const FeedforwardFit& b = *(*streamed)->report.fit;
    EXPECT_EQ(a.kS.value, b.kS.value);
    EXPECT_EQ(a.kV.value, b.kV.value);
    EXPECT_EQ(a.kA.value, b.kA.value);
    EXPECT_EQ(a.kV.interval, b.kV.interval);
    EXPECT_EQ((*streamed)->report.prepared.runs.size(), 4U);
    ASSERT_NE(found(**streamed, "read_in_passes"), nullptr);
    // The regression over all rows is that of the rows at hand.
    const double slowest = 0.04 * (*streamed)->report.prepared.top_speed;
    identification::StreamedOneStep rows(kind);
    for (const TestRun& run : runs) {
      for (std::size_t i = 0; i + 1 < run.time.size(); ++i) {
        if (std::abs(run.velocity[i]) > slowest) {
          rows.add(run.velocity[i], run.voltage[i], 0.0, run.velocity[i + 1]);
        }
      }
    }
    const auto expected = rows.fit(b.one_step->period);
    ASSERT_TRUE(expected);
    EXPECT_NEAR(b.one_step->kV, expected->kV, 1e-9);
    EXPECT_NEAR(b.one_step->kS, expected->kS, 1e-9);
    EXPECT_NEAR(b.one_step->kA, expected->kA, 1e-9);
    EXPECT_NEAR(b.one_step->kG, expected->kG, 1e-9);
    EXPECT_NE(
        found(**streamed, "read_in_passes")->message.find(fmt::format("all {} rows", rows.rows())),
        std::string::npos);
  }
}

// Of many tests a few of each kind are fitted, and all rows regressed.
TEST(IdentifyStreamed, OfManyTestsAFewAreFitted) {
  const auto runs = tests_of(mechanisms::MechanismKind::elevator, 40);
  std::size_t rows = 0;
  for (const TestRun& run : runs) {
    rows += run.time.size() + 50;
  }
  for (const bool named : {true, false}) {
    const TemporaryLog log("many.csv", csv_of(runs, "m", named));
    IdentifyJob job{.log = log.path(), .selection = {}};
    job.selection.mechanism = mechanisms::MechanismKind::elevator;
    const auto streamed = identify_streamed(job);
    ASSERT_TRUE(streamed && *streamed);
    ASSERT_TRUE((*streamed)->report.fit) << to_string((*streamed)->report.fit.error());
    expect_truth(*(*streamed)->report.fit);
    const Diagnostic* told = found(**streamed, "read_in_passes");
    ASSERT_NE(told, nullptr);
    EXPECT_NE(told->message.find(fmt::format("{} rows", rows)), std::string::npos) << told->message;
    EXPECT_NE(told->message.find(named ? "of 160 tests" : " tests"), std::string::npos)
        << told->message;
    EXPECT_NEAR((*streamed)->report.fit->one_step->kV, 2.0, 0.1);
    std::array<int, 4> kinds{};
    for (const auto& run : (*streamed)->source.recording.runs) {
      ++kinds[static_cast<std::size_t>(run.kind)];
      EXPECT_FALSE(run.is_trimmed());
    }
    EXPECT_GE(*std::min_element(kinds.begin(), kinds.end()), 1) << named;
    EXPECT_LE(*std::max_element(kinds.begin(), kinds.end()), named ? 8 : 16);
  }
}

TEST(IdentifyStreamed, AWpilogsChannelsHaveTheirOwnTimes) {
  const auto runs = tests_of(mechanisms::MechanismKind::elevator, 12);
  const TemporaryLog log("many.wpilog", wpilog_of(runs, "Elevator"));
  const auto streamed = identify_streamed({.log = log.path(), .selection = {}});
  ASSERT_TRUE(streamed && *streamed);
  ASSERT_TRUE((*streamed)->report.fit) << to_string((*streamed)->report.fit.error());
  expect_truth(*(*streamed)->report.fit);
  EXPECT_NEAR((*streamed)->report.fit->kG->value, 0.6, 0.03);
  EXPECT_NEAR((*streamed)->report.fit->one_step->kV, 2.0, 0.1);
  EXPECT_NEAR((*streamed)->report.fit->one_step->kG, 0.6, 0.1);
}

/// The four tests of a flywheel of so many rows each: held voltage, exact motion, a noisy velocity.
std::string long_json(std::size_t rows, double period) {
  Random random(7);
  constexpr double turn = 2.0 * std::numbers::pi;
  std::string text =
      R"({"sysid": true, "test": "Simple", "units": "Radians", "unitsPerRotation": )" +
      fmt::format("{}", turn);
  const double kS = 0.3;
  const double kV = 2.0;
  const double kA = 0.25;
  const double a = std::exp(-period * kV / kA);
  for (const TestKind kind : {TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                              TestKind::dynamic_forward, TestKind::dynamic_reverse}) {
    const double sign = is_forward(kind) ? 1.0 : -1.0;
    text += fmt::format(", \"{}\": [", sysid_name(kind));
    double position = 0.0;
    double velocity = 0.0;
    for (std::size_t i = 0; i < rows; ++i) {
      const double time = period * static_cast<double>(i);
      const double voltage = is_quasistatic(kind)
                                 ? 10.0 * static_cast<double>(i) / static_cast<double>(rows)
                                 : (time > 0.2 ? 7.0 : 0.0);
      text +=
          fmt::format("{}[{:.6f},{:.6f},{:.8f},{:.8f}]", i == 0 ? "" : ",", time, sign * voltage,
                      sign * position / turn, (sign * velocity + random.normal(0.0, 0.003)) / turn);
      const double end = std::max(0.0, voltage - kS) / kV;
      position += end * period + (velocity - end) * kA / kV * (1.0 - a);
      velocity = end + (velocity - end) * a;
    }
    text += "]";
  }
  return text + "}";
}

// A ramp of minutes is fitted in stretches, which set off in motion; rows of 0.2 ms are put
// together.
TEST(IdentifyStreamed, OfALongTestStretchesAreFitted) {
  for (const auto& [rows, period] : {std::pair{20'000UL, 0.01}, {60'000UL, 0.0002}}) {
    const TemporaryLog log("long.json", long_json(rows, period));
    const auto streamed = identify_streamed({.log = log.path(), .selection = {}});
    ASSERT_TRUE(streamed && *streamed);
    ASSERT_TRUE((*streamed)->report.fit) << to_string((*streamed)->report.fit.error());
    expect_truth(*(*streamed)->report.fit);
    const bool stretches =
        found(**streamed, "read_in_passes")->message.find("in stretches") != std::string::npos;
    EXPECT_EQ(stretches, period == 0.01);
    std::size_t kept = 0;
    for (const auto& run : (*streamed)->source.recording.runs) {
      kept += run.time.size();
    }
    EXPECT_LE(kept, 30'000U);
    EXPECT_NEAR((*streamed)->report.fit->one_step->kV, 2.0, 0.02);
  }
}

// Memory does not hang on how long a log is: of ten times the rows no more are held.
TEST(IdentifyStreamed, WhatIsHeldDoesNotGrow) {
  std::size_t held[2] = {0, 0};
  for (const std::size_t times : {1U, 10U}) {
    const TemporaryLog log("grows.json", long_json(8'000 * times, 0.01));
    const auto bounded = recording::read_bounded_log(log.path());
    ASSERT_TRUE(bounded && *bounded);
    EXPECT_EQ((*bounded)->samples, 32'000 * times);
    for (const SysIdJson::Run& run : (*bounded)->log.sysid->runs) {
      held[times == 1 ? 0 : 1] += run.time.size();
      EXPECT_EQ(run.time.size(), run.velocity.size());
    }
  }
  EXPECT_EQ(held[0], held[1]);
  EXPECT_EQ(held[0], 4U * 8U * 200U);
}

TEST(IdentifyStreamed, ADrivetrainIsReadWhole) {
  const TemporaryLog log(
      "drive.json",
      R"({"sysid":true,"test":"Drivetrain","slow-forward":[[0,1,1,0,0,0,0,0,0],[1,1,1,0,0,0,0,0,0]]})");
  const auto streamed = identify_streamed({.log = log.path(), .selection = {}});
  ASSERT_TRUE(streamed);
  EXPECT_FALSE(*streamed);
  IdentifyJob job{.log = log.path(), .selection = {}};
  job.selection.runs = {"1:0.5.."};
  EXPECT_FALSE(*identify_streamed(job));
}

}  // namespace
}  // namespace flyball::study::identify_streamed_test
