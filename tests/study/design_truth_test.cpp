// What a design says of itself is so: of the loop as it runs, of a kA that is not known, of a loop
// without feedback.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/control/margins.hpp>
#include <flyball/control/response_metrics.hpp>
#include <flyball/study/answer.hpp>
#include <flyball/study/simulate_design.hpp>

namespace flyball::study {
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
ResponseMetrics simulated_step(const DesignResult& design, double seconds) {
  MechanismLoop loop;
  loop.controller = controller_of(design);
  loop.controller.gains.kS = 0.0;
  loop.controller.gains.kG = 0.0;
  loop.truth.gains = loop.controller.gains;
  if (!design.job.plant.kA_determined) {
    loop.truth.gains.kA = design.job.plant.kA_upper_bound;
  }
  loop.truth.battery.resistance = 0.0;
  loop.truth.sensor.delay = Time(*design.job.controller.delay);
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
  EXPECT_NE(text.find("DelayPredictor"), std::string::npos) << text;
  EXPECT_NE(answer_of(late).document.verdict.line, "The loop is stable and robust.");
  EXPECT_FALSE(says(design(readme_elevator(0.0)).value(), "delay_costs_speed"));
  EXPECT_FALSE(says(design(readme_elevator(0.005)).value(), "delay_costs_speed"));

  // The offer that needs no other controller holds.
  DesignJob chosen = readme_elevator(0.2);
  chosen.controller.state_tolerance.clear();
  EXPECT_LT(design(chosen).value().loop.time_constant, 0.5 * late.loop.time_constant);
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
  EXPECT_NE(answer_of(result).document.verdict.line, "The loop is stable and robust.");
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

}  // namespace
}  // namespace flyball::study
