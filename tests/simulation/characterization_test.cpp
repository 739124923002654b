#include <flyball/simulation/characterization.hpp>

#include <cmath>
#include <limits>

namespace {

using namespace flyball;
using flyball::ArgumentError;
using flyball::identification::Recording;
using flyball::identification::TestKind;
using flyball::identification::TestRun;
using flyball::mechanisms::MechanismKind;

/// Perfect sensors, so that the physics can be read off.
CharacterizationOptions perfect() {
  CharacterizationOptions options;
  options.kS = 0.5;
  options.kV = 0.12;
  options.kA = 0.05;
  options.sensor_refresh = 0.0;
  options.velocity_window = 0.0;
  options.velocity_noise = 0.0;
  options.voltage_noise = 0.0;
  options.rest_before = 0.0;
  options.coast_after = 0.0;
  return options;
}

TEST(RecordCharacterization, MakesTheFourTests) {
  const auto recording = record_characterization({});
  ASSERT_TRUE(recording);
  ASSERT_EQ(recording->runs.size(), 4U);
  EXPECT_EQ(recording->runs[0].kind, TestKind::quasistatic_forward);
  EXPECT_EQ(recording->runs[3].kind, TestKind::dynamic_reverse);
  EXPECT_EQ(recording->unit, "rad");
  for (const TestRun& run : recording->runs) {
    EXPECT_EQ(run.time.size(), run.voltage.size());
    EXPECT_EQ(run.time.size(), run.position.size());
    EXPECT_EQ(run.time.size(), run.velocity.size());
  }
}

// p(t) = (V − kS)/kV (t − τ (1 − e^(−t/τ))), τ = kA/kV
TEST(RecordCharacterization, StepResponseIsExponential) {
  const auto recording = record_characterization(perfect());
  ASSERT_TRUE(recording);
  const TestRun& run = recording->runs[2];
  const double tau = 0.05 / 0.12;
  for (const std::size_t row : {20U, 100U, 300U}) {
    const double time = run.time[row] - run.time[0];
    const double expected = 5.5 / 0.12 * (time - tau * (1.0 - std::exp(-time / tau)));
    EXPECT_NEAR(run.position[row], expected, 1e-9 * expected);
  }
}

// Slow ramp: V = kS + kV v + kA v̇ with v̇ = ramp/kV after the transient.
TEST(RecordCharacterization, RampFollowsTheVoltage) {
  const auto recording = record_characterization(perfect());
  ASSERT_TRUE(recording);
  const TestRun& run = recording->runs[1];
  const std::size_t last = run.time.size() - 2;
  const double slope = -0.25 / 0.12;
  // The voltage is held over a row, so on average half a row old.
  const double voltage = run.voltage[last] + 0.25 * 0.5 * 5e-3;
  EXPECT_NEAR(run.velocity[last], (voltage + 0.5 - 0.05 * slope) / 0.12, 0.02);
}

TEST(RecordCharacterization, StaysAtRestBelowStaticFriction) {
  const auto recording = record_characterization(perfect());
  ASSERT_TRUE(recording);
  const TestRun& run = recording->runs[0];
  for (std::size_t row = 0; row < run.time.size() && run.voltage[row] < 0.5; ++row) {
    EXPECT_EQ(run.position[row], 0.0);
  }
}

TEST(RecordCharacterization, RepeatsRowsBetweenRefreshes) {
  CharacterizationOptions options;
  options.noise_per_row = false;
  const auto recording = record_characterization(options);
  ASSERT_TRUE(recording);
  const TestRun& run = recording->runs[2];
  std::size_t repeats = 0;
  for (std::size_t row = 1; row < run.time.size(); ++row) {
    repeats += run.velocity[row] == run.velocity[row - 1] ? 1U : 0U;
  }
  EXPECT_NEAR(static_cast<double>(repeats) / static_cast<double>(run.time.size()), 0.75, 0.02);
}

TEST(RecordCharacterization, StaysWithinItsTravel) {
  CharacterizationOptions options;
  options.mechanism = MechanismKind::arm;
  options.kV = 1.2;
  options.kA = 0.15;
  options.kG = 0.65;
  options.kS = 0.1;
  options.angle_offset = 0.2;
  const auto recording = record_characterization(options);
  ASSERT_TRUE(recording);
  for (const TestRun& run : recording->runs) {
    for (const double position : run.position) {
      EXPECT_GE(position + 0.2, options.travel_low - 1e-12);
      EXPECT_LE(position + 0.2, options.travel_high + 1e-12);
    }
  }
}

TEST(RecordCharacterization, SameSeedSameRecording) {
  CharacterizationOptions options;
  options.seed = 7;
  const Recording first = record_characterization(options).value();
  const Recording second = record_characterization(options).value();
  EXPECT_EQ(first.runs[1].velocity, second.runs[1].velocity);
  options.seed = 8;
  EXPECT_NE(first.runs[1].velocity, record_characterization(options).value().runs[1].velocity);
}

TEST(RecordCharacterization, RefusesNonsense) {
  const auto refused = [](auto change) {
    CharacterizationOptions options;
    change(options);
    return record_characterization(options);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused([](auto& o) { o.kV = 0.0; }).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(refused([&](auto& o) { o.kG = nan; }).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(refused([](auto& o) { o.kS = -0.1; }).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      refused([](auto& o) { o.row_period = 1e-9; }).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      refused([](auto& o) { o.friction_variation = 1.0; }).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(refused([](auto& o) {
                o.mechanism = MechanismKind::arm;
                o.travel_high = o.travel_low;
              })
                  .error()
                  .is(ArgumentError::not_positive));
}

}  // namespace
