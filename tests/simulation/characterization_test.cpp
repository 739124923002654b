#include <flyball/simulation/characterization.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace characterization_test {
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

// Rows come each 5 ms: a sensor that is 10 ms late shows the position of two rows before, one that
// averages 40 ms the way from eight rows before.
TEST(RecordCharacterization, SensorsAreLateAndAverage) {
  CharacterizationOptions options = perfect();
  const TestRun truth = record_characterization(options)->runs[2];
  options.sensor_delay = 10e-3;
  options.velocity_window = 40e-3;
  const TestRun late = record_characterization(options)->runs[2];
  ASSERT_EQ(late.time, truth.time);
  for (std::size_t row = 10; row < truth.time.size(); ++row) {
    ASSERT_NEAR(late.position[row], truth.position[row - 2], 1e-9) << row;
    ASSERT_NEAR(late.velocity[row], (truth.position[row - 2] - truth.position[row - 10]) / 40e-3,
                1e-6)
        << row;
  }
  options = perfect();
  options.resolution = 0.25;
  const TestRun coarse = record_characterization(options)->runs[3];
  const TestRun reverse = record_characterization(perfect())->runs[3];
  for (std::size_t row = 0; row < truth.time.size(); ++row) {
    ASSERT_EQ(coarse.position[row], 0.25 * std::floor(reverse.position[row] / 0.25)) << row;
  }
}

// Held for 50 ms, 6 V for 0.5 s, then none: the last row is 0.1 s after the cut.
TEST(RecordCharacterization, RestsAndCoasts) {
  CharacterizationOptions options = perfect();
  options.rest_before = 0.05;
  options.coast_after = 0.1;
  options.step_duration = 0.5;
  const TestRun run = record_characterization(options)->runs[3];
  for (std::size_t row = 0; row < run.time.size(); ++row) {
    const double time = run.time[row];
    const bool driven = time > 0.05 - 1e-9 && time < 0.55 + 1e-9;
    EXPECT_EQ(run.voltage[row], driven ? -6.0 : 0.0) << time;
    EXPECT_EQ(run.position[row] != 0.0, time > 0.05 + 1e-9) << time;
  }
  EXPECT_NEAR(run.time.back(), 0.655, 1e-9);
  // v∞ = −5.5/0.12 of which 1 − e^(−0.5/τ) is reached.
  const std::size_t cut = 110;
  EXPECT_NEAR(run.velocity[cut], -5.5 / 0.12 * (1.0 - std::exp(-0.5 * 0.12 / 0.05)), 0.02);
}

TEST(RecordCharacterization, NoiseAndJitterHaveTheirDeviations) {
  CharacterizationOptions options = perfect();
  options.row_jitter = 1e-3;
  options.voltage_noise = 0.03;
  options.velocity_noise.reset();  // 0.5 % of the speed of the step
  options.noise_per_row = true;
  options.step_duration = 60.0;
  const TestRun run = record_characterization(options)->runs[2];
  double time = 0.0;
  double voltage = 0.0;
  double velocity = 0.0;
  const std::size_t first = 2000;  // steady from there on
  for (std::size_t row = first; row < run.time.size(); ++row) {
    ASSERT_GE(run.time[row], run.time[row - 1]);
    time += std::pow(run.time[row] - 5e-3 * static_cast<double>(row), 2);
    voltage += row + 1 < run.time.size() ? std::pow(run.voltage[row] - 6.0, 2) : 0.0;
    velocity += std::pow(run.velocity[row] - 5.5 / 0.12, 2);
  }
  const auto rows = static_cast<double>(run.time.size() - first);
  EXPECT_NEAR(std::sqrt(time / rows), 1e-3, 3e-5);
  EXPECT_NEAR(std::sqrt(voltage / rows), 0.03, 1e-3);
  EXPECT_NEAR(std::sqrt(velocity / rows), 0.005 * 5.5 / 0.12, 5e-3);
}

// Without inertia v = (V − kS(θ))/kV, kS(θ) = 0.5 (1 + 0.6 sin θ) V; from rest it takes 1.4 kS.
TEST(RecordCharacterization, FrictionVariesAndSticks) {
  CharacterizationOptions options = perfect();
  options.kA = 1e-5;
  options.friction_variation = 0.6;
  const TestRun step = record_characterization(options)->runs[2];
  for (std::size_t row = 10; row + 1 < step.time.size(); ++row) {
    const double friction = 0.5 * (1.0 + 0.6 * std::sin(step.position[row]));
    ASSERT_NEAR(step.velocity[row], (6.0 - friction) / 0.12, 0.05) << row;
  }
  options.friction_variation = 0.0;
  options.breakaway = 1.4;
  const TestRun ramp = record_characterization(options)->runs[0];
  for (std::size_t row = 0; row + 1 < ramp.time.size(); ++row) {
    ASSERT_EQ(ramp.position[row] > 0.0, row > 0 && ramp.voltage[row - 1] > 0.7) << row;
  }
}

// An elevator is driven from one end of its travel to the margin before the other.
TEST(RecordCharacterization, EndsBeforeTheEndOfItsTravel) {
  CharacterizationOptions options = perfect();
  options.mechanism = MechanismKind::elevator;
  options.kV = 4.0;
  options.kA = 0.2;
  options.kG = 0.5;
  const auto recording = record_characterization(options);
  ASSERT_TRUE(recording);
  EXPECT_EQ(recording->unit, "m");
  const TestRun& up = recording->runs[2];
  EXPECT_EQ(up.position.front(), -1.0);
  EXPECT_NEAR(up.position.back(), 0.95, 7e-3);  // at most a row later
  EXPECT_GE(up.position.back(), 0.95);
  EXPECT_NEAR(up.velocity.back(), (6.0 - 0.5 - 0.5) / 4.0, 1e-3);
  const TestRun& down = recording->runs[3];
  EXPECT_EQ(down.position.front(), 1.0);
  EXPECT_LE(down.position.back(), -0.95);
  EXPECT_NEAR(down.velocity.back(), -(6.0 + 0.5 - 0.5) / 4.0, 1e-3);
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

// What coasts or falls into a stop stands there.
TEST(RecordCharacterization, StandsAtAStop) {
  CharacterizationOptions options = perfect();
  options.mechanism = MechanismKind::elevator;
  options.kV = 2.0;
  options.kA = 0.4;
  options.kG = 0.8;
  options.kS = 0.1;
  options.travel_margin = 0.01;
  options.coast_after = 0.5;
  const auto recording = record_characterization(options).value();
  const auto run = std::find_if(recording.runs.begin(), recording.runs.end(), [](const TestRun& r) {
    return r.kind == TestKind::dynamic_reverse;
  });
  const auto at_stop = std::find(run->position.begin(), run->position.end(), options.travel_low);
  ASSERT_NE(at_stop, run->position.end());
  for (auto row = at_stop - run->position.begin(); row < std::ssize(run->velocity); ++row) {
    EXPECT_EQ(run->velocity[static_cast<std::size_t>(row)], 0.0);
  }
}

// A duty of V/12 of a battery whose wires are `sag` of the motor's resistance: kV v = V - kS (1 +
// L) at rest from acceleration, L = sag (V/12)².
TEST(RecordCharacterization, ASaggingBatteryLowersTheSpeed) {
  CharacterizationOptions options = perfect();
  options.kA = 0.005;
  options.defects.sag = 0.4;
  const auto recording = record_characterization(options).value();
  const double loss = 0.4 * std::pow(options.step_voltage / 12.0, 2);
  const double speed = (options.step_voltage - options.kS * (1.0 + loss)) / options.kV;
  EXPECT_NEAR(recording.runs[2].velocity.back(), speed, 1e-9 * speed);
  EXPECT_NEAR(recording.runs[3].velocity.back(), -speed, 1e-9 * speed);
}

// The motor, a quarter of the inertia, crosses the gap and meets a load at rest: a quarter of its
// speed is left. After that both go as one.
TEST(RecordCharacterization, BacklashEndsInAnImpact) {
  CharacterizationOptions options = perfect();
  options.kS = 0.0;
  options.kA = 0.02;
  options.row_period = 1e-3;
  options.step_duration = 3.0;
  options.defects.backlash = 0.5;
  const auto recording = record_characterization(options).value();
  const TestRun& run = recording.runs[3];
  double least = 1.0;
  for (std::size_t k = 1; k < run.velocity.size(); ++k) {
    if (run.velocity[k - 1] < -0.5) {
      least = std::min(least, run.velocity[k] / run.velocity[k - 1]);
    }
  }
  EXPECT_NEAR(least, 0.25, 0.04);
  EXPECT_NEAR(run.velocity.back(), -options.step_voltage / options.kV, 1e-4);
  EXPECT_LT(run.position.back(), -100.0);
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
}  // namespace characterization_test
