#include <flyball/estimation/shaping_filter.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/probability/gaussian_vector.hpp>

namespace flyball::shaping_filter_test {
namespace {

using namespace flyball::literals;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(ShapingFilter, HasTheAutocovarianceOfItsName) {
  const auto first = first_order_gauss_markov(0.3, Time(2.0)).value();
  const auto critical = second_order_gauss_markov(0.3, AngularVelocity(1.5), 1.0).value();
  const auto vibration = second_order_gauss_markov(0.3, AngularVelocity(50.0), 0.05).value();
  for (const double lag : {0.0, 0.1, 1.0, 7.0}) {
    EXPECT_NEAR(stationary_autocovariance(first, lag).value()(0), 0.09 * std::exp(-lag / 2.0),
                1e-15);
    EXPECT_NEAR(stationary_autocovariance(critical, lag).value()(0),
                0.09 * std::exp(-1.5 * lag) * (1.0 + 1.5 * lag), 1e-13);
    // e^{-ζω τ}(cos ω_d τ + ζ/√(1 - ζ²) sin ω_d τ)
    const double root = std::sqrt(1.0 - 0.0025);
    EXPECT_NEAR(stationary_autocovariance(vibration, lag).value()(0),
                0.09 * std::exp(-2.5 * lag) *
                    (std::cos(50.0 * root * lag) + 0.05 / root * std::sin(50.0 * root * lag)),
                1e-12);
  }
}

// Sampled each 0.1 s (7.8), the first-order filter is n⁺ = e^{-T/τ} n + N(0, σ²(1 - e^{-2T/τ})).
TEST(ShapingFilter, IsSampledExactly) {
  const auto noise = first_order_gauss_markov(0.3, Time(2.0)).value();
  const auto Q = discretize(noise.A, noise.density, 100_ms).value();
  EXPECT_NEAR(Q(0), 0.09 * (1.0 - std::exp(-0.1)), 1e-16);
  const auto walk = wiener_process(0.5).value();
  EXPECT_NEAR(discretize(walk.A, walk.density, Time(3.0)).value()(0), 1.5, 1e-15);
}

// Drawn from, the noise has that autocovariance; the estimate of a correlation from N samples that
// are correlated for T/dt = 20 of them has a deviation of about √(2·20/N).
TEST(ShapingFilter, DrawnNoiseHasIt) {
  const auto noise = first_order_gauss_markov(1.0, Time(2.0)).value();
  const double Q = discretize(noise.A, noise.density, 100_ms).value()(0);
  const double a = std::exp(-0.05);
  Random random(51);
  constexpr int N = 200000;
  double n = random.normal();
  double before = 0.0;
  double variance = 0.0;
  double product = 0.0;
  for (int k = 0; k < N; ++k) {
    before = n;
    n = a * n + random.normal(0.0, std::sqrt(Q));
    variance += n * n / N;
    product += n * before / N;
  }
  EXPECT_NEAR(variance, 1.0, 4.0 * std::sqrt(40.0 / N));
  EXPECT_NEAR(product / variance, a, 0.003);
}

// A position that is measured with noise of 0.2 s correlation: by the covariance of both filters'
// true errors, from the joint system of truth and filter, the filter of the augmented model is the
// better one, and what it says of its error is the truth; the one that takes the noise for white is
// too sure of itself.
TEST(AugmentNoise, AFilterThatKnowsTheColourIsBetterAndHonest) {
  const ContinuousSystem<> plant{Eigen::Matrix2d{{0.0, 1.0}, {0.0, -1.0}},
                                 Eigen::Vector2d(0.0, 1.0), Eigen::RowVector2d(1.0, 0.0),
                                 MatrixXd::Zero(1, 1)};
  const ProcessDensity density{Eigen::Matrix2d{{0.0, 0.0}, {0.0, 1.0}}};
  const auto noise = first_order_gauss_markov(0.1, 200_ms).value();
  const auto whole =
      augment_noise(plant, density, noise, MatrixXd::Zero(2, 1), MatrixXd::Ones(1, 1)).value();
  const auto sampled = discretize(whole.plant, 20_ms).value();
  const MatrixXd Q = discretize(whole.plant.A, whole.density, 20_ms).value();
  const MatrixXd R = MatrixXd::Constant(1, 1, 1e-6);
  const auto knows = kalman_gain(sampled, Q, R).value();
  const auto naive = kalman_gain(sampled.A.topLeftCorner(2, 2), sampled.C.leftCols(2),
                                 Q.topLeftCorner(2, 2).eval(), (R.array() + 0.01).matrix().eval())
                         .value();
  // e⁺ = (I - KC)(A e + w) - K v, the naive filter with a row of zeros for the noise.
  const auto truth = [&](const MatrixXd& K) {
    const MatrixXd I = MatrixXd::Identity(3, 3);
    const MatrixXd rest = I - K * sampled.C;
    return discrete_lyapunov(rest * sampled.A, rest * Q * rest.transpose() + K * R * K.transpose())
        .value()
        .X;
  };
  MatrixXd K = MatrixXd::Zero(3, 1);
  K.topRows(2) = naive.K;
  const MatrixXd of_naive = truth(K);
  const MatrixXd of_knowing = truth(knows.K);
  EXPECT_NEAR((of_knowing - knows.P_posterior).norm(), 0.0, 1e-10);
  EXPECT_LT(of_knowing(0, 0), 0.9 * of_naive(0, 0));
  EXPECT_GT(of_naive(0, 0), 2.0 * naive.P_posterior(0, 0));
}

TEST(AugmentNoise, ActsOnStatesAndOutputs) {
  const ContinuousSystem<> plant{MatrixXd::Constant(1, 1, -2.0), MatrixXd::Constant(1, 1, 3.0),
                                 MatrixXd::Constant(1, 1, 4.0), MatrixXd::Constant(1, 1, 5.0)};
  const ProcessDensity density{MatrixXd::Constant(1, 1, 6.0)};
  const auto noise = second_order_gauss_markov(1.0, AngularVelocity(2.0), 0.5).value();
  const auto whole = augment_noise(plant, density, noise, MatrixXd::Constant(1, 1, 7.0),
                                   MatrixXd::Constant(1, 1, 8.0))
                         .value();
  EXPECT_EQ(whole.plant.A, (Eigen::Matrix3d{{-2.0, 7.0, 0.0}, {0.0, 0.0, 1.0}, {0.0, -4.0, -2.0}}));
  EXPECT_EQ(whole.plant.B, Eigen::Vector3d(3.0, 0.0, 0.0));
  EXPECT_EQ(whole.plant.C, Eigen::RowVector3d(4.0, 8.0, 0.0));
  EXPECT_EQ(whole.plant.D(0), 5.0);
  EXPECT_EQ(whole.density.Q, Eigen::Matrix3d(Eigen::Vector3d(6.0, 0.0, 16.0).asDiagonal()));
  EXPECT_TRUE(augment_noise(plant, density, noise, MatrixXd::Zero(2, 1), MatrixXd::Zero(1, 1))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(augment_noise(plant, {-density.Q}, noise, MatrixXd::Zero(1, 1), MatrixXd::Zero(1, 1))
                  .error()
                  .is(ArgumentError::not_positive));
}

TEST(ShapingFilter, Refusals) {
  EXPECT_TRUE(first_order_gauss_markov(0.0, Time(1.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(first_order_gauss_markov(1.0, Time(-1.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(second_order_gauss_markov(1.0, AngularVelocity(1.0), 0.0)
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(wiener_process(std::numeric_limits<double>::infinity())
                  .error()
                  .is(ArgumentError::not_finite));
  const auto walk = stationary_autocovariance(wiener_process(1.0).value());
  ASSERT_FALSE(walk);
  EXPECT_EQ(
      to_string(walk.error()),
      "stationary_autocovariance: the noise is not stationary: its variance grows without end; "
      "it must be of poles with negative real parts (pole = [0, 0])");
  EXPECT_TRUE(stationary_autocovariance(first_order_gauss_markov(1.0, Time(1.0)).value(), -1.0)
                  .error()
                  .is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::shaping_filter_test
