#include <flyball/identification/feedforward_fit.hpp>

#include <cmath>

#include "recordings.hpp"

namespace feedforward_fit_test {
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

// Without friction the fit ends at kS = 0 in every other log. What is said of it there is as wide
// as what is said of it elsewhere.
TEST(FeedforwardFit, ABoundOfFrictionIsItsLikelihoods) {
  std::vector<double> at_bound;
  std::vector<double> inside;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    auto options = scenarios::session(scenarios::mechanisms[elevator], seed);
    options.kS = 0.0;
    const auto fit = fit_feedforward(flyball::record_characterization(options).value());
    ASSERT_TRUE(fit) << to_string(fit.error());
    EXPECT_EQ(fit->kS.interval[0], 0.0) << seed;
    (fit->kS.value == 0.0 ? at_bound : inside).push_back(fit->kS.interval[1] - fit->kS.value);
  }
  ASSERT_GE(at_bound.size(), 3U);
  ASSERT_GE(inside.size(), 2U);
  const double usual = *std::max_element(inside.begin(), inside.end());
  for (const double upper : at_bound) {
    EXPECT_GT(upper, 0.2 * usual);
    EXPECT_LT(upper, 3.0 * usual);
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

bool holds(const GainEstimate& gain, double truth) {
  return gain.interval[0] <= truth && truth <= gain.interval[1];
}

Recording only(Recording recording, std::initializer_list<std::size_t> runs) {
  std::vector<TestRun> kept;
  for (const std::size_t run : runs) {
    kept.push_back(recording.runs[run]);
  }
  recording.runs = std::move(kept);
  return recording;
}

// Theorem 14.3.2 does without kA.
TEST(FeedforwardFit, RampsAloneTellAllButKa) {
  for (const std::size_t mechanism : {flywheel, elevator, arm}) {
    const auto report = identify_feedforward(only(record(mechanism), {0, 1}));
    const scenarios::Truth& truth = scenarios::mechanisms[mechanism];
    ASSERT_TRUE(report.fit) << truth.name << ": " << to_string(report.fit.error());
    EXPECT_FALSE(report.fit->kA.determined);
    EXPECT_NE(report.fit->kA.reason.find("dynamic-forward"), std::string::npos);
    EXPECT_GE(report.fit->kA.upper_bound, truth.kA);
    expect_near(report.fit->kV, truth.kV, 0.02);
    EXPECT_TRUE(holds(report.fit->kS, truth.kS)) << truth.name;
    EXPECT_NEAR(report.fit->kG ? report.fit->kG->value : 0.0, truth.kG, 0.03) << truth.name;
  }
}

// What a ramp of a slow or a quick mechanism is taken for is not decided by what is usual.
TEST(FeedforwardFit, RampsOfUnusualArmsHoldTheTruth) {
  for (const double kA : {0.012, 0.15, 0.6}) {
    auto options = scenarios::session(scenarios::mechanisms[arm], 3);
    options.kA = kA;
    const auto fit =
        fit_feedforward(only(flyball::record_characterization(options).value(), {0, 1}));
    ASSERT_TRUE(fit) << kA << ": " << to_string(fit.error());
    EXPECT_TRUE(holds(fit->kV, 1.2))
        << kA << " " << fit->kV.value << " ± " << 1.96 * fit->kV.standard_error;
    expect_near(fit->kV, 1.2, 0.02);
    EXPECT_TRUE(holds(fit->kS, 0.1)) << kA;
    EXPECT_TRUE(holds(*fit->kG, 0.65)) << kA;
    EXPECT_GE(fit->kA.upper_bound, kA);
  }
}

TEST(FeedforwardFit, OneRampOfAFlywheelTellsFrictionAndSpeed) {
  const auto fit = fit_feedforward(only(record(flywheel), {0}));
  ASSERT_TRUE(fit) << to_string(fit.error());
  expect_near(fit->kV, 0.12, 0.02);
  EXPECT_TRUE(holds(fit->kS, 0.5));
  EXPECT_FALSE(fit->kA.determined);
}

TEST(FeedforwardFit, StepsOfOneVoltageAreRefusedWithTheSpeedTheyEndIn) {
  const auto fit = fit_feedforward(only(record(flywheel), {2, 3}));
  ASSERT_FALSE(fit);
  EXPECT_TRUE(fit.error().is(IdentificationError::missing_tests));
  EXPECT_EQ(fit.error().subject(), "quasistatic tests (ramps)");
  ASSERT_EQ(fit.error().evidence().size(), 2U);
  // (6 V − 0.5 V) / 0.12 V s, nearly.
  EXPECT_NE(to_string(fit.error()).find("6 V end in 4"), std::string::npos)
      << to_string(fit.error());
}

TEST(FeedforwardFit, StepsOfTwoVoltagesTellAllOfAFlywheel) {
  Recording steps = only(record(flywheel), {2, 3});
  auto options = scenarios::session(scenarios::mechanisms[flywheel], 7);
  options.step_voltage = 3.0;
  const Recording slower = flyball::record_characterization(options).value();
  steps.runs.insert(steps.runs.end(), slower.runs.begin() + 2, slower.runs.end());
  const auto fit = fit_feedforward(steps);
  ASSERT_TRUE(fit) << to_string(fit.error());
  expect_near(fit->kV, 0.12, 0.02);
  expect_near(fit->kA, 0.05, 0.05);
  EXPECT_TRUE(holds(fit->kS, 0.5));
}

// kS = 0.15 V and kG = 0.6 V: upwards they are one number, downwards their difference is.
TEST(FeedforwardFit, OneDirectionOfALiftTellsFrictionWithGravity) {
  const auto up = identify_feedforward(only(record(elevator), {0, 2}));
  ASSERT_TRUE(up.fit) << to_string(up.fit.error());
  ASSERT_TRUE(up.fit->gravity_with_friction);
  EXPECT_NEAR(up.fit->gravity_with_friction->value, 0.75, 0.02);
  EXPECT_TRUE(holds(*up.fit->gravity_with_friction, 0.75));
  EXPECT_FALSE(up.fit->in_reverse);
  EXPECT_FALSE(up.fit->kS.determined);
  EXPECT_FALSE(up.fit->kG->determined);
  EXPECT_EQ(up.fit->kS.value, 0.0);
  EXPECT_EQ(up.fit->kG->value, up.fit->gravity_with_friction->value);
  EXPECT_TRUE(holds(up.fit->kS, 0.15) && holds(*up.fit->kG, 0.6));
  expect_near(up.fit->kV, 4.0, 0.02);
  expect_near(up.fit->kA, 0.3, 0.1);
  const flyball::Diagnostic* told = find(up.diagnostics, "gravity_with_friction");
  ASSERT_NE(told, nullptr);
  EXPECT_NE(told->message.find("quasistatic-reverse"), std::string::npos) << told->message;
  EXPECT_EQ(find(up.diagnostics, "kG_indistinguishable"), nullptr);

  const auto down = identify_feedforward(only(record(elevator), {1, 3}));
  ASSERT_TRUE(down.fit) << to_string(down.fit.error());
  ASSERT_TRUE(down.fit->gravity_with_friction);
  EXPECT_TRUE(down.fit->in_reverse);
  EXPECT_NEAR(down.fit->gravity_with_friction->value, 0.45, 0.02);
  expect_near(down.fit->kV, 4.0, 0.02);
}

TEST(FeedforwardFit, OneDirectionOfAFlywheelIsEnough) {
  const auto fit = fit_feedforward(only(record(flywheel), {0, 2}));
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_FALSE(fit->gravity_with_friction);
  expect_near(fit->kS, 0.5, 0.02);
}

// An arm's gravity changes along its way, friction does not.
TEST(FeedforwardFit, OneDirectionOfAnArmTellsThemApart) {
  const auto fit = fit_feedforward(only(record(arm), {0, 2}));
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_TRUE(holds(fit->kS, 0.1));
  EXPECT_TRUE(holds(*fit->kG, 0.65));
  expect_near(fit->kV, 1.2, 0.03);
}

TEST(FeedforwardFit, TheSameTestsRecordedTwiceAreUsedTogether) {
  Recording twice = record(elevator);
  const Recording again = record(elevator, 9);
  twice.runs.insert(twice.runs.end(), again.runs.begin(), again.runs.end());
  const auto fit = fit_feedforward(twice);
  ASSERT_TRUE(fit) << to_string(fit.error());
  const auto once = fit_feedforward(record(elevator));
  expect_near(fit->kV, 4.0, 0.005);
  // What differs between the tests, not the rows, is what the interval is made of.
  EXPECT_LT(fit->kV.standard_error, 1.3 * once->kV.standard_error);
  EXPECT_LT(fit->kA.standard_error, 1.3 * once->kA.standard_error);
  EXPECT_EQ(fit->runs.size(), 8U);
}

// Rows repeat a value four times: a repeated one is no residual.
TEST(FeedforwardFit, CountsAValueOnce) {
  auto options = scenarios::session(scenarios::mechanisms[elevator], 1);
  options.noise_per_row = false;
  const auto fit = fit_feedforward(flyball::record_characterization(options).value());
  ASSERT_TRUE(fit) << to_string(fit.error());
  for (const FittedRun& run : fit->runs) {
    ASSERT_FALSE(run.fresh.empty());
    EXPECT_LT(run.fresh.size(), run.time.size() / 3);
    for (const std::size_t row : run.fresh) {
      ASSERT_LT(row, run.time.size());
      EXPECT_TRUE(row == 0 || run.velocity[row] != run.velocity[row - 1]);
    }
  }
}

TEST(FeedforwardFit, UsesOfARunWhatAPersonLeaves) {
  Recording recording = record(flywheel);
  TestRun& ramp = recording.runs[0];
  const double half = 0.5 * (ramp.time.back() - ramp.time.front());
  ramp.to = half;
  recording.runs[1].left_out = true;
  const auto report = identify_feedforward(recording);
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  ASSERT_EQ(report.fit->runs.size(), 4U);
  EXPECT_TRUE(report.fit->runs[0].used);
  EXPECT_LE(report.fit->runs[0].time.back(), ramp.time.front() + half);
  EXPECT_FALSE(report.fit->runs[1].used);
  EXPECT_EQ(find(report.diagnostics, "no_motion"), nullptr);
  EXPECT_NE(find(report.diagnostics, "missing_test"), nullptr);
  expect_near(report.fit->kV, 0.12, 0.01);
}

TEST(FeedforwardFit, AStepThatIsCutInMotionDoesNotStartAtRest) {
  Recording recording = record(elevator);
  for (TestRun& run : recording.runs) {
    run.velocity.clear();
  }
  TestRun& step = recording.runs[2];
  step.from = 0.4;
  const auto report = identify_feedforward(recording);
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  EXPECT_FALSE(report.prepared.runs[2].starts_at_rest);
  EXPECT_TRUE(report.prepared.runs[3].starts_at_rest);
  expect_near(report.fit->kV, 4.0, 0.02);
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
}  // namespace feedforward_fit_test
