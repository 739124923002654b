#include <flyball/math/regression/streamed_least_squares.hpp>

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"

namespace flyball::streamed_least_squares_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Data {
  MatrixXd X;
  VectorXd y;
};
Data data(Random& random, Index n, Index p) {
  Data made{MatrixXd(n, p), VectorXd(n)};
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < p; ++j) {
      made.X(i, j) = random.normal() + 3.0;
    }
    made.X(i, 0) = 1.0;
    made.y(i) = made.X.row(i).sum() + random.normal() + 1e4;
  }
  return made;
}

void expect_same(const Regression& streamed, const Regression& whole) {
  EXPECT_EQ(streamed.rows, whole.rows);
  EXPECT_EQ(streamed.rank, whole.rank);
  EXPECT_LT((streamed.coefficients - whole.coefficients).norm(), 1e-12 * whole.coefficients.norm());
  EXPECT_LT((streamed.covariance - whole.covariance).norm(), 1e-9 * whole.covariance.norm());
  EXPECT_LT((streamed.intervals - whole.intervals).norm(), 1e-9 * whole.intervals.norm());
  EXPECT_NEAR(streamed.residual_squares, whole.residual_squares, 1e-9 * whole.residual_squares);
  EXPECT_NEAR(streamed.r_squared, whole.r_squared, 1e-10);
}

// Rows one by one, in blocks and merged from parts are the rows together.
TEST(StreamedLeastSquares, IsTheWholeRegression) {
  Random random(2);
  for (const Index p : {1, 2, 5, 40}) {
    for (const Index n : {1, 3, 64, 200, 1001}) {
      const Data all = data(random, n, p);
      const Regression whole = least_squares(all.X, all.y).value();
      auto one = StreamedLeastSquares::create(p).value();
      ASSERT_TRUE(one.add(all.X, all.y));
      if (whole.degrees_of_freedom > 0) {
        expect_same(one.solve().value(), whole);
      } else {
        EXPECT_EQ(one.solve()->rank, whole.rank);
      }
      auto parts = StreamedLeastSquares::create(p).value();
      auto other = StreamedLeastSquares::create(p).value();
      const Index cut = n / 3;
      ASSERT_TRUE(parts.add(all.X.topRows(cut), all.y.head(cut)));
      ASSERT_TRUE(other.add(all.X.bottomRows(n - cut), all.y.tail(n - cut)));
      ASSERT_TRUE(parts.merge(other));
      if (whole.degrees_of_freedom > 0) {
        expect_same(parts.solve().value(), whole);
      }
    }
  }
}

TEST(StreamedLeastSquares, Weights) {
  Random random(4);
  const Data all = data(random, 150, 3);
  LeastSquaresOptions options;
  options.weights = VectorXd::LinSpaced(150, 0.0, 2.0);
  auto stream = StreamedLeastSquares::create(3).value();
  for (Index i = 0; i < 150; ++i) {
    const VectorXd x = all.X.row(i);
    EXPECT_TRUE(stream.add(x.data(), all.y(i), (*options.weights)(i)));
  }
  expect_same(stream.solve().value(), least_squares(all.X, all.y, options).value());
}

// A million rows of constant memory; the slope of a line far from its origin keeps its digits.
TEST(StreamedLeastSquares, ManyRowsWithoutAllocation) {
  auto stream = StreamedLeastSquares::create(2).value();
  const test::AllocationCounter allocations;
  for (int i = 0; i < 1'000'000; ++i) {
    const double x[] = {1.0, 1e6 + i};
    stream.add(x, 5.0 + 1e-3 * x[1] + (i % 3 - 1.0));
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(allocations.count(), 0u);
  }
  const Regression fit = stream.solve().value();
  EXPECT_EQ(fit.rows, 1'000'000);
  EXPECT_NEAR(fit.coefficients(1), 1e-3, 1e-11);
  EXPECT_NEAR(fit.variance, 2.0 / 3.0, 1e-5);
}

TEST(StreamedLeastSquares, Refusals) {
  EXPECT_TRUE(StreamedLeastSquares::create(0).error().is(ArgumentError::out_of_range));
  auto stream = StreamedLeastSquares::create(2).value();
  EXPECT_TRUE(stream.solve().error().is(ArgumentError::empty));
  const double x[] = {1.0, std::nan("")};
  EXPECT_FALSE(stream.add(x, 1.0));
  const double good[] = {1.0, 2.0};
  EXPECT_FALSE(stream.add(good, 1e101));
  EXPECT_FALSE(stream.add(good, 1.0, -1.0));
  EXPECT_EQ(stream.rows(), 0);
  EXPECT_TRUE(
      stream.add(MatrixXd::Ones(2, 3), VectorXd::Ones(2)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(stream.add(MatrixXd::Ones(2, 2), VectorXd::Constant(2, std::nan("")))
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(stream.add(MatrixXd::Constant(2, 2, 1e101), VectorXd::Ones(2))
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_EQ(stream.rows(), 0);
  EXPECT_TRUE(
      stream.merge(StreamedLeastSquares::create(3).value()).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(stream.add(good, 1.0));
  EXPECT_TRUE(stream.solve(1.5).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::streamed_least_squares_test
