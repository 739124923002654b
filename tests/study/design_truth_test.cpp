// What a design says of itself is so: of the loop as it runs, of a kA that is not known, of a loop
// without feedback.
#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/control/margins.hpp>
#include <flyball/control/response_metrics.hpp>
#include <flyball/study/answer.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/simulate_design.hpp>

namespace flyball::study::design_truth_test {
namespace {

using mechanisms::MechanismKind;

/// The elevator of the README: 2 NEO, 10:1, 8 kg on a drum of an inch.
DesignJob readme_elevator(double delay) {
  DesignJob job;
  job.plant.kind = MechanismKind::elevator;
  job.plant.unit = "m";
  job.plant.gains = {.kS = 0.0, .kV = 7.81208, .kA = 0.0468923, .kG = 0.459856};
  job.controller.state_tolerance = {0.02, 0.4};
  job.controller.delay = delay;
  return job;
}

bool says(const DesignResult& result, std::string_view code) {
  return std::any_of(result.diagnostics.begin(), result.diagnostics.end(),
                     [&](const Diagnostic& d) { return d.code == code; });
}

/// All that is said under a code.
std::string told(const DesignResult& result, std::string_view code) {
  std::string all;
  for (const Diagnostic& diagnostic : result.diagnostics) {
    all += diagnostic.code == code ? diagnostic.message + "\n" : "";
  }
  return all;
}

/// A step of 1 mm of the simulated loop: no friction, no gravity, no noise, no limit reached.
ResponseMetrics simulated_step(const DesignResult& design, double seconds,
                               double delay_factor = 1.0) {
  MechanismLoop loop;
  loop.controller = controller_of(design);
  loop.controller.gains.kS = 0.0;
  loop.controller.gains.kG = 0.0;
  loop.truth.gains = loop.controller.gains;
  if (!design.job.plant.kA_determined) {
    loop.truth.gains.kA = design.job.plant.kA_upper_bound;
  }
  loop.truth.battery.resistance = 0.0;
  loop.truth.sensor.delay = Time(delay_factor * *design.job.controller.delay);
  const double step = 1e-3;
  loop.reference.assign(static_cast<std::size_t>(seconds / 0.02), MotionState{step, 0.0, 0.0});
  const auto response = simulate_mechanism(loop).value();
  return response_metrics(response.series.time(), *response.series.find("position"), step).value();
}

// 200 ms: the eigenvalues are those of the loop that runs (0.9931, 2.9 s), not of the undelayed
// design (0.6768, 51 ms), and the step's numbers those of the simulated loop.
TEST(DesignTruth, TellsTheLoopThatRuns) {
  for (const double delay : {0.0, 0.02, 0.05, 0.2}) {
    const auto result = design(readme_elevator(delay)).value();
    const ResponseMetrics step = simulated_step(result, 30.0);
    ASSERT_TRUE(result.loop.settling_time);
    EXPECT_NEAR(*result.loop.settling_time, *step.settling_time, 2e-3 * *step.settling_time + 1e-6)
        << delay;
    EXPECT_NEAR(*result.loop.rise_time, *step.rise_time_10_90, 2e-3 * *step.rise_time_10_90 + 1e-6)
        << delay;
    EXPECT_NEAR(result.loop.overshoot, step.overshoot, 1e-3) << delay;
  }
  const auto late = design(readme_elevator(0.2)).value();
  EXPECT_NEAR(std::abs(late.loop.poles(0)), 0.9931, 1e-4);
  EXPECT_NEAR(late.loop.time_constant, 2.9, 0.05);
  const auto json = nlohmann::json::parse(to_json(late));
  EXPECT_EQ(json["poles"].size(), 14u);
  EXPECT_NEAR(json["poles"][0][0].get<double>(), 0.9931, 1e-4);
  EXPECT_NEAR(json["design_poles"][0][0].get<double>(), 0.6768, 1e-4);
  EXPECT_EQ(json["step"]["settling_time"].get<double>(), *late.loop.settling_time);
}

// More than half of the speed is warned of, with what would be faster; the verdict does not call
// such a loop robust. A delay that costs little is not complained of.
TEST(DesignTruth, WarnsWhereTheDelayCostsHalfOfTheSpeed) {
  const auto late = design(readme_elevator(0.2)).value();
  const std::string text = told(late, "delay_costs_speed");
  EXPECT_NE(text.find("98 %"), std::string::npos) << text;
  EXPECT_NE(text.find("leave controller.state_tolerance out"), std::string::npos) << text;
  EXPECT_NE(text.find("set controller.predict_delay = true (--predict-delay)"), std::string::npos)
      << text;
  EXPECT_NE(answer_of(late).document.verdict.tone, Tone::good);
  EXPECT_FALSE(says(design(readme_elevator(0.0)).value(), "delay_costs_speed"));
  EXPECT_FALSE(says(design(readme_elevator(0.005)).value(), "delay_costs_speed"));

  // The offer that needs no other controller holds.
  DesignJob chosen = readme_elevator(0.2);
  chosen.controller.state_tolerance.clear();
  EXPECT_LT(design(chosen).value().loop.time_constant, 0.5 * late.loop.time_constant);
}

/// The README's elevator 200 ms late, predicting.
DesignJob predicting_elevator(double delay = 0.2) {
  DesignJob job = readme_elevator(delay);
  job.controller.predict_delay = true;
  return job;
}

// A delay that is predicted over costs no speed: the loop has the poles of the design without delay
// and of the observer, and poles at 0; its step is that of the simulated loop. Whole periods or
// not.
TEST(DesignTruth, APredictedDelayLeavesThePolesOfNoDelay) {
  for (const double delay : {0.2, 0.05, 0.013}) {
    SCOPED_TRACE(delay);
    const auto result = design(predicting_elevator(delay)).value();
    ASSERT_TRUE(result.predicts);
    EXPECT_EQ(result.K_delayed, result.K);
    // Poles at 0 in one block are told to within a root of the rounding; the sums of powers, of
    // which as many as there are poles determine them, do not suffer.
    for (int power = 1; power <= result.loop.poles.size(); ++power) {
      const auto sum = [&](const Eigen::VectorXcd& poles) {
        std::complex<double> total = 0.0;
        for (const std::complex<double>& pole : poles) {
          total += std::pow(pole, power);
        }
        return total;
      };
      EXPECT_LT(std::abs(sum(result.loop.poles) - sum(result.poles) - sum(result.estimator_poles)),
                1e-8)
          << power;
    }
    EXPECT_NEAR(std::abs(result.loop.poles(0)), 0.6768, 1e-4);
    EXPECT_FALSE(says(result, "delay_costs_speed"));

    const ResponseMetrics step = simulated_step(result, 30.0);
    EXPECT_NEAR(*result.loop.settling_time, *step.settling_time, 2e-3 * *step.settling_time + 1e-6);
    EXPECT_NEAR(*result.loop.rise_time, *step.rise_time_10_90, 2e-3 * *step.rise_time_10_90 + 1e-6);
    EXPECT_NEAR(result.loop.overshoot, step.overshoot, 1e-3);
  }
}

// What the warning offers is what the design then is: much faster than the 2.9 s, comfortable, and
// simulated with a delay that is off by 25 % it does what the grid says.
TEST(DesignTruth, APredictingDesignBearsADelayThatIsOff) {
  DesignJob job = predicting_elevator();
  job.controller.state_tolerance.clear();
  const auto result = design(job).value();
  EXPECT_LT(result.loop.time_constant, 0.5);
  EXPECT_LT(*result.loop.settling_time, 1.0);
  EXPECT_TRUE(result.robust);
  EXPECT_GE(result.margins.gain_margin, 2.0);
  EXPECT_GE(result.margins.phase_margin, 0.25 * std::numbers::pi);
  EXPECT_LE(result.worst_overshoot, 0.25);
  EXPECT_EQ(answer_of(result).document.verdict.line,
            "The loop is stable, and so is every point of a grid of errors.");
  EXPECT_NE(told(result, "assumed").find("±25 % of the delay"), std::string::npos);

  ASSERT_EQ(result.robustness.size(), 27u);
  double worst = 0.0;
  for (const RobustnessPoint& point : result.robustness) {
    if (point.delay_factor != 1.0) {
      const double overshoot = simulated_step(result, 30.0, point.delay_factor).overshoot;
      EXPECT_NEAR(overshoot, point.overshoot, 2e-3) << point.delay_factor;
      worst = std::max(worst, overshoot);
    }
  }
  EXPECT_GT(worst, 0.0);
}

// A step that holds the voltage at its limit for many delays ends as a small one does.
TEST(DesignTruth, APredictingDesignDoesNotWindUp) {
  const auto result = design(predicting_elevator()).value();
  MechanismLoop loop;
  loop.controller = controller_of(result);
  loop.truth.gains = loop.controller.gains;
  loop.truth.battery.resistance = 0.0;
  loop.truth.battery.open_circuit_voltage = 9.0;
  loop.truth.sensor.delay = Time(0.2);
  loop.reference.assign(300, MotionState{2.0, 0.0, 0.0});
  const auto response = simulate_mechanism(loop).value();
  EXPECT_GT(response.saturated_fraction, 0.2);
  const auto step =
      response_metrics(response.series.time(), *response.series.find("position"), 2.0).value();
  EXPECT_LT(step.overshoot, 0.005);
  EXPECT_LT(std::abs(response.final_error), 1e-4);
}

// kA from 0 to its bound, and no feedback to predict for.
TEST(DesignTruth, APredictingDesignIsCheckedOverAnUnknownKA) {
  DesignJob job = predicting_elevator(0.1);
  job.plant.gains = {.kS = 0.15, .kV = 4.0, .kG = 0.6};
  job.plant.kA_determined = false;
  job.plant.kA_upper_bound = 0.5;
  job.controller.state_tolerance.clear();
  const auto result = design(job).value();
  EXPECT_EQ(result.robustness.size(), 35u);
  EXPECT_TRUE(result.robust);
  EXPECT_LE(result.worst_overshoot, 0.25);
  EXPECT_GE(result.margins.phase_margin, 0.25 * std::numbers::pi);
  for (const RobustnessPoint& point : result.robustness) {
    if (point.kA == 0.5 && point.gain_factor == 1.0) {
      EXPECT_NEAR(simulated_step(result, 60.0, point.delay_factor).overshoot, point.overshoot, 2e-3)
          << point.delay_factor;
    }
  }
}

// Other tools cannot predict: their gains are those of the design that does not.
TEST(DesignTruth, PastedGainsDoNotPredict) {
  const auto predicts = design(predicting_elevator()).value();
  DesignJob plain = readme_elevator(0.2);
  plain.controller.state_tolerance.clear();
  const auto compensated = design(plain).value();
  ASSERT_EQ(predicts.paste.size(), compensated.paste.size());
  EXPECT_EQ(predicts.paste[0].kP, compensated.paste[0].kP);
  EXPECT_TRUE(says(predicts, "paste_without_prediction"));
  EXPECT_FALSE(says(compensated, "paste_without_prediction"));
}

TEST(DesignTruth, APredictionHasItsBounds) {
  EXPECT_TRUE(says(design(predicting_elevator(0.0)).value(), "not_used"));
  const auto refused = design(predicting_elevator(1.5));
  ASSERT_FALSE(refused);
  EXPECT_EQ(
      to_string(refused.error()),
      "design: controller.delay is 1.5 s with controller.predict_delay; it must be at most 50 "
      "periods, 1 s, to be predicted over; leave controller.predict_delay out, or lengthen the "
      "period");
}

DesignJob unknown_kA_elevator() {
  DesignJob job = readme_elevator(0.02);
  job.plant.gains = {.kS = 0.15, .kV = 4.0, .kG = 0.6};
  job.plant.kA_determined = false;
  job.plant.kA_upper_bound = 0.5;
  job.controller.state_tolerance.clear();
  return job;
}

// Checked from no inertia to the upper bound: a heavier mechanism overshoots more, and the margins
// are those of the worst.
TEST(DesignTruth, ChecksAnUnknownKAUpToItsBound) {
  const auto result = design(unknown_kA_elevator()).value();
  EXPECT_TRUE(result.velocity_servo);
  ASSERT_EQ(result.robustness.size(), 25u);
  double lightest = INFINITY;
  double heaviest = 0.0;
  for (const RobustnessPoint& point : result.robustness) {
    EXPECT_TRUE(std::isnan(point.inertia_factor));
    if (point.gain_factor == 1.0) {
      lightest = point.kA == 0.0 ? point.overshoot : lightest;
      heaviest = point.kA == 0.5 ? point.overshoot : heaviest;
    }
  }
  EXPECT_GT(heaviest, lightest);
  EXPECT_NEAR(simulated_step(result, 30.0).overshoot, heaviest, 1e-3);
  EXPECT_NEAR(result.loop.overshoot, heaviest, 1e-12);

  // What `assumed` claims was achieved at the bound, too: the same K on the known mechanism.
  EXPECT_NE(told(result, "assumed").find("phase margin of 45°"), std::string::npos);
  EXPECT_GE(result.margins.phase_margin, 0.25 * std::numbers::pi);
  const PlantDescription& plant = result.job.plant;
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 0.0, -plant.gains.kV / plant.kA_upper_bound;
  const auto opened = observer_regulator_loop(
      A, Eigen::Vector2d(0.0, 1.0 / plant.kA_upper_bound), Eigen::RowVector2d(1.0, 0.0),
      {result.A, result.B, result.C, Eigen::MatrixXd::Zero(1, 1), Time(0.02)}, result.K_delayed,
      result.kalman_gain, Time(0.02));
  const auto margins = stability_margins(opened.value()).value();
  EXPECT_GE(margins.phase_margin, 45.0);
  EXPECT_LE(result.margins.phase_margin * 180.0 / std::numbers::pi, margins.phase_margin + 1e-9);
  EXPECT_LE(result.margins.gain_margin, margins.gain_margin_up + 1e-9);
}

// Volts everywhere, and the grid by kA.
TEST(DesignTruth, AnUnknownKAIsToldInVolts) {
  const auto result = design(unknown_kA_elevator()).value();
  const auto json = nlohmann::json::parse(to_json(result));
  EXPECT_EQ(json["input"], "voltage");
  EXPECT_TRUE(json["robustness"]["grid"][0]["inertia_factor"].is_null());
  EXPECT_EQ(json["robustness"]["grid"][24]["kA"], 0.5);
  bool volts = false;
  for (const Section& section : answer_of(result).document.sections) {
    for (const Block& block : section.blocks) {
      if (const auto* facts = std::get_if<Facts>(&block)) {
        for (const Facts::Fact& fact : facts->facts) {
          EXPECT_EQ(fact.value.text.find("m/s per unit"), std::string::npos);
          volts = volts ||
                  (fact.name == "units" && fact.value.text.starts_with("K and B⁺: V per unit"));
        }
      }
    }
  }
  EXPECT_TRUE(volts);
}

TEST(DesignTruth, AKAWithoutABoundIsWarnedOf) {
  DesignJob job = unknown_kA_elevator();
  job.plant.kA_upper_bound = 0.0;
  const auto result = design(job).value();
  EXPECT_TRUE(says(result, "kA_not_bounded"));
  EXPECT_NE(answer_of(result).document.verdict.tone, Tone::good);
}

// A flywheel without kA, and one that is much faster than its period: no feedback, which is said
// with its reason, and no margins.
TEST(DesignTruth, SaysThatThereIsNoFeedbackAndWhy) {
  DesignJob unknown;
  unknown.plant.kind = MechanismKind::flywheel;
  unknown.plant.gains = {.kS = 0.2, .kV = 0.02};
  unknown.plant.kA_determined = false;
  unknown.plant.kA_upper_bound = 0.001;
  unknown.controller.delay = 0.0;
  DesignJob quick = unknown;
  quick.plant.kA_determined = true;
  quick.plant.gains.kA = 0.02 * 0.001;  // 1 ms
  DesignJob loose = unknown;
  loose.plant.kA_determined = true;
  loose.plant.gains.kA = 0.004;
  loose.controller.state_tolerance = {1e6};
  const std::pair<DesignJob, std::string> cases[] = {{unknown, "kA is not known"},
                                                     {quick, "time constant of 1 ms"},
                                                     {loose, "the tolerances ask"}};
  for (const auto& [job, reason] : cases) {
    const auto result = design(job).value();
    EXPECT_FALSE(result.feedback) << reason;
    EXPECT_NE(told(result, "no_feedback").find(reason), std::string::npos)
        << told(result, "no_feedback");
    EXPECT_EQ(told(result, "assumed").find("stiffest"), std::string::npos);
    const auto json = nlohmann::json::parse(to_json(result));
    EXPECT_EQ(json["feedback"], false);
    EXPECT_TRUE(json["margins"]["gain_margin"].is_null());
    const Document document = answer_of(result).document;
    EXPECT_TRUE(document.verdict.line.starts_with("Feedforward alone"));
    for (const Section& section : document.sections) {
      if (section.title == "Robustness") {
        ASSERT_EQ(section.blocks.size(), 1u);
        EXPECT_NE(std::get<Paragraph>(section.blocks[0]).text.find(reason), std::string::npos);
      }
    }
  }
  DesignJob with = loose;
  with.controller.state_tolerance.clear();
  EXPECT_TRUE(design(with).value().feedback);
}

// Compensation of a long delay leaves nothing of a gain: that is the reason, and not the tolerances
// nor the mechanism, whatever rounding leaves of K. What the delay costs is told, and the gain that
// makes no difference is none.
TEST(DesignTruth, ADelayThatLeavesNoFeedbackIsTheReason) {
  for (const double delay : {1.0, 2.0, 2.5}) {
    SCOPED_TRACE(delay);
    const auto result = design(readme_elevator(delay));
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_FALSE(result->feedback);
    EXPECT_NE(result->no_feedback.find("compensating a delay"), std::string::npos)
        << result->no_feedback;
    EXPECT_TRUE(result->K_delayed.isZero(0.0));
    EXPECT_TRUE(result->robust);
    const std::string cost = told(*result, "delay_costs_speed");
    EXPECT_NE(cost.find("costs all of the feedback"), std::string::npos) << cost;
    // Longer than forty periods, the way to an offer is told.
    EXPECT_NE(cost.find("set controller.period to"), std::string::npos) << cost;
    const Document document = answer_of(*result).document;
    EXPECT_EQ(document.verdict.tone, Tone::caution);
  }
  DesignJob wheel;
  wheel.plant.kind = MechanismKind::flywheel;
  wheel.plant.gains = {.kS = 0.2, .kV = 0.02, .kA = 0.01};
  wheel.controller.state_tolerance = {5.0};
  wheel.controller.delay = 0.2;
  const auto result = design(wheel).value();
  EXPECT_FALSE(result.feedback);
  EXPECT_NE(result.no_feedback.find("compensating a delay"), std::string::npos)
      << result.no_feedback;
  const std::string cost = told(result, "delay_costs_speed");
  EXPECT_NE(cost.find("--predict-delay"), std::string::npos) << cost;
  // What a team pastes says so, too: loops and constants of each language.
  int files = 0;
  for (const auto& file : answer_of(result).files) {
    if (file.name.starts_with("constants/wpilib") || file.name.ends_with("Loop.hpp") ||
        file.name.ends_with("Loop.java")) {
      ++files;
      EXPECT_NE(file.contents.find("There is no feedback"), std::string::npos) << file.name;
    }
  }
  EXPECT_GE(files, 3);
}

// A delay of many periods of a fast loop is predicted over as well as one of few.
TEST(DesignTruth, ADelayOfManyPeriodsIsOfferedAPrediction) {
  DesignJob job = readme_elevator(0.2);
  job.controller.period = 0.006;
  const std::string cost = told(design(job).value(), "delay_costs_speed");
  EXPECT_NE(cost.find("--predict-delay"), std::string::npos) << cost;
}

// A slow observer has the slowest eigenvalue with and without the delay: the step tells the cost.
TEST(DesignTruth, ACostThatOnlyTheStepShowsIsTold) {
  DesignJob job = readme_elevator(0.2);
  job.estimator.measurement_std = 0.2;
  const auto late = design(job).value();
  job.controller.delay = 0.0;
  const auto prompt = design(job).value();
  ASSERT_LT(late.loop.time_constant, 2.0 * prompt.loop.time_constant);
  ASSERT_GT(*late.loop.rise_time, 10.0 * *prompt.loop.rise_time);
  const std::string cost = told(late, "delay_costs_speed");
  EXPECT_NE(cost.find("a small step rises within"), std::string::npos) << cost;
}

// A design of the gains.toml of a log that does not determine kA is checked up to the log's bound.
TEST(DesignTruth, TheBoundOfKAGoesWithTheGains) {
  const auto first = design(unknown_kA_elevator()).value();
  const std::string path =
      (std::filesystem::temp_directory_path() / "flyball_design_truth_gains.toml").string();
  std::ofstream(path) << gains_toml(first, nullptr);
  const auto project = read_project(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(project) << to_string(project.error());
  EXPECT_FALSE(project->job.plant.kA_determined);
  EXPECT_EQ(project->job.plant.kA_upper_bound, first.job.plant.kA_upper_bound);
  const auto again = design(project->job).value();
  EXPECT_EQ(again.worst_overshoot, first.worst_overshoot);
  EXPECT_FALSE(says(again, "kA_not_bounded"));
}

}  // namespace
}  // namespace flyball::study::design_truth_test
