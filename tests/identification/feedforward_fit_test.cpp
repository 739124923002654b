#include <flyball/identification/feedforward_fit.hpp>

#include <cmath>

#include "recordings.hpp"

namespace {

using namespace flyball::identification;
using flyball::mechanisms::MechanismKind;
using recordings::arm;
using recordings::elevator;
using recordings::find;
using recordings::flywheel;
using recordings::record;

void expect_near(const GainEstimate& gain, double truth, double relative) {
  EXPECT_NEAR(gain.value, truth, relative * truth);
  EXPECT_LE(gain.interval[0], gain.value);
  EXPECT_GE(gain.interval[1], gain.value);
  EXPECT_GT(gain.standard_error, 0.0);
}

TEST(FeedforwardFit, RecoversAFlywheel) {
  const auto fit = fit_feedforward(record(flywheel));
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_EQ(fit->mechanism, MechanismKind::flywheel);
  expect_near(fit->kS, 0.5, 0.02);
  expect_near(fit->kV, 0.12, 0.005);
  expect_near(fit->kA, 0.05, 0.02);
  EXPECT_FALSE(fit->kG);
  EXPECT_GT(fit->r_squared, 0.999);
}

TEST(FeedforwardFit, RecoversAnArmWithItsZero) {
  const auto fit = fit_feedforward(record(arm));
  ASSERT_TRUE(fit) << to_string(fit.error());
  expect_near(fit->kV, 1.2, 0.005);
  expect_near(fit->kA, 0.15, 0.02);
  expect_near(*fit->kG, 0.65, 0.01);
  EXPECT_NEAR(fit->angle_offset->value, 0.2, 0.01);
  EXPECT_NEAR(fit->averaging_width, 0.04, 0.015);
}

// The regression that it replaces is off by far more (section 14.2 with repeated rows and noise).
TEST(FeedforwardFit, ReportsTheBiasedRegressionBesideIt) {
  const auto fit = fit_feedforward(record(elevator));
  ASSERT_TRUE(fit) << to_string(fit.error());
  expect_near(fit->kA, 0.3, 0.03);
  ASSERT_TRUE(fit->one_step);
  EXPECT_GT(std::abs(fit->one_step->kA / 0.3 - 1.0), 0.2);
}

TEST(FeedforwardFit, OverlaysSimulationAndMeasurement) {
  const Recording recording = record(elevator);
  const auto fit = fit_feedforward(recording);
  ASSERT_TRUE(fit) << to_string(fit.error());
  ASSERT_EQ(fit->runs.size(), 4U);
  for (const FittedRun& run : fit->runs) {
    ASSERT_TRUE(run.used);
    ASSERT_EQ(run.time.size(), run.velocity_hat.size());
    ASSERT_EQ(run.time.size(), run.position_hat.size());
    for (std::size_t i = 0; i < run.time.size(); ++i) {
      EXPECT_EQ(run.velocity_residual[i], run.velocity[i] - run.velocity_hat[i]);
      EXPECT_NEAR(run.position_hat[i], run.position[i], 0.02);
    }
  }
}

TEST(FeedforwardFit, IsDeterministic) {
  const Recording recording = record(arm, 3);
  EXPECT_EQ(fit_feedforward(recording)->kA.value, fit_feedforward(recording)->kA.value);
}

TEST(FeedforwardFit, FindsTheDelay) {
  auto options = scenarios::session(scenarios::mechanisms[elevator], 4);
  options.sensor_delay = 0.06;
  const auto fit = fit_feedforward(flyball::record_characterization(options).value());
  ASSERT_TRUE(fit) << to_string(fit.error());
  // A row sees the value half a row period old on average beside the sensor's own delay.
  EXPECT_NEAR(fit->position_delay, 0.06, 0.008);
  expect_near(fit->kA, 0.3, 0.03);
}

TEST(FeedforwardFit, WorksWithoutVelocity) {
  Recording recording = record(elevator);
  for (TestRun& run : recording.runs) {
    run.velocity.clear();
  }
  const auto fit = fit_feedforward(recording);
  ASSERT_TRUE(fit) << to_string(fit.error());
  expect_near(fit->kV, 4.0, 0.01);
  expect_near(fit->kA, 0.3, 0.05);
}

TEST(FeedforwardFit, WorksWithoutPosition) {
  Recording recording = record(flywheel);
  for (TestRun& run : recording.runs) {
    run.position.clear();
  }
  const auto fit = fit_feedforward(recording);
  ASSERT_TRUE(fit) << to_string(fit.error());
  expect_near(fit->kV, 0.12, 0.01);
  expect_near(fit->kA, 0.05, 0.05);
}

// The time constant of 4 ms is far below the 20 ms between sensor values.
TEST(FeedforwardFit, SaysThatKaIsNotDetermined) {
  auto options = scenarios::session(scenarios::mechanisms[elevator], 1);
  options.kA = 0.016;
  const auto report = identify_feedforward(flyball::record_characterization(options).value());
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  EXPECT_FALSE(report.fit->kA.determined);
  EXPECT_GE(report.fit->kA.upper_bound, 0.016);
  EXPECT_LT(report.fit->kA.upper_bound, 0.5);
  EXPECT_FALSE(report.fit->kA.reason.empty());
  EXPECT_NE(find(report.diagnostics, "kA_not_determined"), nullptr);
  expect_near(report.fit->kV, 4.0, 0.01);
}

TEST(FeedforwardFit, SaysThatGravityAndFrictionAreNotThere) {
  auto options = scenarios::session(scenarios::mechanisms[elevator], 1);
  options.kG = 0.0;
  options.kS = 0.0;
  const auto report = identify_feedforward(flyball::record_characterization(options).value());
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  EXPECT_FALSE(report.fit->kG->determined);
  EXPECT_FALSE(report.fit->kS.determined);
  EXPECT_NE(find(report.diagnostics, "kG_indistinguishable"), nullptr);
  EXPECT_NE(find(report.diagnostics, "kS_indistinguishable"), nullptr);
}

TEST(FeedforwardFit, FitsAnInvertedEncoder) {
  Recording recording = record(elevator);
  for (TestRun& run : recording.runs) {
    recordings::negate(run.position);
    recordings::negate(run.velocity);
  }
  const auto fit = fit_feedforward(recording);
  ASSERT_TRUE(fit) << to_string(fit.error());
  expect_near(fit->kV, 4.0, 0.005);
  expect_near(*fit->kG, 0.6, 0.02);
}

TEST(FeedforwardFit, GoesOnWithThreeTestsOfFour) {
  for (std::size_t missing = 0; missing < 4; ++missing) {
    Recording recording = record(elevator);
    recording.runs.erase(recording.runs.begin() + static_cast<std::ptrdiff_t>(missing));
    const auto report = identify_feedforward(recording);
    ASSERT_TRUE(report.fit) << missing << ": " << to_string(report.fit.error());
    EXPECT_NE(find(report.diagnostics, "missing_test"), nullptr);
    expect_near(report.fit->kV, 4.0, 0.02);
  }
}

TEST(FeedforwardFit, RefusesOneTestOfFour) {
  for (std::size_t only = 0; only < 4; ++only) {
    Recording recording = record(elevator);
    recording.runs = {recording.runs[only]};
    const auto report = identify_feedforward(recording);
    ASSERT_FALSE(report.fit);
    EXPECT_TRUE(report.fit.error().is(IdentificationError::missing_tests));
    EXPECT_EQ(report.prepared.runs.size(), 1U) << "what there is can still be plotted";
  }
}

TEST(FeedforwardFit, RefusesOnlyRampsAndOnlySteps) {
  const Recording recording = record(flywheel);
  Recording ramps = recording;
  ramps.runs = {recording.runs[0], recording.runs[1]};
  Recording steps = recording;
  steps.runs = {recording.runs[2], recording.runs[3]};
  const auto no_steps = fit_feedforward(ramps);
  ASSERT_FALSE(no_steps);
  EXPECT_TRUE(no_steps.error().is(IdentificationError::missing_tests));
  EXPECT_EQ(no_steps.error().subject(), "dynamic tests (steps)");
  const auto no_ramps = fit_feedforward(steps);
  ASSERT_FALSE(no_ramps);
  EXPECT_EQ(no_ramps.error().subject(), "quasistatic tests (ramps)");
}

TEST(FeedforwardFit, RefusesOneDirectionUnderGravityButNotOfAFlywheel) {
  Recording lift = record(elevator);
  lift.runs = {lift.runs[0], lift.runs[2]};
  const auto refused = fit_feedforward(lift);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(IdentificationError::missing_tests));
  Recording wheel = record(flywheel);
  wheel.runs = {wheel.runs[0], wheel.runs[2]};
  const auto fit = fit_feedforward(wheel);
  ASSERT_TRUE(fit) << to_string(fit.error());
  expect_near(fit->kS, 0.5, 0.02);
}

TEST(FeedforwardFit, RefusesALogWithoutMotion) {
  Recording recording = record(arm);
  for (TestRun& run : recording.runs) {
    for (std::size_t i = 0; i < run.time.size(); ++i) {
      run.position[i] = i % 7 == 0 ? 0.0015 : 0.0;
      run.velocity[i] = i % 5 == 0 ? 0.01 : 0.0;
    }
  }
  const auto report = identify_feedforward(recording);
  ASSERT_FALSE(report.fit);
  EXPECT_TRUE(report.fit.error().is(IdentificationError::no_motion));
  EXPECT_EQ(report.prepared.runs.size(), 4U);
  EXPECT_NE(find(report.diagnostics, "no_motion"), nullptr);
}

// Analogue sensors and differentiated encoders never stand still: their noise is no motion.
TEST(FeedforwardFit, RefusesAMechanismThatOnlyShowsNoise) {
  enum Shown { both, position_only, velocity_only };
  flyball::Random random(7);
  for (const std::size_t mechanism : {flywheel, elevator, arm}) {
    for (const Shown shown : {both, position_only, velocity_only}) {
      for (const std::size_t repeat : {1U, 4U}) {  // rows that a value is shown in
        for (int trial = 0; trial < 5; ++trial) {
          Recording recording = record(mechanism);
          for (TestRun& run : recording.runs) {
            for (std::size_t i = 0; i < run.time.size(); ++i) {
              const bool held = i % repeat != 0;
              run.position[i] = held ? run.position[i - 1] : 0.7 + random.normal(0.0, 1e-3);
              run.velocity[i] = held ? run.velocity[i - 1] : random.normal(0.0, 0.05);
            }
            if (shown == position_only) {
              run.velocity.clear();
            } else if (shown == velocity_only) {
              run.position.clear();
            }
          }
          const auto fit = fit_feedforward(recording);
          ASSERT_FALSE(fit);
          EXPECT_EQ(fit.error().code(), "no_motion")
              << to_string(fit.error()) << "\nmechanism " << mechanism << " shown " << shown
              << " repeat " << repeat;
        }
      }
    }
  }
}

TEST(FeedforwardFit, RefusesAnUnknownMechanismAndTakesTheOption) {
  Recording recording = record(flywheel);
  recording.mechanism.reset();
  const auto refused = fit_feedforward(recording);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(IdentificationError::unknown_mechanism));
  FitOptions options;
  options.mechanism = MechanismKind::flywheel;
  EXPECT_TRUE(fit_feedforward(recording, options));
}

TEST(FeedforwardFit, RefusesNothing) {
  Recording recording;
  recording.mechanism = MechanismKind::arm;
  const auto fit = fit_feedforward(recording);
  ASSERT_FALSE(fit);
  EXPECT_TRUE(fit.error().is(IdentificationError::no_data));
}

TEST(FeedforwardFit, RefusesAnArmWithoutAngle) {
  Recording recording = record(arm);
  for (TestRun& run : recording.runs) {
    run.position.clear();
  }
  const auto fit = fit_feedforward(recording);
  ASSERT_FALSE(fit);
  EXPECT_TRUE(fit.error().is(IdentificationError::singular));
}

TEST(FeedforwardFit, RefusesMotionThatTheVoltageDoesNotExplain) {
  Recording recording = record(flywheel);
  for (TestRun& run : recording.runs) {
    for (std::size_t i = 0; i < run.time.size(); ++i) {
      run.velocity[i] = 10.0 * std::sin(3.0 * run.time[i]) + 0.01 * std::sin(1e3 * run.time[i]);
      run.position[i] = -10.0 / 3.0 * std::cos(3.0 * run.time[i]);
    }
  }
  const auto fit = fit_feedforward(recording);
  ASSERT_FALSE(fit);
}

TEST(FeedforwardFit, NeverHangsOnNoise) {
  flyball::Random random(5);
  for (int trial = 0; trial < 5; ++trial) {
    Recording recording = record(arm, 2);
    for (TestRun& run : recording.runs) {
      for (std::size_t i = 0; i < run.time.size(); ++i) {
        run.position[i] = random.normal();
        run.velocity[i] = random.normal(0.0, 100.0);
        run.voltage[i] = random.normal(0.0, 5.0);
      }
    }
    const auto report = identify_feedforward(recording);
    if (report.fit) {
      EXPECT_TRUE(std::isfinite(report.fit->kV.value));
    }
  }
}

}  // namespace
