#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "identification/gain_fit.hpp"
#include "identification/record_noise.hpp"
#include "identification/start.hpp"
#include "scenarios.hpp"

namespace record_noise_test {
namespace {

using namespace flyball::identification;

struct Fitted {
  OutputErrorProblem problem;
  Bounds bounds;
  ChannelScales scales{};
  RobustFit fit{};

  explicit Fitted(const PreparedRecording& prepared)
      : problem(prepared, {}),
        bounds(make_bounds(problem, regress_gains(prepared).value(), {})),
        fit(fit_gains(problem, regress_gains(prepared).value(), bounds, {}, scales)) {}
};

// Rows of 5 ms with 20 mV, an encoder of 4096 steps a turn (uniform within one), a velocity with
// 0.5 % of (6 V − kS)/kV.
TEST(RecordNoise, IsThatOfTheRecord) {
  for (const std::size_t mechanism : {std::size_t{0}, std::size_t{1}, std::size_t{4}}) {
    const scenarios::Truth& truth = scenarios::mechanisms.at(mechanism);
    const auto options = scenarios::session(truth, 4);
    const PreparedRecording prepared =
        prepare(flyball::record_characterization(options).value()).value();
    Fitted fitted(prepared);
    const RecordNoise noise = estimate_record_noise(fitted.problem, fitted.fit.x, fitted.scales);
    // A disturbance of short memory may take a part of it.
    EXPECT_LT(noise.voltage, 1.25 * 0.02 * std::sqrt(5e-3)) << truth.name;
    EXPECT_GT(noise.voltage, 0.5 * 0.02 * std::sqrt(5e-3)) << truth.name;
    const double quantum = options.resolution / std::sqrt(12.0);
    EXPECT_NEAR(noise.position, quantum, 0.15 * quantum) << truth.name;
    const double velocity = 0.005 * (6.0 - truth.kS) / truth.kV;
    EXPECT_NEAR(noise.velocity, velocity, 0.25 * velocity) << truth.name;
  }
}

// A coupling that slips in a ramp and was not put back: neither the positions nor the voltage are
// noisier for it.
TEST(RecordNoise, ALeapIsNoNoise) {
  const auto options = scenarios::session(scenarios::mechanisms.at(4), 4);
  PreparedRecording prepared = prepare(flyball::record_characterization(options).value()).value();
  std::vector<double>& position = prepared.runs.at(0).run.position;
  for (std::size_t row = position.size() / 2; row < position.size(); ++row) {
    position[row] += 0.05;
  }
  Fitted fitted(prepared);
  const RecordNoise noise = estimate_record_noise(fitted.problem, fitted.fit.x, fitted.scales);
  const double quantum = options.resolution / std::sqrt(12.0);
  EXPECT_NEAR(noise.position, quantum, 0.25 * quantum);
  EXPECT_LT(noise.voltage, 1.5 * 0.02 * std::sqrt(5e-3));
}

// What other voltages of that noise make of the gains, against what is carried through: 30 fits'
// spread is within 40 % of its expectation but once in 500.
TEST(RecordNoise, IsCarriedThroughToTheGains) {
  for (const std::size_t mechanism : {std::size_t{0}, std::size_t{3}}) {
    const auto options = scenarios::session(scenarios::mechanisms.at(mechanism), 4);
    PreparedRecording prepared = prepare(flyball::record_characterization(options).value()).value();
    prepared.position_quantum = 0.0;  // where an encoder rests within its step is no voltage's
    Fitted fitted(prepared);
    const Eigen::VectorXd& x = fitted.fit.x;
    const std::vector<bool> free = fitted.problem.free_parameters();
    RecordNoise noise;
    noise.voltage = 1e-3 * std::sqrt(5e-3);
    noise.position = noise.velocity = 0.0;
    const Covariances spread = covariances(fitted.problem, x, free, fitted.bounds, fitted.scales);
    const Eigen::MatrixXd C = spread.independent *
                              score_covariance(fitted.problem, x, free, fitted.scales, noise) *
                              spread.independent;
    flyball::Random random(9);
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();
    constexpr int fits = 30;
    for (int k = 0; k < fits; ++k) {
      PreparedRecording other = prepared;
      for (PreparedRun& run : other.runs) {
        for (double& voltage : run.run.voltage) {
          voltage += 1e-3 * random.normal();
        }
      }
      OutputErrorProblem problem(other, {});
      problem.refresh_forces(x);
      const RobustFit fit = minimize(problem, x, free, fitted.bounds, fitted.scales, 50, 1e-7);
      squares += (fit.x - x).head<3>().cwiseAbs2();
    }
    for (const Eigen::Index gain : {0, 1, 2}) {
      const double found = std::sqrt(squares[gain] / fits);
      EXPECT_NEAR(found, std::sqrt(C(gain, gain)), 0.4 * std::sqrt(C(gain, gain)))
          << mechanism << " " << gain;
    }
  }
}

// Steps' shares of the sensors' age make their mean the delay.
TEST(RecordNoise, StepsAgesSumToNothing) {
  const PreparedRecording prepared =
      prepare(
          flyball::record_characterization(scenarios::session(scenarios::mechanisms[2], 6)).value())
          .value();
  Fitted fitted(prepared);
  ASSERT_EQ(fitted.problem.ages().size(), 2U);
  double sum = 0.0;
  double largest = 0.0;
  for (const Eigen::Index age : fitted.problem.ages()) {
    sum += fitted.fit.x[age];
    largest = std::max(largest, std::abs(fitted.fit.x[age]));
  }
  EXPECT_LT(std::abs(sum), 1e-5);
  EXPECT_GT(largest, 5e-5);  // else there was nothing to sum
}

}  // namespace
}  // namespace record_noise_test
