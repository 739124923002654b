#include <flyball/identification/preparation.hpp>

#include <cmath>
#include <limits>

#include "recordings.hpp"

namespace preparation_test {
namespace {

using namespace flyball::identification;
using flyball::ArgumentError;
using recordings::arm;
using recordings::elevator;
using recordings::find;
using recordings::flywheel;
using recordings::record;

// A sensor is refreshed every 20 ms, also where its value stays: new are the rows of its own beat
// alone, from before the motion on.
TEST(Prepare, RefreshesToTheSameValueKeepTheSensorsBeat) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const auto prepared = prepare(recordings::record(recordings::elevator, seed));
    ASSERT_TRUE(prepared);
    for (const PreparedRun& run : prepared->runs) {
      const std::vector<std::size_t>& fresh = run.fresh_position;
      ASSERT_GT(fresh.size(), 20U);
      const double beat = run.run.time[fresh[fresh.size() / 2]];
      // The first row is new whatever stands before.
      for (std::size_t k = 1; k < fresh.size(); ++k) {
        const double beats = (run.run.time[fresh[k]] - beat) / 0.02;
        EXPECT_NEAR(beats, std::round(beats), 1e-6) << seed << " row " << fresh[k];
      }
    }
  }
}

TEST(Prepare, FindsRefreshAndResolution) {
  const auto prepared = prepare(record(elevator));
  ASSERT_TRUE(prepared);
  EXPECT_NEAR(prepared->row_period, 5e-3, 1e-9);
  EXPECT_NEAR(prepared->position_refresh_period, 20e-3, 1e-9);
  // Steps of one or two counts: the mechanism may never move by just one.
  EXPECT_NEAR(prepared->position_quantum, 1.5e-4, 5.1e-5);
  EXPECT_NEAR(prepared->velocity_scale, 1.0, 0.01);
  ASSERT_EQ(prepared->runs.size(), 4U);
  for (const PreparedRun& run : prepared->runs) {
    EXPECT_TRUE(run.moved);
    EXPECT_EQ(run.direction, is_forward(run.run.kind) ? 1.0 : -1.0);
    EXPECT_LT(run.first, run.last);
    EXPECT_EQ(run.starts_at_rest, !is_quasistatic(run.run.kind));
  }
}

TEST(Prepare, RefusesATimeInAnotherUnit) {
  Recording recording = record(arm);
  for (TestRun& run : recording.runs) {
    for (double& time : run.time) {
      time *= 1e6;
    }
  }
  const auto prepared = prepare(recording);
  ASSERT_FALSE(prepared);
  EXPECT_TRUE(prepared.error().is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(prepared.error()),
            "identify: the distance of two rows in time is 5000 s; it must be at most 1 s; give "
            "time in seconds, or name its unit in the header, such as \"time (us)\"");
}

TEST(Prepare, TellsRepeatedRows) {
  Recording recording = record(arm, 2);
  for (TestRun& run : recording.runs) {
    for (std::size_t i = 0; i < run.velocity.size(); ++i) {
      run.velocity[i] = run.velocity[i - i % 4];
      run.position[i] = run.position[i - i % 4];
    }
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "repeated_rows"), nullptr);
  EXPECT_NE(find(prepared->diagnostics, "repeated_rows")->message.find("20.0 ms"),
            std::string::npos);
}

TEST(Prepare, SortsRowsThatGoBackInTime) {
  const Recording sorted = record(arm);
  Recording shuffled = sorted;
  for (std::vector<double> TestRun::* column :
       {&TestRun::time, &TestRun::voltage, &TestRun::position, &TestRun::velocity}) {
    std::swap((shuffled.runs[0].*column)[100], (shuffled.runs[0].*column)[200]);
  }
  const auto prepared = prepare(shuffled);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "unsorted_time"), nullptr);
  EXPECT_EQ(prepared->runs[0].run.time, sorted.runs[0].time);
  EXPECT_EQ(prepared->runs[0].run.position, sorted.runs[0].position);
}

TEST(Prepare, KeepsTheLaterOfTwoRowsOfOneInstant) {
  Recording recording = record(arm);
  recording.runs[0].time[101] = recording.runs[0].time[100];
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  EXPECT_NE(find(prepared->diagnostics, "duplicate_times"), nullptr);
  EXPECT_EQ(prepared->runs[0].run.time.size(), recording.runs[0].time.size() - 1);
}

TEST(Prepare, DropsRowsThatAreNotFinite) {
  Recording recording = record(arm);
  recording.runs[1].velocity[50] = std::numeric_limits<double>::quiet_NaN();
  recording.runs[1].voltage[60] = std::numeric_limits<double>::infinity();
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "non_finite_rows"), nullptr);
  EXPECT_EQ(find(prepared->diagnostics, "non_finite_rows")->message.substr(0, 4), "2 of");
  EXPECT_EQ(prepared->runs[1].run.time.size(), recording.runs[1].time.size() - 2);
}

TEST(Prepare, DropsSpikes) {
  Recording recording = record(arm);
  recording.runs[2].velocity[40] = -977.0;
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  EXPECT_NE(find(prepared->diagnostics, "outliers"), nullptr);
  EXPECT_EQ(prepared->runs[2].run.time.size(), recording.runs[2].time.size() - 1);
}

TEST(Prepare, MendsStaleFirstPositionsAndDropsGlitches) {
  Recording recording = record(elevator);
  for (std::size_t i = 0; i < 5; ++i) {
    recording.runs[1].position[i] = 0.0;
  }
  const std::size_t rows = recording.runs[0].time.size();
  recording.runs[0].position[rows - 100] -= 0.4;
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  EXPECT_NE(find(prepared->diagnostics, "position_jumps"), nullptr);
  // The rows stay: the voltage's edge is among them.
  EXPECT_NE(find(prepared->diagnostics, "stale_first_value"), nullptr);
  EXPECT_EQ(prepared->runs[1].run.time.size(), recording.runs[1].time.size());
  EXPECT_EQ(prepared->runs[1].run.position[0], recording.runs[1].position[5]);
  EXPECT_EQ(prepared->runs[0].run.time.size(), rows - 1);
}

TEST(Prepare, NamesAnInvertedEncoder) {
  Recording recording = record(elevator);
  const Recording upright = recording;
  for (TestRun& run : recording.runs) {
    recordings::negate(run.position);
    recordings::negate(run.velocity);
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "sign_mismatch"), nullptr);
  EXPECT_NE(find(prepared->diagnostics, "sign_mismatch")->message.find("inverted encoder"),
            std::string::npos);
  EXPECT_EQ(prepared->runs[3].run.velocity, upright.runs[3].velocity);
}

TEST(Prepare, GivesAnUnsignedVoltageTheSignOfTheMotion) {
  Recording recording = record(flywheel);
  for (TestRun& run : recording.runs) {
    for (double& voltage : run.voltage) {
      voltage = std::abs(voltage);
    }
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "sign_mismatch"), nullptr);
  EXPECT_NE(find(prepared->diagnostics, "sign_mismatch")->message.find("carries no sign"),
            std::string::npos);
  EXPECT_LT(prepared->runs[3].run.voltage.back(), 0.1);
}

TEST(Prepare, TellsAPositionAgainstItsVelocity) {
  Recording recording = record(flywheel);
  for (TestRun& run : recording.runs) {
    recordings::negate(run.position);
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "sign_mismatch"), nullptr);
  EXPECT_NE(find(prepared->diagnostics, "sign_mismatch")->message.find("position disagrees"),
            std::string::npos);
}

TEST(Prepare, TellsOneTestRecordedTheOtherWayRound) {
  Recording recording = record(flywheel);
  recordings::negate(recording.runs[3].voltage);
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "sign_mismatch"), nullptr);
  EXPECT_NE(find(prepared->diagnostics, "sign_mismatch")->message.find("dynamic-reverse"),
            std::string::npos);
}

TEST(Prepare, TellsTheScaleOfTheVelocity) {
  Recording recording = record(flywheel);
  for (TestRun& run : recording.runs) {
    for (double& velocity : run.velocity) {
      velocity *= 0.87;
    }
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  EXPECT_NE(find(prepared->diagnostics, "velocity_disagrees_with_position"), nullptr);
  EXPECT_NEAR(prepared->velocity_scale, 0.87, 0.01);
}

TEST(Prepare, GivesUpACoarseVelocity) {
  Recording recording = record(arm);
  for (TestRun& run : recording.runs) {
    for (double& velocity : run.velocity) {
      velocity = std::trunc(velocity / 0.6) * 0.6;
    }
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  EXPECT_NE(find(prepared->diagnostics, "coarse_velocity"), nullptr);
  EXPECT_FALSE(prepared->has_velocity);
}

TEST(Prepare, CutsAStall) {
  Recording recording = record(elevator);
  TestRun& run = recording.runs[2];
  while (std::abs(run.voltage.back()) < 3.0) {
    for (std::vector<double> TestRun::* column :
         {&TestRun::time, &TestRun::voltage, &TestRun::position, &TestRun::velocity}) {
      (run.*column).pop_back();
    }
  }
  const double stop = run.time.back();
  for (int i = 0; i < 60; ++i) {
    run.time.push_back(run.time.back() + 5e-3);
    run.voltage.push_back(6.0);
    run.position.push_back(run.position.back());
    run.velocity.push_back(0.0);
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "hit_stop"), nullptr);
  EXPECT_LT(prepared->runs[2].run.time[prepared->runs[2].last - 1], stop);
}

TEST(Prepare, TellsMissingAndMotionlessTests) {
  Recording recording = record(elevator);
  for (double& position : recording.runs[1].position) {
    position = 0.5;
  }
  recording.runs.pop_back();
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "missing_test"), nullptr);
  EXPECT_NE(find(prepared->diagnostics, "missing_test")->message.find("dynamic-reverse"),
            std::string::npos);
  EXPECT_NE(find(prepared->diagnostics, "no_motion"), nullptr);
  EXPECT_FALSE(prepared->runs[1].moved);
}

TEST(Prepare, TellsAnArmThatTurnsRoundAndRound) {
  Recording recording = record(arm);
  for (TestRun& run : recording.runs) {
    for (double& position : run.position) {
      position *= 20.0;
    }
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  EXPECT_NE(find(prepared->diagnostics, "travel_exceeds_turn"), nullptr);
}

TEST(Prepare, KeepsTheLongestStretchWithoutGaps) {
  Recording recording = record(flywheel);
  TestRun& run = recording.runs[0];
  for (std::size_t i = run.time.size() - 200; i < run.time.size(); ++i) {
    run.time[i] += 1.0;
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  EXPECT_NE(find(prepared->diagnostics, "gaps"), nullptr);
  EXPECT_LE(prepared->runs[0].last, run.time.size() - 200);
}

TEST(Prepare, RefusesColumnsOfDifferentLength) {
  Recording recording = record(arm);
  recording.runs[1].velocity.pop_back();
  const auto prepared = prepare(recording);
  ASSERT_FALSE(prepared);
  EXPECT_TRUE(prepared.error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(prepared.error().subject(), "run 1 (quasistatic-reverse)");
}

TEST(Prepare, RefusesARunWithoutPositionAndVelocity) {
  Recording recording = record(arm);
  recording.runs[0].position.clear();
  recording.runs[0].velocity.clear();
  EXPECT_FALSE(prepare(recording));
}

TEST(Prepare, SurvivesEmptyRecordings) {
  const auto nothing = prepare(Recording{});
  ASSERT_TRUE(nothing);
  EXPECT_TRUE(nothing->runs.empty());
  Recording empty_run;
  empty_run.runs.resize(4);
  EXPECT_TRUE(prepare(empty_run));
}

// More spikes than a hundredth of the rows, which no quantile is deaf to.
TEST(Prepare, DropsSpikesThatStandAlone) {
  Recording recording = record(arm);
  std::size_t spikes = 0;
  for (TestRun& run : recording.runs) {
    for (std::size_t i = 20; i + 10 < run.position.size(); i += 23, ++spikes) {
      run.position[i] += i % 2 == 0 ? 30.0 : -30.0;
    }
  }
  const auto prepared = prepare(recording);
  const auto clean = prepare(record(arm));
  ASSERT_TRUE(prepared && clean);
  EXPECT_NE(find(prepared->diagnostics, "outliers"), nullptr);
  std::size_t dropped = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const PreparedRun& run = prepared->runs[k];
    dropped += clean->runs[k].run.time.size() - run.run.time.size();
    EXPECT_TRUE(run.moved);
    for (const double position : run.run.position) {
      EXPECT_LT(std::abs(position), 10.0);
    }
  }
  EXPECT_EQ(dropped, spikes);
}

// 5 V, at most, of a command that goes on to 8 V: the log holds the command.
TEST(Prepare, VoltagesThatTheMotorsDoNotGetAreLimited) {
  flyball::CharacterizationOptions options =
      scenarios::session(scenarios::mechanisms.at(flywheel), 3);
  options.ramp_rate = 0.5;
  options.ramp_limit = 5.0;
  options.step_voltage = 5.0;
  options.step_duration = 3.0;
  Recording recording = flyball::record_characterization(options).value();
  for (TestRun& run : recording.runs) {
    const double sign = is_forward(run.kind) ? 1.0 : -1.0;
    // Held at 5 V for 6 s more, while the command rises.
    std::size_t top = 0;
    for (std::size_t i = 0; i < run.voltage.size(); ++i) {
      top = sign * run.voltage[i] > 4.9 ? i : top;
    }
    if (is_quasistatic(run.kind)) {
      run.time.resize(top);
      run.voltage.resize(top);
      run.position.resize(top);
      run.velocity.resize(top);
      const double time = run.time.back();
      const double position = run.position.back();
      const double velocity = run.velocity.back();
      const auto& truth = scenarios::mechanisms.at(flywheel);
      const double end = sign * (5.0 - truth.kS) / truth.kV;
      const double tau = truth.kA / truth.kV;
      for (int k = 1; k <= 1200; ++k) {
        const double t = 5e-3 * k;
        const double left = std::exp(-t / tau);
        run.time.push_back(time + t);
        run.voltage.push_back(sign * (5.0 + 0.5 * t));
        run.velocity.push_back(end + (velocity - end) * left);
        run.position.push_back(position + end * t + (velocity - end) * tau * (1.0 - left));
      }
    } else {
      for (double& volts : run.voltage) {
        volts *= sign * volts > 2.5 ? 1.6 : 1.0;
      }
    }
  }
  const auto prepared = prepare(recording);
  ASSERT_TRUE(prepared);
  ASSERT_NE(find(prepared->diagnostics, "saturated"), nullptr);
  double largest = 0.0;
  for (const PreparedRun& run : prepared->runs) {
    for (const double volts : run.run.voltage) {
      largest = std::max(largest, std::abs(volts));
    }
  }
  EXPECT_NEAR(largest, 5.0, 0.1);
  // A ramp that is followed to its end is not limited.
  for (const std::size_t mechanism : {flywheel, elevator, arm}) {
    EXPECT_EQ(find(prepare(record(mechanism))->diagnostics, "saturated"), nullptr);
  }
}

}  // namespace
}  // namespace preparation_test
