// Sessions with what the four gains lack: it is found, named, and does not spoil the gains; gains
// that no mechanism has are refused with the probable cause.
#include <cmath>

#include <flyball/identification/feedforward_fit.hpp>

#include "recordings.hpp"

namespace defects_test {
namespace {

using namespace flyball::identification;
using flyball::CharacterizationOptions;
using flyball::SessionDefects;
using recordings::arm;
using recordings::elevator;
using recordings::find;
using recordings::flywheel;

FitReport report_of(std::size_t mechanism, const SessionDefects& defects, bool extend = true) {
  CharacterizationOptions options = scenarios::session(scenarios::mechanisms.at(mechanism), 7);
  options.defects = defects;
  FitOptions fit;
  fit.extend = extend;
  return identify_feedforward(flyball::record_characterization(options).value(), fit);
}

void expect_gains(const FitReport& report, std::size_t mechanism, double tolerance) {
  const scenarios::Truth& truth = scenarios::mechanisms.at(mechanism);
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  EXPECT_NEAR(report.fit->kS.value, truth.kS, 4.0 * tolerance * truth.kS);
  EXPECT_NEAR(report.fit->kV.value, truth.kV, tolerance * truth.kV);
  EXPECT_NEAR(report.fit->kA.value, truth.kA, 2.0 * tolerance * truth.kA);
  if (report.fit->kG) {
    EXPECT_NEAR(report.fit->kG->value, truth.kG, 3.0 * tolerance * truth.kG);
  }
}

struct Defect {
  const char* code;
  std::size_t mechanism;
  SessionDefects defects;
  double value;  ///< Of the term.
};

// Plain logs in which the residuals' own covariances see a sag; the noise of the record makes as
// much of it by chance, and nothing is said.
TEST(Doubts, PlainLogsLeaveNoSagOpen) {
  for (const std::uint64_t seed : {14, 16, 26, 35, 39, 53}) {
    const FitReport report = identify_feedforward(
        flyball::record_characterization(scenarios::session(scenarios::mechanisms[0], seed))
            .value());
    ASSERT_TRUE(report.fit) << seed;
    EXPECT_EQ(find(report.diagnostics, "term_in_doubt"), nullptr) << seed;
    EXPECT_TRUE(report.fit->terms.empty()) << seed;
  }
}

class ModelTerms : public testing::TestWithParam<Defect> {};

TEST_P(ModelTerms, AreFoundAndTheGainsHoldBesideThem) {
  const auto& [code, mechanism, defects, value] = GetParam();
  const FitReport report = report_of(mechanism, defects);
  expect_gains(report, mechanism, 0.01);
  ASSERT_NE(find(report.diagnostics, code), nullptr);
  ASSERT_EQ(report.fit->terms.size(), 1U);
  const ModelTerm& term = report.fit->terms[0];
  EXPECT_EQ(term.name, code);
  EXPECT_NEAR(term.value.value, value, 0.05 * std::abs(value));
  const double slack = 1e-3 * std::abs(value);
  EXPECT_LE(term.value.interval[0], value + slack);
  EXPECT_GE(term.value.interval[1], value - slack);
  // Without the term the gains are off by more than they say, or say little.
  const FitReport without = report_of(mechanism, defects, false);
  ASSERT_TRUE(without.fit);
  const scenarios::Truth& truth = scenarios::mechanisms.at(mechanism);
  const auto misses = [](const GainEstimate& gain, double true_value) {
    return true_value < gain.interval[0] || true_value > gain.interval[1];
  };
  const bool says_little = without.fit->kS.standard_error > 4.0 * report.fit->kS.standard_error &&
                           without.fit->kA.standard_error > 4.0 * report.fit->kA.standard_error;
  EXPECT_TRUE(says_little || misses(without.fit->kS, truth.kS) ||
              misses(without.fit->kV, truth.kV) || misses(without.fit->kA, truth.kA) ||
              (without.fit->kG && misses(*without.fit->kG, truth.kG)));
}

INSTANTIATE_TEST_SUITE_P(
    Defects, ModelTerms,
    testing::Values(Defect{"spring", elevator, {.spring = 0.8}, 0.8},
                    Defect{"spring", arm, {.spring = -0.4}, -0.4},
                    Defect{"drag", flywheel, {.drag = 4e-4}, 4e-4},
                    Defect{"drag", elevator, {.drag = 0.4}, 0.4},
                    Defect{"sag", elevator, {.sag = 0.2}, 0.2},
                    Defect{"asymmetric_friction", flywheel, {.friction_asymmetry = 0.4}, 0.2},
                    Defect{"current_limit", flywheel, {.headroom = 3.0}, 3.0},
                    Defect{"current_limit", elevator, {.headroom = 3.5}, 3.5}));

TEST(ModelTerms, AreNotFoundWhereNothingIs) {
  for (const std::size_t mechanism : {flywheel, elevator, arm}) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      const auto fit = fit_feedforward(recordings::record(mechanism, seed));
      ASSERT_TRUE(fit) << to_string(fit.error());
      EXPECT_TRUE(fit->terms.empty()) << mechanism << " seed " << seed << " " << fit->terms[0].name;
    }
  }
}

// A velocity that is refreshed with the position every 20 ms, with noise in every row of 5 ms: only
// the rows of a refresh are new.
TEST(Prepare, AVelocityThatRepeatsUnderNoiseIsNewOnceARefresh) {
  CharacterizationOptions options = scenarios::session(scenarios::mechanisms.at(elevator), 7);
  options.noise_per_row = true;
  const auto held = prepare(flyball::record_characterization(options).value());
  ASSERT_TRUE(held);
  EXPECT_NEAR(held->velocity_refresh_period, 0.02, 1e-3);
  EXPECT_EQ(held->runs[2].fresh_velocity, held->runs[2].fresh_position);
  // Refreshed in every row, it is new in every row.
  options.sensor_refresh = options.row_period;
  const auto free = prepare(flyball::record_characterization(options).value());
  ASSERT_TRUE(free);
  EXPECT_GT(free->runs[2].fresh_velocity.size() * 2, free->runs[2].run.time.size());
}

// An arm's spring is nearly gravity's sine: left out without being denied, it must be in kG's
// interval.
TEST(ModelTerms, ATermInDoubtWidensTheIntervals) {
  const SessionDefects weak{.spring = -0.1};
  const FitReport doubting = report_of(arm, weak);
  const FitReport sure = report_of(arm, weak, false);
  ASSERT_TRUE(doubting.fit && sure.fit);
  ASSERT_TRUE(doubting.fit->terms.empty());
  EXPECT_EQ(doubting.fit->kG->value, sure.fit->kG->value);
  EXPECT_GT(doubting.fit->kG->standard_error, 1.2 * sure.fit->kG->standard_error);
}

// A flywheel's steps of one height tell a sagging battery from more inertia by a hundredth of a
// volt: where that leaves it open, kA's interval holds both, and it is told.
TEST(ModelTerms, ABatteryThatMaySagIsInTheInertiasInterval) {
  std::size_t told = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const scenarios::Truth& truth = scenarios::mechanisms.at(0);
    CharacterizationOptions options = scenarios::session(truth, seed);
    options.defects.sag = 0.2;
    const FitReport report =
        identify_feedforward(flyball::record_characterization(options).value());
    ASSERT_TRUE(report.fit);
    const auto* doubt = find(report.diagnostics, "term_in_doubt");
    const bool sags = find(report.diagnostics, "sag") != nullptr ||
                      (doubt != nullptr && doubt->message.find("sags") != std::string::npos);
    told += sags ? 1 : 0;
    if (sags) {
      EXPECT_LE(report.fit->kA.interval[0], truth.kA) << seed;
      EXPECT_GE(report.fit->kA.interval[1], truth.kA) << seed;
    }
  }
  EXPECT_GE(told, 5U);
}

// A flywheel turns 46 times a second, and its encoder slips by a twentieth of a turn twice a test:
// one way at all speeds, which no clock makes.
TEST(Slip, OfASmallWayIsToldByItsBeingTheSameAtAllSpeeds) {
  const FitReport report = report_of(0, {.slip = 0.4});
  ASSERT_NE(find(report.diagnostics, "slip"), nullptr);
  expect_gains(report, 0, 0.01);
}

// Of a limit that acts for hundredths of a second a step's encoder shows what backlash shows, too.
TEST(ModelTerms, ALimitThatBacklashExplainsNearlyAsWellIsTold) {
  std::size_t told = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const scenarios::Truth& truth = scenarios::mechanisms.at(arm);
    CharacterizationOptions options = scenarios::session(truth, seed);
    options.defects.headroom = 3.8;
    const FitReport report =
        identify_feedforward(flyball::record_characterization(options).value());
    ASSERT_TRUE(report.fit);
    const auto* doubt = find(report.diagnostics, "term_in_doubt");
    told +=
        find(report.diagnostics, "current_limit") != nullptr ||
                (doubt != nullptr && doubt->message.find("a current limit") != std::string::npos)
            ? 1
            : 0;
  }
  EXPECT_GE(told, 5U);
}

// What the step's encoder is ahead by is three quarters of half the gap: it starts in the middle,
// and a quarter of the inertia is the motor's.
TEST(Backlash, BeforeTheLoadFollowsIsTakenOutOfTheStep) {
  const SessionDefects slack{.backlash = 0.03};
  const FitReport report = report_of(arm, slack);
  ASSERT_NE(find(report.diagnostics, "backlash"), nullptr);
  ASSERT_EQ(report.fit->terms.size(), 1U);
  EXPECT_EQ(report.fit->terms[0].unit, "rad");
  EXPECT_NEAR(report.fit->terms[0].value.value, 0.75 * 0.5 * 0.03, 0.2 * 0.01125);
  expect_gains(report, arm, 0.0125);
  const FitReport without = report_of(arm, slack, false);
  EXPECT_GT(without.fit->kA.value, 1.03 * scenarios::mechanisms.at(arm).kA);
}

TEST(Friction, ThatVariesAlongTheTravelDoesNotSpoilTheGains) {
  for (const std::size_t mechanism : {elevator, std::size_t{3}, arm}) {
    CharacterizationOptions options = scenarios::session(scenarios::mechanisms.at(mechanism), 7);
    options.friction_variation = 0.4;
    const FitReport report =
        identify_feedforward(flyball::record_characterization(options).value());
    expect_gains(report, mechanism, 0.01);
    ASSERT_NE(find(report.diagnostics, "friction_along_travel"), nullptr) << mechanism;
    EXPECT_NEAR(report.fit->terms.at(0).value.value, 0.4 * options.kS, 0.04 * options.kS);
  }
}

// Twice in each test the encoder loses a twentieth of half the travel.
TEST(Slip, IsNamedAndPutBack) {
  for (const std::size_t mechanism : {elevator, arm}) {
    CharacterizationOptions options = scenarios::session(scenarios::mechanisms.at(mechanism), 7);
    const Recording sound = flyball::record_characterization(options).value();
    options.defects.slip = 0.05 * scenarios::reach(options);
    const Recording slipped = flyball::record_characterization(options).value();
    const auto prepared = prepare(slipped);
    ASSERT_TRUE(prepared);
    EXPECT_NE(find(prepared->diagnostics, "slip"), nullptr) << mechanism;
    EXPECT_EQ(find(prepare(sound)->diagnostics, "slip"), nullptr) << mechanism;
    // Of the ramps no jump is left.
    for (std::size_t run = 0; run < 2; ++run) {
      const double moved =
          prepared->runs[run].run.position.back() - sound.runs[run].position.back();
      EXPECT_NEAR(moved, 0.0, 0.1 * options.defects.slip) << mechanism;
    }
    expect_gains(identify_feedforward(slipped), mechanism, 0.02);
  }
}

// A clock that loses a refresh of the sensor makes the position jump as well, by the speed's way.
TEST(Slip, IsNotAClockThatLosesARefresh) {
  Recording recording = recordings::record(elevator);
  for (TestRun& run : recording.runs) {
    for (const double share : {0.4, 0.7}) {
      const auto at = static_cast<std::size_t>(share * static_cast<double>(run.time.size()));
      constexpr std::size_t refresh = 4;  // rows
      for (auto* column : {&run.time, &run.voltage, &run.position, &run.velocity}) {
        const auto first = column->begin() + static_cast<std::ptrdiff_t>(at);
        column->erase(first, first + refresh);
      }
      for (std::size_t i = at; i < run.time.size(); ++i) {
        run.time[i] -= 0.02;
      }
    }
  }
  EXPECT_EQ(find(prepare(recording)->diagnostics, "slip"), nullptr);
}

TEST(Backlash, IsNamed) {
  const FitReport report = report_of(arm, {.backlash = 0.08});
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  EXPECT_NE(find(report.diagnostics, "backlash"), nullptr);
  EXPECT_NEAR(report.fit->kV.value, 1.2, 0.02);
}

TEST(Plausibility, GainsBeyondTheBatteryAreRefusedWithTheCause) {
  Recording recording = recordings::record(elevator);
  for (TestRun& run : recording.runs) {
    for (auto* column : {&run.position, &run.velocity}) {
      for (double& value : *column) {
        value *= 1000.0;  // millimetres that were taken for metres
      }
    }
  }
  const auto fit = fit_feedforward(recording);
  ASSERT_FALSE(fit);
  EXPECT_TRUE(fit.error().is(IdentificationError::unphysical_gains)) << to_string(fit.error());
  EXPECT_NE(to_string(fit.error()).find("--unit"), std::string::npos) << to_string(fit.error());
}

TEST(Plausibility, UnusualSpeedsAreTold) {
  Recording recording = recordings::record(flywheel);  // 100 rad/s at 12 V
  for (TestRun& run : recording.runs) {
    for (auto* column : {&run.position, &run.velocity}) {
      for (double& value : *column) {
        value *= 57.29577951308232;  // degrees
      }
    }
  }
  const FitReport report = identify_feedforward(recording);
  ASSERT_TRUE(report.fit) << to_string(report.fit.error());
  const auto* told = find(report.diagnostics, "unusual_speed");
  ASSERT_NE(told, nullptr);
  EXPECT_NE(told->message.find("degrees that were taken for radians"), std::string::npos)
      << told->message;
}

}  // namespace
}  // namespace defects_test
