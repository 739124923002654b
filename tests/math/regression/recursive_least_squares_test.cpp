#include <flyball/math/regression/recursive_least_squares.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace flyball::recursive_least_squares_test {
namespace {

using Eigen::Vector3d;
using Estimator = RecursiveLeastSquares<3>;

Vector3d sample(Random& random) {
  return {random.normal(), random.normal(), random.normal()};
}

// Minimises Σ λ^(n-i) (y - xᵀβ)² + what is left of (β - β0)ᵀP0⁻¹(β - β0), without forgetting.
TEST(RecursiveLeastSquares, IsTheRegularisedRegression) {
  Random random(1);
  const Vector3d initial(1.0, -2.0, 0.5);
  const Vector3d deviation(0.5, 3.0, 10.0);
  auto estimator = Estimator::create(initial, deviation).value();
  auto dynamic = RecursiveLeastSquares<>::create(initial, deviation).value();
  Eigen::Matrix3d information = deviation.cwiseAbs2().cwiseInverse().asDiagonal();
  Vector3d right = information * initial;
  for (int i = 0; i < 50; ++i) {
    const Vector3d x = sample(random);
    const double y = x.dot(Vector3d(2.0, 3.0, 4.0)) + 0.1 * random.normal();
    EXPECT_TRUE(estimator.update(x, y));
    EXPECT_TRUE(dynamic.update(x, y));
    information += x * x.transpose();
    right += x * y;
    const Vector3d expected = test::solve(Eigen::MatrixXd(information), Eigen::MatrixXd(right));
    EXPECT_LT((estimator.coefficients() - expected).norm(), 1e-12);
    EXPECT_LT((dynamic.coefficients() - expected).norm(), 1e-12);
  }
  EXPECT_LT((estimator.covariance() - information.inverse()).norm(), 1e-13);
  EXPECT_EQ(estimator.samples(), 50.0);
}

// With forgetting it follows a change within a few memories.
TEST(RecursiveLeastSquares, Follows) {
  Random random(6);
  auto estimator = Estimator::create(Vector3d::Zero(), Vector3d::Constant(100.0), 0.98).value();
  for (int i = 0; i < 2000; ++i) {
    const Vector3d truth = i < 1000 ? Vector3d(1.0, 2.0, 3.0) : Vector3d(-1.0, 2.0, 5.0);
    const Vector3d x = sample(random);
    estimator.update(x, x.dot(truth) + 0.01 * random.normal());
    if (i == 999 || i == 1999) {
      EXPECT_LT((estimator.coefficients() - truth).norm(), 0.02);
    }
  }
  EXPECT_NEAR(estimator.samples(), 50.0, 0.1);
  EXPECT_NEAR(std::sqrt(estimator.variance()), 0.01, 0.005);
}

// Without excitation P returns to P0 and no further, and the estimate stays.
TEST(RecursiveLeastSquares, DoesNotWindUp) {
  Random random(7);
  const Vector3d deviation(2.0, 3.0, 4.0);
  auto estimator = Estimator::create(Vector3d::Zero(), deviation, 0.95).value();
  const Vector3d truth(1.0, 2.0, 3.0);
  for (int i = 0; i < 400; ++i) {
    const Vector3d x = sample(random);
    estimator.update(x, x.dot(truth));
  }
  const Vector3d before = estimator.coefficients();
  const Vector3d x(1.0, 0.0, 0.0);
  for (int i = 0; i < 100'000; ++i) {
    estimator.update(x, x.dot(truth));
  }
  EXPECT_LT((estimator.coefficients() - before).norm(), 1e-9);
  const Eigen::Matrix3d P = estimator.covariance();
  EXPECT_NEAR(P(1, 1), 9.0, 1e-6);
  EXPECT_NEAR(P(2, 2), 16.0, 1e-6);
  EXPECT_LT(P(0, 0), 0.06);
  // 1e8 steps of what excites nothing at all would have lost every digit of P otherwise.
  EXPECT_GT(test::cholesky_factor(P).diagonal().prod(), 0.0);
}

// Whatever comes: finite, positive definite.
TEST(RecursiveLeastSquares, StaysFinite) {
  Random random(9);
  for (const double forgetting : {1.0, 0.9, 1e-3}) {
    auto estimator =
        Estimator::create(Vector3d::Zero(), Vector3d(1e50, 1.0, 1e-50), forgetting).value();
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(estimator.update(Vector3d(nan, 0.0, 0.0), 1.0));
    EXPECT_FALSE(estimator.update(Vector3d::Ones(), std::numeric_limits<double>::infinity()));
    EXPECT_FALSE(estimator.update(Vector3d::Constant(1e300), 1.0));
    EXPECT_EQ(estimator.samples(), 0.0);
    for (int i = 0; i < 20'000; ++i) {
      const auto wild = [&] {
        return random.normal() * std::pow(10.0, random.uniform(-300.0, 69.0));
      };
      estimator.update(Vector3d(wild(), wild(), wild()), wild());
      ASSERT_TRUE(is_signal(estimator.coefficients()));
      ASSERT_TRUE(estimator.information_factor().allFinite());
      ASSERT_GT(estimator.information_factor().diagonal().minCoeff(), 0.0);
      ASSERT_TRUE(std::isfinite(estimator.variance()));
    }
  }
}

TEST(RecursiveLeastSquares, DoesNotAllocate) {
  auto estimator = Estimator::create(Vector3d::Zero(), Vector3d::Ones(), 0.99).value();
  const test::AllocationCounter allocations;
  double sum = 0.0;
  for (int i = 0; i < 100; ++i) {
    estimator.update(Vector3d(1.0, i, i % 7), i);
    sum += estimator.covariance()(0, 0) + estimator.variance();
  }
  EXPECT_TRUE(std::isfinite(sum));
  if (test::counts_allocations()) {
    EXPECT_EQ(allocations.count(), 0u);
  }
}

TEST(RecursiveLeastSquares, Refusals) {
  const Vector3d zero = Vector3d::Zero();
  EXPECT_TRUE(Estimator::create(zero, zero).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      Estimator::create(zero, Vector3d::Ones(), 1.1).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      Estimator::create(zero, Vector3d::Ones(), 0.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(RecursiveLeastSquares<>::create(Eigen::Vector2d::Zero(), Vector3d::Ones())
                  .error()
                  .is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::recursive_least_squares_test
