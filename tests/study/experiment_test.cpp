#include <flyball/study/experiment.hpp>

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/study/project.hpp>

#include "session_file.hpp"

namespace flyball::study::experiment_test {
namespace {

using mechanisms::MechanismKind;

ExperimentJob elevator() {
  ExperimentJob job{.plant = {}, .limits = {}, .sensor = {}};
  job.plant.kind = MechanismKind::elevator;
  job.plant.unit = "m";
  job.plant.gains = {.kS = 0.2, .kV = 4.0, .kA = 0.4, .kG = 0.6};
  job.limits.travel_low = 0.0;
  job.limits.travel_high = 1.2;
  job.sensor.resolution = 1e-4;
  return job;
}

// The tests stay within the limits, and tell at least as much as the usual ones.
TEST(PlanExperiment, StaysWithinTheLimitsAndTellsMore) {
  const auto planned = plan_experiment(elevator());
  ASSERT_TRUE(planned) << to_string(planned.error());
  ASSERT_EQ(planned->best.tests.size(), 4u);
  double one = 0.0;
  for (const PlannedTest& test : planned->best.tests) {
    EXPECT_LE(std::abs(test.voltage), 10.0);
    EXPECT_LE(test.travel, 1.2);
    EXPECT_GT(test.travel, 0.0);
    EXPECT_EQ(test.voltage > 0.0, is_forward(test.kind));
    EXPECT_EQ(test.ramp_rate > 0.0, is_quasistatic(test.kind));
    one += test.duration;
  }
  EXPECT_LE(planned->best.duration, 60.0);
  EXPECT_LE(one * planned->best.repeats, planned->best.duration + 1e-9);
  ASSERT_EQ(planned->best.gains.size(), 4u);
  for (const GainForecast& gain : planned->best.gains) {
    EXPECT_TRUE(gain.determined) << gain.name;
    EXPECT_LT(gain.half_width, gain.wanted) << gain.name;
  }
  EXPECT_LE(planned->best.score, 1.1 * planned->usual.score);
}

// On a short travel the usual tests are over before they tell kA: the plan's are not.
TEST(PlanExperiment, FindsTestsForAShortTravel) {
  ExperimentJob job = elevator();
  job.limits.travel_high = 0.15;
  job.limits.duration = 40.0;
  const auto planned = plan_experiment(job);
  ASSERT_TRUE(planned) << to_string(planned.error());
  EXPECT_LT(planned->best.score, 0.8 * planned->usual.score);
  for (const PlannedTest& test : planned->best.tests) {
    EXPECT_LE(test.travel, 0.15);
  }
}

// A simulated log of the plan has the intervals that it foretells, and holds the truth.
TEST(PlanExperiment, ALogOfThePlanTellsWhatItForetells) {
  const ExperimentJob job = elevator();
  const auto planned = plan_experiment(job).value();
  const auto& ramp = planned.best.tests[0];
  const auto step = std::find_if(planned.best.tests.begin(), planned.best.tests.end(),
                                 [](const PlannedTest& test) { return test.ramp_rate == 0.0; });
  CharacterizationOptions session;
  session.mechanism = MechanismKind::elevator;
  session.kS = 0.2;
  session.kV = 4.0;
  session.kA = 0.4;
  session.kG = 0.6;
  session.ramp_rate = ramp.ramp_rate;
  session.ramp_limit = 10.0;
  session.step_voltage = std::abs(step->voltage);
  session.travel_low = 0.0;
  session.travel_high = 1.2;
  session.travel_margin = 0.06;
  session.resolution = 1e-4;
  session.velocity_window = 20e-3;
  session.velocity_noise = 0.005 * 10.0 / 4.0;
  session.seed = 77;
  const auto fit = identification::fit_feedforward(record_characterization(session).value());
  ASSERT_TRUE(fit) << to_string(fit.error());
  const double half = 0.5 * (fit->kV.interval[1] - fit->kV.interval[0]);
  const GainForecast& kV = planned.best.gains[1];
  EXPECT_NEAR(half / std::sqrt(planned.best.repeats) / kV.half_width, 1.0, 0.5);
  EXPECT_NEAR(fit->kV.value, 4.0, 2.0 * half);
}

TEST(PlanExperiment, TheSameJobGivesTheSamePlan) {
  EXPECT_EQ(to_json(plan_experiment(elevator()).value()),
            to_json(plan_experiment(elevator()).value()));
}

TEST(PlanExperiment, SaysWhatItAssumes) {
  ExperimentJob job = elevator();
  job.plant.gains.kS = 0.0;
  job.plant.kA_determined = false;
  job.plant.kA_upper_bound = 0.6;
  const auto planned = plan_experiment(job).value();
  ASSERT_EQ(planned.diagnostics.size(), 2u);
  EXPECT_EQ(planned.diagnostics[0].code, "assumed");
  EXPECT_NE(planned.diagnostics[1].message.find("0.3 V·s²/m"), std::string::npos);
}

TEST(PlanExperiment, ALogGivesGainsSensorsAndTravel) {
  CharacterizationOptions session;
  session.mechanism = MechanismKind::arm;
  session.kS = 0.3;
  session.kV = 1.2;
  session.kA = 0.15;
  session.kG = 0.65;
  session.resolution = 1e-3;
  session.sensor_delay = 0.010;
  session.seed = 5;
  const SessionFile file(session, "Arm", "flyball_experiment_arm.json");
  const auto job = experiment_job(file.path()).value();
  EXPECT_NEAR(job.plant.gains.kV, 1.2, 0.03);
  EXPECT_NEAR(*job.limits.travel_high, 0.95, 0.06);
  EXPECT_NEAR(*job.limits.travel_low, -0.95, 0.06);
  EXPECT_NEAR(job.sensor.refresh, 0.02, 1e-3);
  EXPECT_NEAR(job.sensor.resolution, 1e-3, 1e-6);
  ASSERT_TRUE(job.log);
  // The log's mechanism decides in what its travel is said.
  const Override low{"--travel-low", "-30 deg"};
  EXPECT_NEAR(*experiment_job(file.path(), {&low, 1}).value().limits.travel_low, -0.5235988, 1e-6);
  const Override wrong{"--travel-low", "-30 cm"};
  EXPECT_FALSE(experiment_job(file.path(), {&wrong, 1}));
  const auto planned = plan_experiment(job).value();
  const auto json = nlohmann::json::parse(answer_of(planned).json);
  EXPECT_EQ(json["schema"], "flyball.experiment/1");
  EXPECT_EQ(json["experiment"]["tests"].size(), 4u);
}

TEST(PlanExperiment, Errors) {
  ExperimentJob job = elevator();
  job.limits.travel_low.reset();
  EXPECT_NE(to_string(plan_experiment(job).error()).find("--travel-low"), std::string::npos);
  job = elevator();
  job.limits.travel_high = -1.0;
  EXPECT_TRUE(plan_experiment(job).error().is(ArgumentError::out_of_range));
  job = elevator();
  job.limits.voltage = 1.0;
  EXPECT_NE(to_string(plan_experiment(job).error()).find("1.3 V"), std::string::npos);
  job.limits.voltage = -1.0;
  EXPECT_TRUE(plan_experiment(job).error().is(ArgumentError::not_positive));
  job = elevator();
  job.limits.duration = 0.2;
  const auto hurried = plan_experiment(job);
  ASSERT_FALSE(hurried);
  EXPECT_NE(to_string(hurried.error()).find("duration of at least"), std::string::npos);
}

}  // namespace
}  // namespace flyball::study::experiment_test
