// Noises by maximum likelihood: the likelihood is the smoother's, its gradient is its difference,
// the fit finds what made the record, and says what the record does not tell.
#include <flyball/estimation/noise_fit.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/smoother.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball::noise_fit_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

MatrixXd normals(Random& random, Index rows, Index columns) {
  MatrixXd M(rows, columns);
  for (double& entry : M.reshaped()) {
    entry = random.normal();
  }
  return M;
}

/// Three states, two noises of rank one (their sum is singular), two outputs, entries missing.
NoiseRecord random_record(unsigned long long seed) {
  Random random(seed);
  NoiseRecord record{normals(random, 3, 1), MatrixXd::Identity(3, 3), {}};
  for (int k = 0; k < 40; ++k) {
    NoiseStep step;
    step.A = 0.5 * normals(random, 3, 3);
    step.input = k % 3 == 0 ? VectorXd() : VectorXd(normals(random, 3, 1));
    for (int i = 0; k > 0 && i < 2; ++i) {
      const MatrixXd g = normals(random, 3, 1);
      step.G.push_back(g * g.transpose());
    }
    step.C = normals(random, 2, 3);
    step.y = 2.0 * normals(random, 2, 1);
    if (k % 5 == 1) {
      step.y(k % 2) = nan;
    }
    if (k % 7 == 3) {
      step.y.setConstant(nan);
    }
    record.steps.push_back(step);
  }
  return record;
}

/// A random walk of σ = 0.5 a second, seen each 0.1 s with ρ = 0.2: the local level model.
NoiseRecord walk(int samples, double sigma, double rho, unsigned long long seed = 1) {
  Random random(seed);
  const MatrixXd one = MatrixXd::Identity(1, 1);
  NoiseRecord record{VectorXd::Zero(1), 100.0 * one, {}};
  double x = 1.0;
  for (int k = 0; k < samples; ++k) {
    NoiseStep step{one, {}, {}, one, VectorXd(1)};
    if (k > 0) {
      step.G = {0.1 * one};
      x += sigma * std::sqrt(0.1) * random.normal();
    }
    step.y(0) = x + rho * random.normal();
    record.steps.push_back(step);
  }
  return record;
}

VectorXd vector(std::initializer_list<double> values) {
  VectorXd made(static_cast<Index>(values.size()));
  std::copy(values.begin(), values.end(), made.begin());
  return made;
}

TEST(NoiseLikelihood, IsTheSmoothersLikelihood) {
  const NoiseRecord record = random_record(3);
  const VectorXd process = vector({0.7, 0.3});
  const VectorXd measurement = vector({0.5, 1.2});
  std::vector<LinearStep> steps;
  for (const NoiseStep& step : record.steps) {
    LinearStep made{step.A, step.input, MatrixXd::Zero(3, 3), step.C, {}, step.y};
    for (std::size_t i = 0; i < step.G.size(); ++i) {
      made.Q += std::pow(process(static_cast<Index>(i)), 2.0) * step.G[i];
    }
    made.R = measurement.cwiseAbs2().asDiagonal();
    steps.push_back(made);
  }
  const auto smoothed = smooth(record.x0, record.P0, steps);
  ASSERT_TRUE(smoothed) << to_string(smoothed.error());
  const auto found = noise_likelihood({&record, 1}, process, measurement);
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR(found->log_likelihood, smoothed->log_likelihood,
              1e-10 * std::abs(smoothed->log_likelihood));
}

// Central differences of the likelihood itself: h² and rounding/h leave 1e-7 of its size.
TEST(NoiseLikelihood, ItsGradientIsExact) {
  const std::vector<NoiseRecord> records{random_record(3), random_record(4)};
  for (const VectorXd& process : {vector({0.7, 0.3}), vector({1e-3, 4.0})}) {
    const VectorXd measurement = vector({0.5, 1.2});
    const auto found = noise_likelihood(records, process, measurement);
    ASSERT_TRUE(found);
    const double h = 1e-5;
    const auto value = [&](Index i, double by) {
      VectorXd p = process;
      VectorXd m = measurement;
      (i < 2 ? p(i) : m(i - 2)) *= std::exp(by);
      return noise_likelihood(records, p, m)->log_likelihood;
    };
    for (Index i = 0; i < 4; ++i) {
      const double difference = (value(i, h) - value(i, -h)) / (2.0 * h);
      const double gradient = i < 2 ? found->by_log_process(i) : found->by_log_measurement(i - 2);
      EXPECT_NEAR(gradient, difference, 1e-7 * std::abs(found->log_likelihood)) << i;
    }
  }
}

// 2000 samples tell log σ to about 6 %, log ρ to 2 %.
TEST(NoiseFit, FindsWhatMadeTheRecordFromAfar) {
  const NoiseRecord record = walk(2000, 0.5, 0.2);
  for (const auto& [sigma, rho] : {std::pair{5.0, 0.01}, std::pair{0.01, 3.0}}) {
    const auto fit = fit_noise({&record, 1}, vector({sigma}), vector({rho}));
    ASSERT_TRUE(fit) << to_string(fit.error());
    EXPECT_TRUE(fit->converged);
    EXPECT_LE(fit->expected_gain, 1e-6);
    EXPECT_GT(fit->log_likelihood, fit->start_log_likelihood);
    EXPECT_NEAR(std::log(fit->process[0].value / 0.5), 0.0, 3.0 * fit->process[0].relative_error);
    EXPECT_NEAR(std::log(fit->measurement[0].value / 0.2), 0.0,
                3.0 * fit->measurement[0].relative_error);
    EXPECT_LT(fit->process[0].relative_error, 0.1);
    EXPECT_LT(fit->measurement[0].relative_error, 0.04);
    const auto there = noise_likelihood({&record, 1}, vector({fit->process[0].value}),
                                        vector({fit->measurement[0].value}));
    EXPECT_NEAR(there->log_likelihood, fit->log_likelihood, 1e-9 * std::abs(fit->log_likelihood));
    EXPECT_LT(std::abs(there->by_log_process(0)), 0.1);
    EXPECT_LT(std::abs(there->by_log_measurement(0)), 0.1);
  }
}

// The standard errors are those that fits to many records show: of 60, the deviation of log ρ̂ from
// log ρ in standard errors has a variance of one, within 40 % (3 √(2/60) = 0.55).
TEST(NoiseFit, ItsStandardErrorsAreRight) {
  double sum_process = 0.0;
  double sum_measurement = 0.0;
  constexpr int records = 60;
  for (int k = 0; k < records; ++k) {
    const NoiseRecord record = walk(400, 0.5, 0.2, 100U + static_cast<unsigned>(k));
    const auto fit = fit_noise({&record, 1}, vector({1.0}), vector({0.1}));
    ASSERT_TRUE(fit);
    ASSERT_TRUE(fit->converged);
    sum_process +=
        std::pow(std::log(fit->process[0].value / 0.5) / fit->process[0].relative_error, 2.0);
    sum_measurement += std::pow(
        std::log(fit->measurement[0].value / 0.2) / fit->measurement[0].relative_error, 2.0);
  }
  EXPECT_NEAR(sum_process / records, 1.0, 0.55);
  EXPECT_NEAR(sum_measurement / records, 1.0, 0.55);
}

TEST(NoiseFit, ANoiseThatIsNotThereGoesToZero) {
  const NoiseRecord record = walk(500, 0.0, 0.2);
  const auto fit = fit_noise({&record, 1}, vector({0.3}), vector({0.3}));
  ASSERT_TRUE(fit);
  EXPECT_TRUE(fit->converged);
  EXPECT_TRUE(fit->process[0].is_negligible);
  EXPECT_LT(fit->process[0].value, 0.02);
  EXPECT_TRUE(std::isinf(fit->process[0].relative_error));
  EXPECT_FALSE(fit->measurement[0].is_negligible);
  EXPECT_NEAR(fit->measurement[0].value, 0.2, 0.02);
}

// Readings that are the prediction exactly: each smaller noise is more likely.
TEST(NoiseFit, WhatVanishesEndsAtAMillionth) {
  NoiseRecord record = walk(50, 0.0, 0.0);
  record.x0(0) = 1.0;
  const auto fit = fit_noise({&record, 1}, vector({0.0}), vector({0.3}));
  ASSERT_TRUE(fit);
  EXPECT_TRUE(fit->converged);
  EXPECT_TRUE(fit->measurement[0].vanishes);
  EXPECT_NEAR(fit->measurement[0].value, 0.3e-6, 1e-12);
  EXPECT_TRUE(std::isinf(fit->measurement[0].relative_error));
}

TEST(NoiseFit, WhatIsZeroStays) {
  const NoiseRecord record = walk(300, 0.5, 0.2);
  const auto fit = fit_noise({&record, 1}, vector({0.0}), vector({0.1}));
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->process[0].value, 0.0);
  EXPECT_FALSE(fit->process[0].is_free);
  EXPECT_GT(fit->measurement[0].value, 0.2);  // it has to explain the walk
}

TEST(NoiseFit, AnHonestEndBeforeTheOptimum) {
  const NoiseRecord record = walk(500, 0.5, 0.2);
  const auto fit = fit_noise({&record, 1}, vector({5.0}), vector({0.01}), {.iterations = 2});
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->converged);
  EXPECT_GT(fit->log_likelihood, fit->start_log_likelihood);
}

TEST(NoiseFit, RefusesWhatItCannotUse) {
  NoiseRecord record = walk(10, 0.5, 0.2);
  const auto told = [&](const VectorXd& process, const VectorXd& measurement) {
    const auto fit = fit_noise({&record, 1}, process, measurement);
    return fit ? std::string("accepted") : to_string(fit.error());
  };
  EXPECT_EQ(told(vector({0.0}), vector({0.0})),
            "fit_noise: what is looked for is empty: every deviation is zero; begin with a "
            "positive one");
  EXPECT_NE(told(vector({-1.0}), vector({1.0})).find("process(0) is -1"), std::string::npos);
  EXPECT_NE(told(vector({1.0, 1.0}), vector({1.0})).find("G of step 2"), std::string::npos);
  EXPECT_FALSE(fit_noise({&record, 1}, vector({1.0}), vector({1.0}), {.iterations = 0}));
  record.P0.setZero();
  EXPECT_NE(told(vector({1.0}), vector({0.0})).find("the innovation's covariance of step 1"),
            std::string::npos)
      << told(vector({1.0}), vector({0.0}));
  record.steps[3].C.resize(1, 2);
  EXPECT_NE(told(vector({1.0}), vector({1.0})).find("C of step 4"), std::string::npos);
  for (NoiseStep& step : record.steps) {
    step.C = MatrixXd::Identity(1, 1);
    step.y(0) = nan;
  }
  EXPECT_NE(told(vector({1.0}), vector({1.0})).find("without a measurement"), std::string::npos);
}

// √F is right to third order, and so is the integral: here it errs by 0.37 dt³ of its size.
TEST(StepNoise, IsTheIntegralOfTheDensity) {
  MatrixXd A(2, 2);
  A << 0.0, 1.0, -4.0, -0.3;
  MatrixXd Q = MatrixXd::Zero(2, 2);
  Q(1, 1) = 0.09;
  for (const double dt : {0.1, 0.05}) {
    const ContinuousSystem<> system{A, MatrixXd::Zero(2, 1), MatrixXd::Identity(2, 2),
                                    MatrixXd::Zero(2, 1)};
    const auto F = discretize(system, Time(dt));
    const auto exact = discretize(A, ProcessDensity{Q}, Time(dt));
    ASSERT_TRUE(F && exact);
    const MatrixXd found = step_noise(F->A, Q, dt);
    EXPECT_LT((found - *exact).norm(), 0.5 * dt * dt * dt * exact->norm()) << dt;
  }
}

}  // namespace
}  // namespace flyball::noise_fit_test
