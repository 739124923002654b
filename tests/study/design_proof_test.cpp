#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/control/running_loop.hpp>
#include <flyball/study/answer.hpp>
#include <flyball/study/design.hpp>

#include "study/design_steps.hpp"

namespace flyball::study::design_proof_test {
namespace {

using mechanisms::MechanismKind;

DesignJob elevator_job() {
  DesignJob job;
  job.plant.kind = MechanismKind::elevator;
  job.plant.unit = "m";
  job.plant.gains = {.kS = 0.15, .kV = 4.0, .kA = 0.3, .kG = 0.6};
  job.controller.delay = 0.010;
  return job;
}

/// The disk margin of the designed loop on a mechanism with other gains.
StabilityMargins margins_with(const DesignResult& result, double kV, double kA, double gain) {
  Eigen::MatrixXd A{{0.0, 1.0}, {0.0, -kV / kA}};
  Eigen::MatrixXd B{{0.0}, {gain / kA}};
  const DiscreteSystem<> model{result.A, result.B, result.C, Eigen::MatrixXd::Zero(1, 1),
                               Time(result.job.controller.period)};
  const auto loop =
      observer_regulator_loop(A, B, Eigen::MatrixXd{{1.0, 0.0}}, model, result.K_delayed,
                              result.kalman_gain, Time(*result.job.controller.delay));
  return stability_margins(loop.value()).value();
}

// The rectangle of the grid, whole: no point of a grid that is ten times finer has a smaller margin
// than is shown, and the worst that is named has what is said of it.
TEST(DesignProof, HoldsBetweenThePointsOfTheGrid) {
  const auto result = design(elevator_job()).value();
  ASSERT_EQ(result.proofs.size(), 1u);
  const PlantProof& proof = result.proofs.front();
  EXPECT_EQ(proof.of, "errors");
  ASSERT_EQ(proof.certificate.verdict, LoopVerdict::stable);
  EXPECT_GT(proof.certificate.disk_margin, 0.3);
  double least = 2.0;
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 20; ++j) {
      const auto margins = margins_with(result, 4.0, 0.3 * (0.8 + 0.02 * i), 0.8 + 0.02 * j);
      EXPECT_LT(margins.spectral_radius, proof.certificate.decay);
      least = std::min(least, margins.disk_margin);
    }
  }
  EXPECT_GE(least, proof.certificate.disk_margin);
  EXPECT_NEAR(least, proof.certificate.worst.disk_margin, 1e-5);
  const Eigen::VectorXd& p = proof.certificate.worst.parameters;
  EXPECT_NEAR(margins_with(result, p(0), p(1), p(2)).disk_margin,
              proof.certificate.worst.disk_margin, 1e-5);

  const Answer answer = answer_of(result);
  EXPECT_TRUE(
      answer.document.verdict.line.starts_with("The loop is proven stable for every mechanism with "
                                               "an inertia and a gain within ±20 % of the "
                                               "model's."))
      << answer.document.verdict.line;
  const auto json = nlohmann::json::parse(answer.json);
  const auto& told = json["robustness"]["proofs"][0];
  EXPECT_EQ(told["verdict"], "stable");
  EXPECT_EQ(told["disk_margin"].get<double>(), proof.certificate.disk_margin);
  EXPECT_NEAR(told["worst"]["kA"].get<double>(), p(1), 0.0);
}

// Gains with a covariance: the ellipsoid of √5.99 = 2.45 standard errors, whose margins are those
// on its surface; of strongly correlated gains it leaves out the corners of the box about it.
TEST(DesignProof, IsOfTheGainsThatALogLeavesOpen) {
  DesignJob job = elevator_job();
  const double joint = std::sqrt(5.991464547107979);
  for (const double correlation : {0.0, 0.95, -0.95}) {
    job.plant.spread = PlantSpread{};
    Eigen::Matrix3d& covariance = job.plant.spread->covariance;
    covariance(0, 0) = 0.02 * 0.02;
    covariance(1, 1) = 0.08 * 0.08;
    covariance(0, 1) = covariance(1, 0) = correlation * 0.02 * 0.08;
    const auto result = design(job).value();
    ASSERT_EQ(result.proofs.size(), 2u);
    const PlantProof& proof = result.proofs.back();
    EXPECT_EQ(proof.of, "identified");
    EXPECT_EQ(proof.set, "a kV and a kA of the log's joint 95 % set");
    ASSERT_EQ(proof.certificate.verdict, LoopVerdict::stable);
    double least = 2.0;
    for (int k = 0; k < 72; ++k) {
      const double turn = k * std::acos(-1.0) / 36.0;
      const double kV = joint * 0.02 * std::cos(turn);
      const double kA = joint * 0.08 *
                        (correlation * std::cos(turn) +
                         std::sqrt(1.0 - correlation * correlation) * std::sin(turn));
      least = std::min(least,
                       margins_with(result, 4.0 * (1.0 + kV), 0.3 * std::exp(kA), 1.0).disk_margin);
    }
    EXPECT_GE(least, proof.certificate.disk_margin);
    EXPECT_NEAR(least, proof.certificate.worst.disk_margin, 1e-3);
    EXPECT_NE(answer_of(result).document.verdict.line.find("joint 95 % set"), std::string::npos);
  }
}

// A delay that the log tells with an error, correlated with kA as both slow a step down.
TEST(DesignProof, IsOfTheDelayThatALogLeavesOpen) {
  DesignJob job = elevator_job();
  job.plant.spread = PlantSpread{};
  job.plant.spread->covariance << 1e-4, 0.0, 0.0, 0.0, 9e-4, -5e-5, 0.0, -5e-5, 4e-6;
  const auto result = design(job).value();
  const PlantProof& proof = result.proofs.back();
  EXPECT_EQ(proof.set, "a kV, a kA and a delay of the log's joint 95 % set");
  ASSERT_EQ(proof.certificate.verdict, LoopVerdict::stable);
  // The longest delay of the set is √7.81 = 2.80 standard errors more.
  const Eigen::VectorXd& worst = proof.certificate.worst.parameters;
  EXPECT_LE(worst(3), 0.010 + 2.7955 * 0.002);
  const DiscreteSystem<> model{result.A, result.B, result.C, Eigen::MatrixXd::Zero(1, 1),
                               Time(0.02)};
  for (const double z : {-1.0, 1.0}) {
    // The ends of the ellipsoid's delay, with the kA that goes with each.
    const double kA = 0.3 * std::exp(-2.7955 * z * 5e-5 / 0.002);
    const auto loop = observer_regulator_loop(Eigen::MatrixXd{{0.0, 1.0}, {0.0, -4.0 / kA}},
                                              Eigen::MatrixXd{{0.0}, {1.0 / kA}},
                                              Eigen::MatrixXd{{1.0, 0.0}}, model, result.K_delayed,
                                              result.kalman_gain, Time(0.010 + 2.7954 * z * 0.002));
    EXPECT_GE(stability_margins(loop.value()).value().disk_margin, proof.certificate.disk_margin);
  }
}

TEST(DesignProof, AnUnknownInertiaIsAnythingUpToItsBound) {
  DesignJob job = elevator_job();
  job.plant.gains.kA = 0.0;
  job.plant.kA_determined = false;
  job.plant.kA_upper_bound = 0.05;
  const auto result = design(job).value();
  ASSERT_EQ(result.proofs.size(), 1u);
  EXPECT_NE(result.proofs.front().set.find("a kA from 0 to 0.05 V·s²/m"), std::string::npos);
  EXPECT_EQ(result.proofs.front().certificate.verdict, LoopVerdict::stable);
}

// A set with an unstable member, as a certificate tells it: the mechanism is named, and the verdict
// is not to run it.
TEST(DesignProof, NamesTheMechanismThatBreaksTheLoop) {
  auto result = design(elevator_job()).value();
  result.proofs.front().certificate.verdict = LoopVerdict::unstable;
  const Verdict verdict = answer_of(result).document.verdict;
  EXPECT_EQ(verdict.tone, Tone::bad);
  EXPECT_EQ(verdict.line, "Do not run this controller as it is.");
  EXPECT_NE(verdict.reasons.front().find("is one whose loop is unstable: kV 4 V·s/m, kA "),
            std::string::npos)
      << verdict.reasons.front();
  result.proofs.front().certificate.verdict = LoopVerdict::undecided;
  EXPECT_EQ(answer_of(result).document.verdict.tone, Tone::caution);
}

// Ten periods of delay, predicted over, are twenty-five states: that no proof was tried is said,
// and the verdict speaks of the grid.
TEST(DesignProof, ManyStatesAreNotTried) {
  DesignJob job = elevator_job();
  job.controller.delay = 0.2;
  job.controller.predict_delay = true;
  const auto result = design(job).value();
  ASSERT_EQ(result.proofs.size(), 2u);
  EXPECT_EQ(result.proofs.back().of, "delays");
  EXPECT_FALSE(result.proofs.front().tried);
  EXPECT_GT(result.proofs.front().states, 20);
  const Answer answer = answer_of(result);
  EXPECT_EQ(answer.document.verdict.line.find("proven"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(answer.json)["robustness"]["proofs"][0]["verdict"], "not_tried");
}

}  // namespace
}  // namespace flyball::study::design_proof_test
