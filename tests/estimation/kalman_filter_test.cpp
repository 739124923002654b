#include <flyball/estimation/kalman_filter.hpp>

#include <cmath>
#include <limits>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_filter.tpp>

#include "support/allocation_count.hpp"

namespace flyball::kalman_filter_test {
namespace {

DiscreteSystem<2, 1, 1> cart() {
  DiscreteSystem<2, 1, 1> plant;
  plant.A << 1.0, 0.02, 0.0, 0.95;
  plant.B << 2e-4, 0.02;
  plant.C << 1.0, 0.0;
  plant.D << 0.0;
  plant.period = Time(0.02);
  return plant;
}

// Scalar A = C = 1, P0 = 1, Q = 1, R = 2: predict gives P = 2; K = 2/4; y = 3 takes x_hat to 1.5
// and P to 1/4·2 + 1/4·2 = 1.
TEST(KalmanFilter, ScalarStep) {
  DiscreteSystem<1, 1, 1> plant{Eigen::Matrix<double, 1, 1>(1.0), Eigen::Matrix<double, 1, 1>(1.0),
                                Eigen::Matrix<double, 1, 1>(1.0), Eigen::Matrix<double, 1, 1>(0.0),
                                Time(1.0)};
  using Scalar = Eigen::Matrix<double, 1, 1>;
  auto filter = kalman_filter(plant, Scalar(1.0), Scalar(2.0), Scalar(1.0)).value();
  filter.predict(Scalar(0.0));
  EXPECT_DOUBLE_EQ(filter.P()(0), 2.0);
  EXPECT_EQ(filter.update(Scalar(3.0), Scalar(0.0)), UpdateStatus::updated);
  EXPECT_DOUBLE_EQ(filter.x_hat()(0), 1.5);
  EXPECT_DOUBLE_EQ(filter.P()(0), 1.0);
  filter.predict(Scalar(0.5));
  EXPECT_DOUBLE_EQ(filter.x_hat()(0), 2.0);
}

// D u is part of the expected measurement: y = x + 2 u with u = 1 says x = y - 2.
TEST(KalmanFilter, UsesTheFeedthrough) {
  using Scalar = Eigen::Matrix<double, 1, 1>;
  DiscreteSystem<1, 1, 1> plant{Scalar(1.0), Scalar(0.0), Scalar(1.0), Scalar(2.0), Time(1.0)};
  auto filter = kalman_filter(plant, Scalar(0.0), Scalar(1e-12), Scalar(1.0)).value();
  filter.update(Scalar(5.0), Scalar(1.0));
  EXPECT_NEAR(filter.x_hat()(0), 3.0, 1e-10);
}

// The covariance converges to the steady state and stays there when it starts there.
TEST(KalmanFilter, SteadyState) {
  const auto plant = cart();
  const auto Q = standard_deviations({1e-3, 0.05});
  const auto R = standard_deviations({1e-2});
  const auto gain = kalman_gain(plant, Q, R).value();
  auto converging =
      kalman_filter(plant, Q, R, Eigen::Matrix2d(Eigen::Matrix2d::Identity())).value();
  auto steady = kalman_filter(plant, Q, R).value();
  const Eigen::Matrix<double, 1, 1> zero(0.0);
  for (int k = 0; k < 2000; ++k) {
    converging.predict(zero);
    converging.update(zero, zero);
    steady.predict(zero);
    ASSERT_LT((steady.P() - gain.P_prior).norm(), 1e-11 * gain.P_prior.norm());
    steady.update(zero, zero);
    ASSERT_LT((steady.P() - gain.P_posterior).norm(), 1e-11 * gain.P_posterior.norm());
  }
  EXPECT_LT((converging.P() - gain.P_posterior).norm(), 1e-11 * gain.P_posterior.norm());
}

// A filter over k measurements of a constant state is the weighted least squares of them all:
// x_hat = (P0⁻¹ + Σ CᵀR⁻¹C)⁻¹ Σ CᵀR⁻¹y.
TEST(KalmanFilter, IsLeastSquaresForAConstant) {
  Random random(9);
  DiscreteSystem<3, 1, 2> plant;
  plant.A.setIdentity();
  plant.B.setZero();
  plant.D.setZero();
  plant.period = Time(1.0);
  plant.C << 1.0, 0.5, -0.3, 0.2, -1.0, 0.8;
  Eigen::Matrix2d R;
  R << 0.5, 0.2, 0.2, 0.9;
  const Eigen::Matrix3d P0 = Eigen::Vector3d(1.0, 2.0, 3.0).asDiagonal();
  auto filter = kalman_filter(plant, Eigen::Matrix3d(Eigen::Matrix3d::Zero()), R, P0).value();
  Eigen::Matrix3d information = P0.inverse();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const Eigen::Matrix<double, 1, 1> u(0.0);
  for (int k = 0; k < 20; ++k) {
    const Eigen::Vector2d y(random.normal(), random.normal());
    filter.predict(u);
    ASSERT_EQ(filter.update(y, u), UpdateStatus::updated);
    information += plant.C.transpose() * R.inverse() * plant.C;
    right += plant.C.transpose() * R.inverse() * y;
    ASSERT_LT((filter.x_hat() - information.inverse() * right).norm(), 1e-12);
    ASSERT_LT((filter.P() - information.inverse()).norm(), 1e-12);
  }
}

// Its own error statistics: over many samples the squared error of a matched filter has the mean P.
TEST(KalmanFilter, KnowsItsError) {
  const auto plant = cart();
  const double sigma_w = 0.05;
  const double sigma_v = 1e-2;
  auto filter =
      kalman_filter(plant, standard_deviations({0.0, sigma_w}), standard_deviations({sigma_v}))
          .value();
  Random random(21);
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  constexpr int samples = 200000;
  for (int k = 0; k < samples; ++k) {
    const Eigen::Matrix<double, 1, 1> u(std::sin(0.01 * k));
    x = plant.A * x + plant.B * u + Eigen::Vector2d(0.0, sigma_w * random.normal());
    filter.predict(u);
    const Eigen::Matrix<double, 1, 1> y(x(0) + sigma_v * random.normal());
    filter.update(y, u);
    const Eigen::Vector2d error = x - filter.x_hat();
    sum += error * error.transpose();
  }
  // About samples/30 independent errors: 5 % is six standard deviations.
  EXPECT_NEAR(sum(0, 0) / samples / filter.P()(0, 0), 1.0, 0.05);
  EXPECT_NEAR(sum(1, 1) / samples / filter.P()(1, 1), 1.0, 0.05);
}

TEST(KalmanFilter, LeavesOutWhatIsNotFinite) {
  auto filter =
      kalman_filter(cart(), standard_deviations({1e-3, 0.05}), standard_deviations({1e-2})).value();
  const Eigen::Matrix<double, 1, 1> u(1.0);
  filter.predict(u);
  const Eigen::Vector2d x_hat = filter.x_hat();
  const Eigen::Matrix2d P = filter.P();
  for (const double y :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(filter.update(Eigen::Matrix<double, 1, 1>(y), u), UpdateStatus::not_finite);
    EXPECT_EQ(filter.x_hat(), x_hat);
    EXPECT_EQ(filter.P(), P);
  }
}

// Two equal noiseless sensors: C P Cᵀ has rank one.
TEST(KalmanFilter, SurvivesASingularInnovation) {
  DiscreteSystem<2, 1, 2> plant;
  plant.A.setIdentity();
  plant.B.setZero();
  plant.C << 1.0, 0.0, 1.0, 0.0;
  plant.D.setZero();
  plant.period = Time(1.0);
  const Eigen::Matrix2d zero = Eigen::Matrix2d::Zero();
  auto filter =
      kalman_filter(plant, zero, zero, Eigen::Matrix2d(Eigen::Matrix2d::Identity())).value();
  EXPECT_EQ(filter.update(Eigen::Vector2d(1.0, 1.0), Eigen::Matrix<double, 1, 1>(0.0)),
            UpdateStatus::singular_innovation);
  EXPECT_TRUE(filter.x_hat().isZero(0.0));
  // One such sensor is exact, and its second reading finds nothing left to correct.
  DiscreteSystem<1, 1, 1> one;
  one.A << 1.0;
  one.B << 0.0;
  one.C << 1.0;
  one.D << 0.0;
  one.period = Time(1.0);
  using Scalar = Eigen::Matrix<double, 1, 1>;
  auto exact = kalman_filter(one, Scalar(0.0), Scalar(0.0), Scalar(1.0)).value();
  EXPECT_EQ(exact.update(Scalar(4.0), Scalar(0.0)), UpdateStatus::updated);
  EXPECT_EQ(exact.x_hat()(0), 4.0);
  EXPECT_EQ(exact.update(Scalar(4.0), Scalar(0.0)), UpdateStatus::singular_innovation);
}

TEST(KalmanFilter, FixedIsDynamic) {
  const auto plant = cart();
  const DiscreteSystem<> dynamic_plant{plant.A, plant.B, plant.C, plant.D, plant.period};
  const auto Q = standard_deviations({1e-3, 0.05});
  const auto R = standard_deviations({1e-2});
  auto fixed = kalman_filter(plant, Q, R).value();
  auto dynamic = kalman_filter(dynamic_plant, Q, R).value();
  Random random(2);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Matrix<double, 1, 1> u(random.normal());
    const Eigen::Matrix<double, 1, 1> y(random.normal());
    fixed.predict(u);
    dynamic.predict(u);
    fixed.update(y, u);
    dynamic.update(y, u);
    ASSERT_LT((Eigen::VectorXd(fixed.x_hat()) - dynamic.x_hat()).norm(), 1e-14);
    ASSERT_LT((Eigen::MatrixXd(fixed.P()) - dynamic.P()).norm(), 1e-16);
  }
}

// A size that the library does not ship comes from the .tpp.
TEST(KalmanFilter, OtherSizes) {
  DiscreteSystem<4, 2, 3> plant;
  plant.A = 0.5 * Eigen::Matrix4d::Identity();
  plant.B.setOnes();
  plant.C.setOnes();
  plant.D.setZero();
  plant.period = Time(0.1);
  auto filter = kalman_filter(plant, Eigen::Matrix4d(Eigen::Matrix4d::Identity()),
                              Eigen::Matrix3d(Eigen::Matrix3d::Identity()))
                    .value();
  filter.predict(Eigen::Vector2d(1.0, 2.0));
  EXPECT_EQ(filter.update(Eigen::Vector3d(12.0, 12.0, 12.0), Eigen::Vector2d::Zero()),
            UpdateStatus::updated);
  EXPECT_NEAR(filter.x_hat()(0), 3.0, 1e-14);
}

TEST(KalmanFilter, Errors) {
  const auto plant = cart();
  const Eigen::MatrixXd Q = Eigen::Matrix2d::Identity();
  const Eigen::MatrixXd R = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(kalman_filter(plant, R, R, Q).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(kalman_filter(plant, Q, Q, Q).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(kalman_filter(plant, Q, R, R).error().is(ArgumentError::wrong_shape));
  Eigen::MatrixXd skew = Q;
  skew(0, 1) = 0.1;
  EXPECT_TRUE(kalman_filter(plant, skew, R, Q).error().is(ArgumentError::not_symmetric));
  EXPECT_TRUE(kalman_filter(plant, Q, R, skew).error().is(ArgumentError::not_symmetric));
  EXPECT_TRUE(kalman_filter(plant, Q, standard_deviations({-1.0}), Q)
                  .error()
                  .is(ArgumentError::out_of_range));
  auto no_period = plant;
  no_period.period = Time(0.0);
  EXPECT_TRUE(kalman_filter(no_period, Q, R, Q).error().is(ArgumentError::not_positive));
}

TEST(KalmanFilter, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  auto filter =
      kalman_filter(cart(), standard_deviations({1e-3, 0.05}), standard_deviations({1e-2})).value();
  const test::AllocationCounter counter;
  for (int k = 0; k < 100; ++k) {
    const Eigen::Matrix<double, 1, 1> u(0.1 * k);
    filter.predict(u);
    filter.update(Eigen::Matrix<double, 1, 1>(0.2), u);
  }
  EXPECT_EQ(counter.count(), 0u);
  // The counter does count.
  const Eigen::VectorXd vector = Eigen::VectorXd::Zero(3);
  EXPECT_GT(counter.count(), 0u);
  EXPECT_EQ(vector.size(), 3);
}

}  // namespace
}  // namespace flyball::kalman_filter_test
