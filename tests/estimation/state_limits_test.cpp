#include <flyball/estimation/state_limits.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/forms/square_root_covariance.hpp>
#include <flyball/estimation/forms/ud_covariance.hpp>
#include <flyball/estimation/model_filter.hpp>
#include <flyball/geometry/se2.hpp>

#include "linear_case.hpp"
#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace flyball::state_limits_test {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <class Form = JosephCovariance<3>>
Estimate<Vector3d, Form> estimate_of(const Vector3d& x, const Matrix3d& P) {
  return Estimate<Vector3d, Form>::create(x, MatrixXd(P)).value();
}

Matrix3d random_covariance(Random& random) {
  const MatrixXd F = test::normal(random, 3, 3);
  return F * F.transpose() + 0.1 * Matrix3d::Identity();
}

// Half a normal distribution: mean σ √(2/π), variance σ² (1 - 2/π).
TEST(StateLimits, CutOneStateToHalfANormal) {
  auto x = Estimate<Eigen::Matrix<double, 1, 1>>::create(Eigen::Matrix<double, 1, 1>(3.0),
                                                         MatrixXd::Constant(1, 1, 4.0))
               .value();
  EXPECT_TRUE(limit_state(x, 0, 3.0, infinity));
  EXPECT_NEAR(x.x_hat()(0), 3.0 + 2.0 * std::sqrt(2.0 / std::numbers::pi), 1e-13);
  EXPECT_NEAR(x.P()(0, 0), 4.0 * (1.0 - 2.0 / std::numbers::pi), 1e-13);
}

// The moments of the points of N(x_hat, P) that are within the limits, of 400 000 drawn.
TEST(StateLimits, AreTheMomentsOfWhatIsWithin) {
  Random random(111);
  for (int run = 0; run < 4; ++run) {
    const Vector3d x = test::normal(random, 3, 1);
    const Matrix3d P = random_covariance(random);
    const Vector3d a = test::normal(random, 3, 1);
    const double sigma = std::sqrt(a.dot(P * a));
    const double lower = a.dot(x) + sigma * random.uniform(-1.5, 1.0);
    const double upper = run == 0 ? infinity : lower + sigma * random.uniform(0.3, 1.5);
    const Matrix3d S = test::cholesky_factor(P);
    Vector3d sum = Vector3d::Zero();
    Matrix3d squares = Matrix3d::Zero();
    double count = 0.0;
    for (int k = 0; k < 400'000; ++k) {
      const Vector3d point = S * Vector3d(random.normal(), random.normal(), random.normal());
      const double c = a.dot(x + point);
      if (c >= lower && c <= upper) {
        sum += point;
        squares += point * point.transpose();
        count += 1.0;
      }
    }
    const Vector3d mean = sum / count;
    const Matrix3d cov = squares / count - mean * mean.transpose();
    auto cut = estimate_of(x, P);
    EXPECT_TRUE(truncate(cut, a.dot(x), a, lower, upper));
    const double rough = 6.0 * P.norm() / std::sqrt(count);
    EXPECT_LT((cut.x_hat() - x - mean).norm(), rough);
    EXPECT_LT((cut.P() - cov).norm(), 2.0 * rough);
    EXPECT_GT(a.dot(cut.x_hat()), lower);
    EXPECT_LT(a.dot(cut.x_hat()), upper);
  }
}

template <class Form>
class StateLimitsOfForm : public testing::Test {};
using Forms = testing::Types<JosephCovariance<3>, UdCovariance<3>, SquareRootCovariance<3>>;
TYPED_TEST_SUITE(StateLimitsOfForm, Forms);

// P loses P a aᵀ P (1 - s²/σ²)/σ², x moves along P a, in every form; what is far inside stays as it
// is, bit by bit; P stays positive definite however often.
TYPED_TEST(StateLimitsOfForm, KeepTheLaws) {
  Random random(112);
  for (int run = 0; run < 50; ++run) {
    const Vector3d x = test::normal(random, 3, 1);
    const Matrix3d P = random_covariance(random);
    const Vector3d a = test::normal(random, 3, 1);
    const double c = a.dot(x);
    const double variance = a.dot(P * a);
    const double lower = c + std::sqrt(variance) * random.uniform(-2.0, 4.0);
    const double upper = lower + std::sqrt(variance) * random.uniform(0.01, 3.0);
    const Moments cut = truncated_normal(c, variance, lower, upper);
    auto estimate = estimate_of<TypeParam>(x, P);
    ASSERT_TRUE(truncate(estimate, c, a, lower, upper));
    const Vector3d Pa = P * a;
    const Matrix3d expected =
        P - Pa * Pa.transpose() * ((1.0 - cut.variance / variance) / variance);
    ASSERT_LT((estimate.x_hat() - x - Pa * ((cut.mean - c) / variance)).norm(), 1e-10 * Pa.norm());
    ASSERT_LT((estimate.P() - expected).norm(), 1e-10 * P.norm());

    auto inside = estimate_of<TypeParam>(x, P);
    ASSERT_TRUE(truncate(inside, c, a, c - 10.0 * std::sqrt(variance), infinity));
    ASSERT_EQ(inside.x_hat(), x);
    auto nearest = estimate_of<TypeParam>(x, P);
    ASSERT_TRUE(project(nearest, c, a, lower, upper));
    const double bound = std::clamp(c, lower, upper);
    ASSERT_NEAR(a.dot(nearest.x_hat()), bound, 1e-12 * (1.0 + std::abs(bound)));
    // Of all that keep the bound it is the nearest as P measures.
    const Vector3d off = nearest.x_hat() - x;
    const Vector3d along = a.cross(Vector3d(test::normal(random, 3, 1)));
    ASSERT_NEAR(along.dot(Vector3d(test::solve(MatrixXd(P), MatrixXd(off)))), 0.0,
                1e-8 * along.norm() * off.norm());
    for (int k = 0; k < 20; ++k) {
      ASSERT_TRUE(truncate(estimate, a.dot(estimate.x_hat()), a, lower, upper));
    }
    ASSERT_GT(test::cholesky_factor(estimate.P()).diagonal().minCoeff(), 0.0);
  }
}

TEST(StateLimits, WhatCannotBeChangesNothing) {
  const Vector3d x(1.0, 2.0, 3.0);
  const Matrix3d P = Vector3d(1.0, 0.0, 2.0).asDiagonal();
  auto estimate = estimate_of(x, P);
  EXPECT_FALSE(limit_state(estimate, 0, 2.0, 1.0));
  EXPECT_FALSE(limit_state(estimate, 0, nan, 1.0));
  EXPECT_FALSE(limit_state(estimate, 3, 0.0, 1.0));
  EXPECT_FALSE(limit_state(estimate, -1, 0.0, 1.0));
  EXPECT_FALSE(truncate(estimate, nan, Vector3d(Vector3d::UnitX()), 0.0, 1.0));
  EXPECT_FALSE(project(estimate, 1.0, Vector3d(nan, 0.0, 0.0), 2.0, 3.0));
  // Known without error, outside and inside.
  EXPECT_FALSE(limit_state(estimate, 1, 3.0, 4.0));
  EXPECT_FALSE(project(estimate, 2.0, Vector3d(Vector3d::UnitY()), 3.0, 4.0));
  EXPECT_TRUE(limit_state(estimate, 1, 0.0, 4.0));
  EXPECT_EQ(estimate.x_hat(), x);
  EXPECT_EQ(Matrix3d(estimate.P()), P);
  // Two limits at one place: it is known.
  EXPECT_TRUE(limit_state(estimate, 0, 5.0, 5.0));
  EXPECT_EQ(estimate.x_hat()(0), 5.0);
  EXPECT_NEAR(estimate.P()(0, 0), 0.0, 1e-13);  // The form allows for its rounding.
}

// A robot inside the field, whose pose is no vector: c(x) = x of the map, ∂c/∂e = (cos θ, -sin θ,
// 0).
TEST(StateLimits, OfAPose) {
  const Pose2d pose(-0.4, 1.0, 2.0);
  auto estimate = Estimate<Pose2d>::create(pose, MatrixXd(0.25 * Matrix3d::Identity())).value();
  const Vector3d row(std::cos(2.0), -std::sin(2.0), 0.0);
  EXPECT_TRUE(truncate(estimate, pose.x(), row, 0.0, infinity));
  const Moments cut = truncated_normal(-0.4, 0.25, 0.0, infinity);
  EXPECT_NEAR(estimate.x_hat().x(), cut.mean, 1e-12);
  EXPECT_NEAR(estimate.x_hat().y(), 1.0, 1e-12);
  EXPECT_NEAR(row.dot(estimate.P() * row), cut.variance, 1e-12);
}

/// An elevator's carriage that is pushed about and bounces at its stops; its height is measured
/// roughly. @return  The mean squared error of the height.
double elevator_error(bool limited, std::uint64_t seed) {
  Random random(seed);
  test::Plant plant;
  plant.A << 1.0, 0.05, 0.0, 0.0, 0.98, 0.0, 0.0, 0.0, 0.5;
  plant.B << 0.0, 0.05, 0.0;
  plant.C << 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  plant.D.setZero();
  plant.period = Time(0.05);
  const MatrixXd Q = Vector3d(1e-8, 0.01, 0.01).asDiagonal();
  const MatrixXd R = Eigen::Vector2d(0.25, 0.25).asDiagonal();
  using Filter = ModelFilter<test::Plant, JosephCovariance<3>, Extended>;
  auto filter =
      Filter::create(plant, Q, R, {Vector3d(0.5, 0.0, 0.0), MatrixXd(MatrixXd::Identity(3, 3))},
                     plant.period)
          .value();
  Vector3d x(0.5, 0.0, 0.0);
  double error = 0.0;
  constexpr int steps = 400;
  for (int k = 0; k < steps; ++k) {
    const test::U u(2.0 * std::sin(0.02 * k));
    x = plant.A * x + plant.B * u + Vector3d(0.0, 0.1 * random.normal(), 0.1 * random.normal());
    if (x(0) < 0.0 || x(0) > 1.0) {
      x(0) = std::clamp(x(0), 0.0, 1.0);
      x(1) = 0.0;
    }
    filter.predict(u);
    filter.correct(Eigen::Vector2d(x(0) + 0.5 * random.normal(), x(2) + 0.5 * random.normal()), u);
    if (limited) {
      EXPECT_TRUE(filter.limit(0, 0.0, 1.0));
      EXPECT_GE(filter.x_hat()(0), 0.0);
      EXPECT_LE(filter.x_hat()(0), 1.0);
    }
    error += (filter.x_hat()(0) - x(0)) * (filter.x_hat()(0) - x(0)) / steps;
  }
  return error;
}

TEST(StateLimits, AnElevatorBetweenItsStopsIsKnownBetter) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    EXPECT_LT(elevator_error(true, seed), 0.5 * elevator_error(false, seed)) << seed;
  }
}

TEST(StateLimits, AllocateNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  auto joseph = estimate_of(Vector3d::Zero(), Matrix3d::Identity());
  auto root = estimate_of<SquareRootCovariance<3>>(Vector3d::Zero(), Matrix3d::Identity());
  const test::AllocationCounter counter;
  for (int k = 0; k < 20; ++k) {
    limit_state(joseph, k % 3, 0.1, 2.0);
    limit_state(root, k % 3, 0.1, 2.0);
    project(joseph, joseph.x_hat()(0), Vector3d(Vector3d::UnitX()), 0.5, 0.6);
  }
  EXPECT_EQ(counter.count(), 0u);
}

}  // namespace
}  // namespace flyball::state_limits_test
