#include <flyball/optimization/least_squares_statistics.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "support/oracle.hpp"

namespace flyball::optimization::least_squares_statistics_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double infinity = std::numeric_limits<double>::infinity();

std::shared_ptr<const ResidualBlock> linear(const MatrixXd& A, const VectorXd& b) {
  return residual_block(A.rows(), A.cols(), [A, b](const VectorXd& x, VectorXd& r, MatrixXd* J) {
    r = A * x - b;
    if (J != nullptr) {
      *J = A;
    }
    return true;
  });
}

struct Regression {
  MatrixXd A;
  LeastSquaresProblem problem;
  LeastSquaresResult result;
};
Regression regression() {
  Random random(2);
  Regression made;
  made.A = MatrixXd::NullaryExpr(30, 3, [&] { return random.normal(); });
  const VectorXd b = made.A * Eigen::Vector3d(1.0, -2.0, 0.5) +
                     VectorXd::NullaryExpr(30, [&] { return 0.3 * random.normal(); });
  made.problem = {.blocks = {linear(made.A, b)}, .start = VectorXd::Zero(3)};
  made.result = solve_least_squares(made.problem).value();
  return made;
}

// s² (AᵀA)⁻¹ with s² = Σr²/27.
TEST(LeastSquaresStatistics, CovarianceOfALinearModelIsTheTextbooks) {
  const Regression fit = regression();
  const auto covariance = covariance_of(fit.problem, fit.result);
  ASSERT_TRUE(covariance);
  const double s2 = fit.result.cost / 27.0;
  const MatrixXd inverse = test::inverse(MatrixXd(fit.A.transpose() * fit.A));
  EXPECT_LT((covariance->matrix - s2 * inverse).norm(), 1e-13);
  EXPECT_EQ(covariance->freedom, 27.0);
  EXPECT_NEAR(covariance->sigma, std::sqrt(s2), 1e-14);
  const auto known = covariance_of(fit.problem, fit.result, {.scale_is_known = true});
  ASSERT_TRUE(known);
  EXPECT_LT((known->matrix - inverse).norm(), 1e-12);
}

// White: (AᵀA)⁻¹ Aᵀ diag(r²) A (AᵀA)⁻¹ n/(n - p). Rows that are there twice, one after the other,
// double JᵀJ and, in batches of two, quadruple the middle.
TEST(LeastSquaresStatistics, TheSandwichIsWhites) {
  const Regression fit = regression();
  VectorXd r(30);
  ASSERT_TRUE(fit.problem.blocks[0]->evaluate(fit.result.x, r, nullptr));
  const MatrixXd inverse = test::inverse(MatrixXd(fit.A.transpose() * fit.A));
  const MatrixXd white = inverse * fit.A.transpose() * r.cwiseAbs2().asDiagonal() * fit.A * inverse;
  const auto covariance = covariance_of(fit.problem, fit.result, {.batch = 1});
  ASSERT_TRUE(covariance);
  EXPECT_LT((covariance->matrix - white * 30.0 / 27.0).norm(), 1e-13);

  MatrixXd twice(60, 3);
  VectorXd b(60);
  for (Index i = 0; i < 60; ++i) {
    twice.row(i) = fit.A.row(i / 2);
    b(i) = fit.A.row(i / 2).dot(fit.result.x) - r(i / 2);
  }
  const LeastSquaresProblem doubled{.blocks = {linear(twice, b)}, .start = fit.result.x};
  const auto batches = covariance_of(doubled, solve_least_squares(doubled).value(), {.batch = 2});
  ASSERT_TRUE(batches);
  EXPECT_LT((batches->matrix - white * 60.0 / 57.0).norm(), 1e-12);
}

TEST(LeastSquaresStatistics, OneResidualAParameterHasNoVariance) {
  const LeastSquaresProblem problem{.blocks = {linear(MatrixXd::Identity(2, 2), VectorXd::Ones(2))},
                                    .start = VectorXd::Zero(2)};
  const auto result = solve_least_squares(problem);
  ASSERT_TRUE(result);
  const auto covariance = covariance_of(problem, *result);
  ASSERT_FALSE(covariance);
  EXPECT_TRUE(covariance.error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(covariance_of(problem, *result, {.scale_is_known = true}));
}

/// Runs of y = a t + s with a shared slope: blocks, and the same as one block.
TEST(LeastSquaresStatistics, BlocksGiveTheStandardErrorsOfOneBlock) {
  Random random(4);
  constexpr Index rows = 8;
  constexpr Index count = 5;
  MatrixXd whole = MatrixXd::Zero(rows * count, 1 + count);
  VectorXd b(rows * count);
  LeastSquaresProblem blocks;
  blocks.start = VectorXd::Zero(1 + count);
  for (Index j = 0; j < count; ++j) {
    MatrixXd A(rows, 2);
    VectorXd y(rows);
    for (Index i = 0; i < rows; ++i) {
      A.row(i) << random.uniform(), 1.0;
      y(i) = 2.0 * A(i, 0) + random.normal();
    }
    whole.block(rows * j, 0, rows, 1) = A.col(0);
    whole.block(rows * j, 1 + j, rows, 1) = A.col(1);
    b.segment(rows * j, rows) = y;
    blocks.blocks.push_back(residual_block(rows, std::vector<Index>{0, 1 + j},
                                           [A, y](const VectorXd& x, VectorXd& r, MatrixXd* J) {
                                             r = A * x - y;
                                             if (J != nullptr) {
                                               *J = A;
                                             }
                                             return true;
                                           }));
  }
  const LeastSquaresProblem dense{.blocks = {linear(whole, b)}, .start = blocks.start};
  for (const Index batch : {0, 1, 4}) {
    const auto arrow = covariance_of(blocks, solve_least_squares(blocks).value(), {.batch = batch});
    const auto one = covariance_of(dense, solve_least_squares(dense).value(), {.batch = batch});
    ASSERT_TRUE(arrow);
    ASSERT_TRUE(one);
    EXPECT_EQ(arrow->parameters, std::vector<Index>{0});
    EXPECT_LT((arrow->standard_errors - one->standard_errors).cwiseAbs().maxCoeff(), 1e-12)
        << "batch " << batch;
    EXPECT_NEAR(arrow->matrix(0, 0), one->matrix(0, 0), 1e-13);
  }
}

// Of a linear model the profile is t standard errors on both sides.
TEST(LeastSquaresStatistics, ProfileOfALinearModelIsStudents) {
  const Regression fit = regression();
  const auto covariance = covariance_of(fit.problem, fit.result).value();
  for (Index i = 0; i < 3; ++i) {
    const auto interval = profile_interval(fit.problem, fit.result, i, {.confidence = 0.9});
    ASSERT_TRUE(interval);
    const double half = student_quantile(0.95, 27.0) * covariance.standard_errors(i);
    EXPECT_NEAR(interval->low, fit.result.x(i) - half, 1e-3 * half);
    EXPECT_NEAR(interval->high, fit.result.x(i) + half, 1e-3 * half);
    EXPECT_FALSE(interval->low_is_open || interval->high_is_open || interval->better);
  }
}

// r = y - eᵇ: the profile of b is the logarithm of that of eᵇ, which a standard error is not.
TEST(LeastSquaresStatistics, ProfileDoesNotDependOnTheCoordinate) {
  const VectorXd y = (VectorXd(6) << 1.0, 3.0, 2.0, 2.5, 1.5, 2.0).finished();
  const LeastSquaresProblem problem{
      .blocks = {residual_block(6, Index{1},
                                [y](const VectorXd& x, VectorXd& r, MatrixXd* J) {
                                  r = VectorXd::Constant(6, std::exp(x(0))) - y;
                                  if (J != nullptr) {
                                    J->setConstant(std::exp(x(0)));
                                  }
                                  return true;
                                })},
      .start = VectorXd::Zero(1)};
  const auto result = solve_least_squares(problem).value();
  const auto interval = profile_interval(problem, result, 0).value();
  const double mean = y.mean();
  const double half =
      student_quantile(0.975, 5.0) * std::sqrt((y.array() - mean).square().sum() / 5.0 / 6.0);
  EXPECT_NEAR(std::exp(interval.low), mean - half, 1e-3 * half);
  EXPECT_NEAR(std::exp(interval.high), mean + half, 1e-3 * half);
}

// 1 - e^(-k) with readings near 1: no k is too large. And one whose lower bound is nearer than its
// interval's end.
TEST(LeastSquaresStatistics, AnIntervalWithoutAnEndIsOpen) {
  const VectorXd y = (VectorXd(4) << 0.7, 1.1, 0.9, 1.0).finished();
  LeastSquaresProblem problem{
      .blocks = {residual_block(4, Index{1},
                                [y](const VectorXd& x, VectorXd& r, MatrixXd* J) {
                                  r = VectorXd::Constant(4, 1.0 - std::exp(-x(0))) - y;
                                  if (J != nullptr) {
                                    J->setConstant(std::exp(-x(0)));
                                  }
                                  return true;
                                })},
      .start = VectorXd::Ones(1),
      .lower = VectorXd::Constant(1, 2.0),
      .upper = VectorXd::Constant(1, infinity)};
  const auto result = solve_least_squares(problem).value();
  const auto interval = profile_interval(problem, result, 0).value();
  EXPECT_TRUE(interval.high_is_open);
  EXPECT_EQ(interval.high, infinity);
  EXPECT_TRUE(interval.low_is_open);
  EXPECT_EQ(interval.low, 2.0);
}

// From a minimum that is not the least, the profile meets the better one.
TEST(LeastSquaresStatistics, AProfileTellsOfABetterMinimum) {
  const LeastSquaresProblem problem{
      .blocks = {residual_block(2, Index{1},
                                [](const VectorXd& x, VectorXd& r, MatrixXd* J) {
                                  const double q = x(0) * x(0) - 1.0;
                                  r << q, 1.0 + 0.5 * x(0);
                                  if (J != nullptr) {
                                    *J << 2.0 * x(0), 0.5;
                                  }
                                  return true;
                                })},
      .start = VectorXd::Ones(1)};
  const auto result = solve_least_squares(problem).value();
  const auto interval =
      profile_interval(problem, result, 0, {.covariance = {.scale_is_known = true}}).value();
  ASSERT_TRUE(interval.better);
  EXPECT_LT((*interval.better)(0), 0.0);
}

// The mean of n readings: the samples' spread is √(Σ(y - ȳ)²/n)/√n, and half of them lie within
// the quartiles.
TEST(LeastSquaresStatistics, BootstrapOfAMeanHasItsSpread) {
  Random random(9);
  const VectorXd y = VectorXd::NullaryExpr(60, [&] { return random.normal(); });
  const LeastSquaresProblem problem{.blocks = {linear(MatrixXd::Ones(60, 1), y)},
                                    .start = VectorXd::Zero(1)};
  const auto result = solve_least_squares(problem).value();
  const auto samples = bootstrap(problem, result, {.samples = 2000, .seed = 3}).value();
  EXPECT_EQ(samples.failed, 0);
  ASSERT_EQ(samples.x.cols(), 2000);
  const double spread = std::sqrt((y.array() - y.mean()).square().mean() / 60.0);
  const double mean = samples.x.mean();
  const double found = std::sqrt((samples.x.array() - mean).square().mean());
  EXPECT_NEAR(found / spread, 1.0, 0.06);  // 4/√(2·2000)
  EXPECT_NEAR(mean, y.mean(), 4.0 * spread / std::sqrt(2000.0));
  EXPECT_NEAR((samples.quantile(0.75) - samples.quantile(0.25))(0) / spread, 1.349, 0.1);
  EXPECT_EQ(bootstrap(problem, result, {.samples = 20, .seed = 3})->x,
            bootstrap(problem, result, {.samples = 20, .seed = 3})->x);
  EXPECT_FALSE(bootstrap(problem, result, {.samples = 0}));
}

// Readings that come in tens of the same: drawn one by one the spread is too small by √10; forty at
// a time, less what the cut groups and the few starts lose.
TEST(LeastSquaresStatistics, ResidualsThatDependOnEachOtherAreDrawnTogether) {
  Random random(10);
  VectorXd y(400);
  for (Index i = 0; i < 400; i += 10) {
    y.segment(i, 10).setConstant(random.normal());
  }
  const LeastSquaresProblem problem{.blocks = {linear(MatrixXd::Ones(400, 1), y)},
                                    .start = VectorXd::Zero(1)};
  const auto result = solve_least_squares(problem).value();
  const auto spread = [&](Index batch) {
    const auto samples = bootstrap(problem, result, {.samples = 1000, .batch = batch}).value();
    return std::sqrt((samples.x.array() - samples.x.mean()).square().mean());
  };
  const double ratio = spread(40) / spread(1);
  EXPECT_GT(ratio, 2.2);
  EXPECT_LT(ratio, 3.6);
}

}  // namespace
}  // namespace flyball::optimization::least_squares_statistics_test
