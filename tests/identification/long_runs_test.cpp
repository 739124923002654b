#include <cmath>
#include <cstddef>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/identification/feedforward_fit.hpp>

#include "identification/long_runs.hpp"
#include "recordings.hpp"

namespace long_runs_test {
namespace {

using namespace flyball::identification;
using flyball::Diagnostic;
using flyball::Random;

constexpr double kS = 0.15;
constexpr double kV = 0.1;
constexpr double kA = 0.02;

/// The four tests of a flywheel, of so many rows each; held voltage, exact motion, noise of 0.3
/// rad/s in the velocity. The ramps end at 10 V.
Recording long_recording(std::size_t rows, double period) {
  Random random(7);
  Recording recording;
  recording.mechanism = flyball::mechanisms::MechanismKind::flywheel;
  const double tau = kA / kV;
  const double a = std::exp(-period / tau);
  for (const TestKind kind : {TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                              TestKind::dynamic_forward, TestKind::dynamic_reverse}) {
    TestRun run;
    run.kind = kind;
    const double sign = is_forward(kind) ? 1.0 : -1.0;
    double position = 0.0;
    double velocity = 0.0;
    for (std::size_t i = 0; i < rows; ++i) {
      const double time = period * static_cast<double>(i);
      const double voltage = is_quasistatic(kind)
                                 ? 10.0 * static_cast<double>(i) / static_cast<double>(rows)
                                 : (time > 0.2 ? 7.0 : 0.0);
      run.time.push_back(time);
      run.voltage.push_back(sign * voltage);
      run.position.push_back(sign * position);
      run.velocity.push_back(sign * velocity + random.normal(0.0, 0.3));
      const double end = std::max(0.0, voltage - kS) / kV;
      position += end * period + (velocity - end) * tau * (1.0 - a);
      velocity = end + (velocity - end) * a;
    }
    recording.runs.push_back(std::move(run));
  }
  return recording;
}

void expect_truth(const FeedforwardFit& fit) {
  for (const auto& [gain, truth, within] :
       {std::tuple{fit.kS, kS, 0.02}, {fit.kV, kV, 0.002}, {fit.kA, kA, 0.02}}) {
    EXPECT_TRUE(gain.determined);
    EXPECT_NEAR(gain.value, truth, within * truth);
    EXPECT_LE(gain.interval[0], truth);
    EXPECT_GE(gain.interval[1], truth);
  }
}

TEST(LongRuns, AreFittedOnStretchesSpreadOverEach) {
  const Recording recording = long_recording(40'000, 5e-3);
  const FitReport report = identify_feedforward(recording);
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  const Diagnostic* told = recordings::find(report.diagnostics, "part_of_the_log");
  ASSERT_NE(told, nullptr);
  EXPECT_EQ(recordings::find(report.diagnostics, "rows_put_together"), nullptr);
  // A position and a velocity of each row at most, and the rows that the ramps' differences skip.
  EXPECT_LE(report.fit->residuals, 2 * most_fitted_rows);
  EXPECT_GE(report.fit->residuals, most_fitted_rows);
  expect_truth(*report.fit);
  // One entry for each run again, from its first stretch to its last.
  ASSERT_EQ(report.fit->runs.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const FittedRun& run = report.fit->runs[i];
    EXPECT_EQ(run.source, i);
    EXPECT_TRUE(run.used);
    EXPECT_GT(run.time.back() - run.time.front(), 180.0);
    EXPECT_EQ(run.velocity_hat.size(), run.time.size());
    ASSERT_FALSE(run.fresh.empty());
    EXPECT_EQ(run.fresh.back(), run.time.size() - 1);
  }
  EXPECT_EQ(recordings::find(report.diagnostics, "repeats_disagree"), nullptr);
}

TEST(LongRuns, OfFastRowsAreFittedAtCoarserOnes) {
  const Recording recording = long_recording(50'000, 1e-4);
  const FitReport report = identify_feedforward(recording);
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  EXPECT_NE(recordings::find(report.diagnostics, "rows_put_together"), nullptr);
  EXPECT_EQ(recordings::find(report.diagnostics, "part_of_the_log"), nullptr);
  EXPECT_NEAR(report.prepared.row_period, 2.5e-3, 1e-6);
  EXPECT_EQ(report.prepared.runs.front().run.time.size(), 2'000U);
  expect_truth(*report.fit);
}

// The mean voltage over a row's time moves the mechanism as the voltages themselves do; the mean
// velocity about a row is that at the row where the velocity rises evenly.
TEST(LongRuns, RowsArePutTogetherByTheirMeans) {
  Recording recording;
  TestRun run;
  for (std::size_t i = 0; i < 40'000; ++i) {
    const auto at = static_cast<double>(i);
    run.time.push_back(1e-3 * at);
    run.voltage.push_back(at);
    run.velocity.push_back(2.0 * at);
  }
  run.from = 0.5;
  recording.runs = {run};
  std::vector<Diagnostic> told;
  const auto coarse = at_coarser_rows(recording, told);
  ASSERT_TRUE(coarse);
  const TestRun& rows = coarse->runs.front();
  ASSERT_EQ(rows.time.size(), 20'000U);
  EXPECT_EQ(rows.time[10], 1e-3 * 20.0);
  EXPECT_EQ(rows.voltage[10], 20.5);
  EXPECT_EQ(rows.velocity[10], 40.0);
  EXPECT_TRUE(rows.position.empty());
  EXPECT_EQ(rows.from, 0.5);
  EXPECT_EQ(told.size(), 1U);

  // Rows that go back in time stay as they are: what is wrong with them is told of them.
  recording.runs.front().time[100] = 0.0;
  EXPECT_FALSE(at_coarser_rows(recording, told));
}

TEST(LongRuns, ShortRunsStayWholeBesideLongOnes) {
  Recording recording = long_recording(40'000, 5e-3);
  for (std::vector<double> TestRun::* column :
       {&TestRun::time, &TestRun::voltage, &TestRun::position, &TestRun::velocity}) {
    (recording.runs[2].*column).resize(1'000);
  }
  std::vector<Diagnostic> told;
  const auto prepared = prepare(recording).value();
  const auto part = representative_part(prepared, told);
  ASSERT_TRUE(part);
  ASSERT_EQ(part->runs.size(), 3U * 8U + 1U);
  std::size_t rows = 0;
  for (const PreparedRun& run : part->runs) {
    rows += run.last - run.first;
    EXPECT_EQ(run.smoothed_velocity.size(), run.run.time.size());
    for (const std::size_t row : run.fresh_position) {
      EXPECT_LT(row, run.run.time.size());
    }
  }
  EXPECT_LE(rows, most_fitted_rows);
  EXPECT_GT(rows, most_fitted_rows - 100);
  EXPECT_EQ(part->runs[16].source, 2U);
  EXPECT_EQ(part->runs[16].last - part->runs[16].first,
            prepared.runs[2].last - prepared.runs[2].first);
  // The step sets off from rest in its first stretch alone, and each goes on where it was.
  EXPECT_TRUE(part->runs[17].starts_at_rest);
  EXPECT_FALSE(part->runs[18].starts_at_rest);
  EXPECT_EQ(part->runs[24].run.time[part->runs[24].last - 1],
            prepared.runs[3].run.time[prepared.runs[3].last - 1]);
  EXPECT_FALSE(representative_part(*part, told));
}

TEST(LongRuns, OrdinaryRecordingsStayWhole) {
  const FitReport report = identify_feedforward(recordings::record(recordings::flywheel));
  EXPECT_EQ(recordings::find(report.diagnostics, "part_of_the_log"), nullptr);
  EXPECT_EQ(recordings::find(report.diagnostics, "rows_put_together"), nullptr);
}

// A year of short tests: some of each kind, not the first rows of all.
TEST(LongRuns, OfVeryManyTestsSomeAreFitted) {
  const Recording one = long_recording(120, 0.01);
  Recording many;
  many.mechanism = one.mechanism;
  for (int k = 0; k < 150; ++k) {
    for (const TestRun& run : one.runs) {
      many.runs.push_back(run);
    }
  }
  const FitReport report = identify_feedforward(many);
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  EXPECT_EQ(report.fit->runs.size(), many.runs.size());
  const auto used = std::count_if(report.fit->runs.begin(), report.fit->runs.end(),
                                  [](const FittedRun& run) { return run.used; });
  EXPECT_EQ(used, 32);
  EXPECT_NEAR(report.fit->kV.value, kV, 0.02 * kV);
  const Diagnostic* told = recordings::find(report.diagnostics, "part_of_the_log");
  ASSERT_NE(told, nullptr);
  EXPECT_NE(told->message.find("32 of 600 tests"), std::string::npos) << told->message;
}

}  // namespace
}  // namespace long_runs_test
