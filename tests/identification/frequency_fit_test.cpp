#include <flyball/identification/frequency_fit.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/identification/identification_error.hpp>

#include "support/oracle.hpp"

namespace flyball::identification::frequency_fit_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

template <class System>
MatrixXcd at(const System& system, Complex s) {
  const Index n = system.A.rows();
  const MatrixXcd resolvent = s * MatrixXcd::Identity(n, n) - system.A.template cast<Complex>();
  return system.C.template cast<Complex>() *
             test::solve(resolvent, MatrixXcd(system.B.template cast<Complex>())) +
         system.D.template cast<Complex>();
}

VectorXd logarithmic(double low, double high, Index count) {
  VectorXd frequency(count);
  for (Index k = 0; k < count; ++k) {
    frequency(k) =
        low * std::pow(high / low, static_cast<double>(k) / static_cast<double>(count - 1));
  }
  return frequency;
}

ContinuousSystem<> plant(Random& random, Index poles, Index m, Index p, double speed) {
  ContinuousSystem<> system{MatrixXd::Zero(poles, poles), MatrixXd(poles, m), MatrixXd(p, poles),
                            MatrixXd(p, m)};
  for (Index i = 0; i < poles; i += 2) {
    const double size = speed * std::pow(10.0, random.uniform(0.0, 2.0));
    if (i + 1 < poles) {
      const double damping = random.uniform(0.05, 0.9);
      system.A.block(i, i, 2, 2) << 0.0, size, -size, -2.0 * damping * size;
    } else {
      system.A(i, i) = -size;
    }
  }
  for (MatrixXd* M : {&system.B, &system.C, &system.D}) {
    for (Index i = 0; i < M->size(); ++i) {
      (*M)(i) = random.normal();
    }
  }
  system.B *= speed;
  return system;
}

// A rational response is found again, to rounding, at any speed and size.
TEST(FrequencyFit, ExactResponses) {
  Random random(1);
  for (int trial = 0; trial < 40; ++trial) {
    const Index poles = 1 + trial % 7;
    const Index m = 1 + trial % 2;
    const Index p = trial % 3 == 0 ? 2 : 1;
    const double speed = trial % 2 == 0 ? 1.0 : 1e4;
    const ContinuousSystem<> truth = plant(random, poles, m, p, speed);
    const VectorXd frequency = logarithmic(0.1 * speed, 1e3 * speed, 120);
    std::vector<MatrixXcd> response;
    for (const double w : frequency) {
      response.push_back(at(truth, {0.0, w}));
    }
    FrequencyFitOptions options;
    options.poles = poles;
    const auto fit = fit_frequency_response(frequency, response, options);
    ASSERT_TRUE(fit) << to_string(fit.error());
    EXPECT_LT(fit->error, 1e-9) << trial;
    EXPECT_EQ(fit->system.A.rows(), poles * std::min(m, p));
    for (Index k = 0; k < frequency.size(); k += 17) {
      const MatrixXcd G = response[static_cast<std::size_t>(k)];
      EXPECT_LT((at(fit->system, {0.0, frequency(k)}) - G).norm(), 1e-8 * G.norm()) << trial;
    }
    // Between and beyond the points, too.
    const MatrixXcd G = at(truth, {0.0, 3.33 * speed});
    EXPECT_LT((at(fit->system, {0.0, 3.33 * speed}) - G).norm(), 1e-7 * G.norm());
  }
}

TEST(FrequencyFit, OfADiscreteSystem) {
  const Time T(0.02);
  DiscreteSystem<> truth{MatrixXd(2, 2), MatrixXd(2, 1), MatrixXd(1, 2), MatrixXd(1, 1), T};
  truth.A << 0.7, 0.4, -0.4, 0.7;
  truth.B << 1.0, 0.5;
  truth.C << 0.3, -1.0;
  truth.D << 0.1;
  const VectorXd frequency = VectorXd::LinSpaced(60, 0.0, std::numbers::pi / T.si());
  std::vector<MatrixXcd> response;
  for (const double w : frequency) {
    response.push_back(at(truth, std::polar(1.0, w * T.si())));
  }
  FrequencyFitOptions options;
  options.poles = 2;
  const auto fit = fit_frequency_response(frequency, response, T, options).value();
  EXPECT_LT(fit.error, 1e-10);
  EXPECT_EQ(fit.frequencies, 59);  // The last one is the axis' end.
  EXPECT_NEAR(std::abs(fit.poles(0)), std::hypot(0.7, 0.4), 1e-9);
  EXPECT_EQ(fit.system.period.si(), 0.02);
  EXPECT_LT((at(fit.system, std::polar(1.0, 0.3)) - at(truth, std::polar(1.0, 0.3))).norm(), 1e-9);
}

// With noise the fit is a minimum of the weighted errors: every pole moved either way is worse, and
// the error is as small as the noise's share that parameters cannot take.
TEST(FrequencyFit, NoisyResponses) {
  Random random(3);
  for (int trial = 0; trial < 10; ++trial) {
    const ContinuousSystem<> truth = plant(random, 4, 1, 1, 1.0);
    const VectorXd frequency = logarithmic(0.1, 1e3, 200);
    std::vector<MatrixXcd> response;
    MatrixXd weights(200, 1);
    double noise = 0.0;
    double signal = 0.0;
    for (Index k = 0; k < 200; ++k) {
      const Complex G = at(truth, {0.0, frequency(k)})(0, 0);
      const double deviation = k % 2 == 0 ? 0.01 : 0.1;
      const Complex e(random.normal(0.0, deviation), random.normal(0.0, deviation));
      response.push_back(MatrixXcd::Constant(1, 1, G + e));
      weights(k) = 1.0 / deviation;
      noise += std::norm(e) / (deviation * deviation);
      signal += std::norm(G + e) / (deviation * deviation);
    }
    FrequencyFitOptions options;
    options.poles = 4;
    options.weights = weights;
    const auto fit = fit_frequency_response(frequency, response, options).value();
    EXPECT_LT(fit.error, std::sqrt(noise / signal)) << trial;
    EXPECT_TRUE(is_stable(fit.system).value());
  }
}

// From record to rational model: spectra, their radii as weights, and the poles of a motor.
TEST(FrequencyFit, FromARecord) {
  Random random(5);
  const Index n = 40'000;
  VectorXd u(n);
  VectorXd y(n);
  double x = 0.0;
  double v = 0.0;
  for (Index k = 0; k < n; ++k) {
    u(k) = random.normal();
    y(k) = x + random.normal(0.0, 0.05);
    const double before = x;
    x = 1.5 * x - 0.7 * v + 0.2 * u(k);
    v = before;
  }
  const Time T(0.01);
  const auto estimate = estimate_frequency_response(u, y, T, {.length = 400}).value();
  FrequencyFitOptions options;
  options.poles = 2;
  options.weights = weights_of(estimate);
  const auto fit =
      fit_frequency_response(estimate.frequency, estimate.response, T, options).value();
  // z² - 1.5 z + 0.7.
  EXPECT_NEAR(-(fit.poles(0) + fit.poles(1)).real(), -1.5, 0.01);
  EXPECT_NEAR((fit.poles(0) * fit.poles(1)).real(), 0.7, 0.01);
}

TEST(FrequencyFit, StableOrNot) {
  const VectorXd frequency = logarithmic(0.1, 100.0, 60);
  std::vector<MatrixXcd> response;
  for (const double w : frequency) {
    response.push_back(MatrixXcd::Constant(1, 1, 1.0 / (Complex(0.0, w) - 2.0)));
  }
  response[7](0, 0) = std::numeric_limits<double>::quiet_NaN();
  FrequencyFitOptions options;
  options.poles = 1;
  options.stable = false;
  const auto free = fit_frequency_response(frequency, response, options).value();
  EXPECT_NEAR(free.poles(0).real(), 2.0, 1e-9);
  EXPECT_EQ(free.frequencies, 59);
  options.stable = true;
  const auto stable = fit_frequency_response(frequency, response, options).value();
  EXPECT_LT(stable.poles(0).real(), 0.0);
  EXPECT_GT(stable.error, 0.1);
}

TEST(FrequencyFit, Refusals) {
  const VectorXd frequency = Eigen::Vector3d(1.0, 2.0, 3.0);
  const std::vector<MatrixXcd> response(3, MatrixXcd::Ones(1, 1));
  FrequencyFitOptions options;
  EXPECT_TRUE(fit_frequency_response(frequency.head(2), response, options)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(fit_frequency_response(VectorXd(), {}, options).error().is(ArgumentError::empty));
  EXPECT_EQ(to_string(fit_frequency_response(frequency.reverse(), response, options).error()),
            "fit_frequency_response: frequency 1 is 2; it must be not negative and larger than the "
            "one before");
  options.poles = 3;
  EXPECT_TRUE(fit_frequency_response(frequency, response, options)
                  .error()
                  .is(IdentificationError::too_short));
  options.poles = 0;
  EXPECT_TRUE(
      fit_frequency_response(frequency, response, options).error().is(ArgumentError::out_of_range));
  options.poles = 1;
  options.weights = MatrixXd::Ones(2, 1);
  EXPECT_TRUE(
      fit_frequency_response(frequency, response, options).error().is(ArgumentError::wrong_shape));
  options.weights = {};
  EXPECT_TRUE(fit_frequency_response(frequency, response, Time(1.2), options)
                  .error()
                  .is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::identification::frequency_fit_test
