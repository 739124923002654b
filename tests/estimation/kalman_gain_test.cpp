#include <flyball/estimation/kalman_gain.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/riccati.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/oracle.hpp"

namespace flyball {
namespace {

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

// A scalar random walk, A = C = 1, Q = q, R = r: P² - q P - q r = 0, so
// P = (q + sqrt(q² + 4 q r))/2 and K = P/(P + r). With q = 1, r = 2: P = 2, K = 1/2, P⁺ = 1.
TEST(KalmanGain, ScalarRandomWalk) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const auto gain = kalman_gain(one, one, one, 2.0 * one).value();
  EXPECT_NEAR(gain.P_prior(0, 0), 2.0, 1e-14);
  EXPECT_NEAR(gain.K(0, 0), 0.5, 1e-15);
  EXPECT_NEAR(gain.L(0, 0), 0.5, 1e-15);
  EXPECT_NEAR(gain.P_posterior(0, 0), 1.0, 1e-14);
  EXPECT_NEAR(std::abs(gain.poles(0) - 0.5), 0.0, 1e-14);
}

// The book's elevator at 5 ms with the densities of Figure 6.3. SciPy 1.10.1, solve_discrete_are of
// the dual with the discretised covariances (the numbers are facts of the reference data).
TEST(KalmanGain, IsTheBooksElevators) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, 0.0, -164.20904979369794;
  const Eigen::Vector2d B(0.0, 21.457377744727182);
  const Eigen::RowVector2d C(1.0, 0.0);
  const Time period(0.005);
  const auto discrete = discretize_zoh(A, B, period).value();
  const auto Q = discretize(A, ProcessDensity{Eigen::Vector2d(0.0025, 1.0).asDiagonal()}, period);
  const auto R = discretize(MeasurementDensity{Eigen::MatrixXd::Constant(1, 1, 1e-8)}, period);
  Eigen::Matrix2d Q_gold;
  Q_gold << 1.2523533144658724e-05, 5.815620154546034e-06, 5.815620154546034e-06,
      0.0024554829652557965;
  EXPECT_LT((Q.value() - Q_gold).norm(), 1e-12 * Q_gold.norm());
  EXPECT_NEAR(R.value()(0, 0), 2e-6, 1e-20);

  const auto gain = kalman_gain(discrete.A, C, Q, R).value();
  EXPECT_NEAR(gain.K(0, 0), 0.8774731314610419, 1e-9 * 0.877);
  EXPECT_NEAR(gain.K(1, 0), 0.6715538384088243, 1e-9 * 0.671);
  Eigen::Matrix2d P;
  P << 1.432295041772075e-05, 1.0961740007177293e-05, 1.0961740007177293e-05, 0.0030431321371697665;
  EXPECT_LT((gain.P_prior - P).norm(), 1e-9 * P.norm());
}

// Random plants: P satisfies its equation, the gain forms agree, the estimator is stable, and the
// posterior is (I - K C) P.
TEST(KalmanGain, SatisfiesItsEquations) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const Eigen::Index p = 1 + trial % 2;
    const Eigen::MatrixXd A = random_matrix(random, n, n) * 0.7;
    const Eigen::MatrixXd C = random_matrix(random, p, n);
    const Eigen::MatrixXd G = random_matrix(random, n, n);
    const Eigen::MatrixXd H = random_matrix(random, p, p);
    const Eigen::MatrixXd Q = G * G.transpose();
    const Eigen::MatrixXd R = H * H.transpose() + 0.1 * Eigen::MatrixXd::Identity(p, p);
    const auto gain = kalman_gain(A, C, Q, R).value();
    const Eigen::MatrixXd& P = gain.P_prior;
    const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
    const double size = P.norm() * (1.0 + A.norm() * A.norm());
    EXPECT_LT((A * gain.P_posterior * A.transpose() + Q - P).norm(), 1e-11 * size);
    EXPECT_LT((gain.P_posterior - (I - gain.K * C) * P).norm(), 1e-11 * size);
    EXPECT_LT((gain.L - A * gain.K).norm(), 1e-10 * (1.0 + gain.L.norm()));
    EXPECT_LT((gain.K * (C * P * C.transpose() + R) - P * C.transpose()).norm(), 1e-11 * size);
    EXPECT_LT(gain.poles.cwiseAbs().maxCoeff(), 1.0);
    const Eigen::VectorXcd expected = test::eigenvalues(A - gain.L * C);
    for (const auto& pole : expected) {
      EXPECT_LT((gain.poles.array() - pole).abs().minCoeff(), 1e-7);
    }
  }
}

TEST(KalmanGain, FixedIsDynamic) {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const auto plant = discretize<2, 1, 1>(elevator, Time(0.02)).value();
  const auto Q = standard_deviations({0.01, 0.1});
  const auto R = standard_deviations({1e-3});
  const auto fixed = kalman_gain(plant, Q, R).value();
  const auto dynamic = kalman_gain(plant.A, plant.C, Q, R).value();
  EXPECT_EQ(Eigen::MatrixXd(fixed.K), dynamic.K);
  EXPECT_EQ(Eigen::MatrixXd(fixed.P_prior), dynamic.P_prior);
}

template <class... Arguments>
constexpr bool accepted = requires(Arguments... arguments) { kalman_gain(arguments...); };

TEST(KalmanGain, TakesOnlyDiscretePlants) {
  static_assert(accepted<DiscreteSystem<2, 1, 1>, Covariance, Covariance>);
  static_assert(!accepted<ContinuousSystem<2, 1, 1>, Covariance, Covariance>);
  static_assert(!accepted<mechanisms::Elevator, Covariance, Covariance>);
  SUCCEED();
}

TEST(KalmanGain, Errors) {
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd C = Eigen::RowVector2d(1.0, 0.0);
  const Eigen::MatrixXd r = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(
      kalman_gain(Eigen::MatrixXd::Ones(2, 3), C, I, r).error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(to_string(kalman_gain(I, C, I, I).error()),
            "kalman_gain: R is 2x2; it must be outputs x outputs (1x1)");
  EXPECT_TRUE(kalman_gain(I, C, r, r).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      kalman_gain(I, Eigen::MatrixXd::Ones(1, 3), I, r).error().is(ArgumentError::wrong_shape));
  Eigen::MatrixXd bad = I;
  bad(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(kalman_gain(bad, C, I, r).error().is(ArgumentError::not_finite));
  // The maker's own error comes through.
  EXPECT_EQ(kalman_gain(I, C, standard_deviations({-1.0, 1.0}), r).error().where(),
            "standard_deviations");
  // The second state is a random walk that nothing shows.
  const auto hidden = kalman_gain(I, C, I, r);
  ASSERT_FALSE(hidden.has_value());
  EXPECT_TRUE(hidden.error().is(RiccatiError::not_stabilizable));
  EXPECT_EQ(hidden.error().where(), "kalman_gain");
  EXPECT_FALSE(hidden.error().evidence().empty());
}

}  // namespace
}  // namespace flyball
