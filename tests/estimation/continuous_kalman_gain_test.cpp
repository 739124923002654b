#include <flyball/estimation/continuous_kalman_gain.hpp>

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/math/riccati/riccati.hpp>

namespace flyball::continuous_kalman_gain_test {
namespace {

using namespace flyball::literals;
using Eigen::MatrixXd;

// A double integrator pushed by white acceleration of density q, its position measured with r:
// P = √(qr) [√(2a) 1; 1 √(2/a)…]; with q = r = 1: P = [√2 1; 1 √2], L = [√2; 1], poles of
// s² + √2 s + 1.
TEST(ContinuousKalmanGain, OfADoubleIntegrator) {
  const MatrixXd A = Eigen::Matrix2d{{0.0, 1.0}, {0.0, 0.0}};
  const MatrixXd C = Eigen::RowVector2d(1.0, 0.0);
  const ProcessDensity Q{Eigen::Matrix2d{{0.0, 0.0}, {0.0, 1.0}}};
  const MeasurementDensity R{MatrixXd::Ones(1, 1)};
  const auto gain = continuous_kalman_gain(A, C, Q, R).value();
  const double root = std::sqrt(2.0);
  EXPECT_NEAR((gain.L - Eigen::Vector2d(root, 1.0)).norm(), 0.0, 1e-14);
  EXPECT_NEAR((gain.P - Eigen::Matrix2d{{root, 1.0}, {1.0, root}}).norm(), 0.0, 1e-13);
  EXPECT_NEAR(std::abs(gain.poles(0) - std::conj(gain.poles(1))), 0.0, 1e-12);
  EXPECT_NEAR(gain.poles(0).real(), -root / 2.0, 1e-12);
  // The sampled filter's predictor gain over the period goes there.
  const Time period = 1_ms;
  const ContinuousSystem<> plant{A, MatrixXd::Zero(2, 1), C, MatrixXd::Zero(1, 1)};
  const auto sampled = discretize(plant, period).value();
  const auto discrete =
      kalman_gain(sampled, discretize(A, Q, period), discretize(R, period)).value();
  EXPECT_NEAR((discrete.L / period.si() - gain.L).norm(), 0.0, 2e-3);
}

TEST(ContinuousKalmanGain, Refusals) {
  const MatrixXd A = Eigen::Matrix2d{{0.0, 1.0}, {0.0, 0.0}};
  const MatrixXd I = MatrixXd::Identity(2, 2);
  const MeasurementDensity R{MatrixXd::Ones(1, 1)};
  const auto blind = continuous_kalman_gain(A, Eigen::RowVector2d(0.0, 1.0), {I}, R);
  ASSERT_FALSE(blind);
  EXPECT_TRUE(blind.error().is(KalmanGainError::not_detectable));
  const auto undriven = continuous_kalman_gain(A, Eigen::RowVector2d(1.0, 0.0), {0.0 * I}, R);
  ASSERT_FALSE(undriven);
  EXPECT_TRUE(undriven.error().is(KalmanGainError::undriven_mode)) << to_string(undriven.error());
  EXPECT_TRUE(continuous_kalman_gain(A, Eigen::RowVector2d(1.0, 0.0), {-I}, R)
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(continuous_kalman_gain(A, Eigen::RowVector2d(1.0, 0.0), {I}, {0.0 * R.R})
                  .error()
                  .is(RiccatiError::singular));
  EXPECT_TRUE(continuous_kalman_gain(A, Eigen::RowVector3d(1.0, 0.0, 0.0), {I}, R)
                  .error()
                  .is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::continuous_kalman_gain_test
