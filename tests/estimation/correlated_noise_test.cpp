#include <flyball/estimation/correlated_noise.hpp>

#include <gtest/gtest.h>

#include <flyball/estimation/estimate.hpp>

#include "linear_case.hpp"
#include "support/oracle.hpp"

namespace flyball::correlated_noise_test {
namespace {

// Three steps as one Gaussian vector: x_3 given y_0, y_1, y_2, all of them linear in the
// independent (x_0 - x̂_0, [w_k; v_k]).
TEST(CorrelatedNoise, IsTheConditionalOfTheJointGaussian) {
  Random random(91);
  for (int run = 0; run < 20; ++run) {
    const test::LinearCase c = test::linear_case(random);
    const Eigen::MatrixXd F = test::normal(random, 5, 5);
    const Eigen::MatrixXd joint = F * F.transpose() + 0.1 * Eigen::MatrixXd::Identity(5, 5);
    const Eigen::MatrixXd Q = joint.topLeftCorner(3, 3);
    const Eigen::MatrixXd R = joint.bottomRightCorner(2, 2);
    const Eigen::MatrixXd N = joint.topRightCorner(3, 2);
    const DiscreteSystem<> plant{c.plant.A, c.plant.B, c.plant.C, c.plant.D, c.plant.period};
    const auto made = decorrelate(plant, Q, R, N).value();

    constexpr int steps = 3;
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(3 + 5 * steps, 3 + 5 * steps);
    covariance.topLeftCorner(3, 3) = c.P0;
    for (int k = 0; k < steps; ++k) {
      covariance.block(3 + 5 * k, 3 + 5 * k, 5, 5) = joint;
    }
    Eigen::MatrixXd X = Eigen::MatrixXd::Zero(3, 3 + 5 * steps);  // x_k's deviation from its mean
    X.leftCols(3).setIdentity();
    Eigen::VectorXd mean = c.x0;
    Eigen::MatrixXd Y(2 * steps, 3 + 5 * steps);
    Eigen::VectorXd off(2 * steps);

    auto estimate = Estimate<Eigen::Vector3d>::create(c.x0, Eigen::MatrixXd(c.P0)).value();
    const MeasurementNoise<2> noise{Eigen::Matrix2d(R)};
    const PlainNoise<3> own{Eigen::Matrix3d(made.Q)};
    const Eigen::Matrix3d A = made.A;
    for (int k = 0; k < steps; ++k) {
      const test::U u(random.normal());
      const Eigen::Vector2d y(random.normal(), random.normal());
      Y.middleRows(2 * k, 2) = c.plant.C * X;
      Y.block(2 * k, 3 + 5 * k + 3, 2, 2) += Eigen::Matrix2d::Identity();
      off.segment(2 * k, 2) = y - c.plant.C * mean - c.plant.D * u;
      X = (c.plant.A * X).eval();
      X.block(0, 3 + 5 * k, 3, 3) += Eigen::Matrix3d::Identity();
      mean = (c.plant.A * mean + c.plant.B * u).eval();

      ASSERT_TRUE(correct(estimate, y, c.plant.C, c.plant.D, u, noise).accepted());
      const Eigen::Vector3d next = A * estimate.x_hat() + made.B * u + made.K * y;
      ASSERT_TRUE(estimate.predict(next, A, own));
    }
    const Eigen::MatrixXd S = Y * covariance * Y.transpose();
    const Eigen::MatrixXd K = test::solve(S, Y * covariance * X.transpose()).transpose();
    const Eigen::MatrixXd P = X * covariance * X.transpose() - K * S * K.transpose();
    ASSERT_LT((mean + K * off - estimate.x_hat()).norm(), 1e-9 * (1.0 + mean.norm()));
    ASSERT_LT((P - estimate.P()).norm(), 1e-9 * P.norm());
  }
}

TEST(CorrelatedNoise, Errors) {
  Random random(92);
  const test::LinearCase c = test::linear_case(random);
  const DiscreteSystem<> plant{c.plant.A, c.plant.B, c.plant.C, c.plant.D, c.plant.period};
  const Eigen::MatrixXd N = Eigen::MatrixXd::Zero(3, 2);
  EXPECT_TRUE(decorrelate(plant, c.Q, c.R, N));
  EXPECT_TRUE(decorrelate(plant, c.Q, c.R, N.transpose()).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(decorrelate(plant, c.R, c.R, N).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(decorrelate(plant, c.Q, Eigen::MatrixXd(0.0 * c.R), N)
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(decorrelate(plant, c.Q, c.R, Eigen::MatrixXd::Constant(3, 2, 1e3))
                  .error()
                  .is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::correlated_noise_test
