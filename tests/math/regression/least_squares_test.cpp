#include <flyball/math/regression/least_squares.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/regression/bounded_least_squares.hpp>

#include "support/oracle.hpp"

namespace flyball::least_squares_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double infinity = std::numeric_limits<double>::infinity();

MatrixXd random_matrix(Random& random, Index rows, Index columns) {
  MatrixXd M(rows, columns);
  for (Index i = 0; i < M.size(); ++i) {
    M(i) = random.normal();
  }
  return M;
}

// The line through (0, 1), (1, 3), (2, 4), (3, 4): slope 1, intercept 1.5; residuals -1/2, 1/2,
// 1/2, -1/2; s² = 1/2; (XᵀX)⁻¹ = [7/10 -3/10; -3/10 1/5]; t(0.975, 2) = 0.95/√0.04875.
TEST(LeastSquares, Line) {
  MatrixXd X(4, 2);
  X << 1, 0, 1, 1, 1, 2, 1, 3;
  const VectorXd y = Eigen::Vector4d(1, 3, 4, 4);
  const LeastSquares fit = least_squares(X, y).value();
  EXPECT_NEAR(fit.coefficients(0), 1.5, 1e-15);
  EXPECT_NEAR(fit.coefficients(1), 1.0, 1e-15);
  EXPECT_NEAR(fit.standard_errors(0), std::sqrt(0.35), 1e-15);
  EXPECT_NEAR(fit.standard_errors(1), std::sqrt(0.1), 1e-15);
  EXPECT_NEAR(fit.covariance(0, 1), -0.15, 1e-15);
  EXPECT_NEAR(fit.intervals(1, 1), 1.0 + 0.95 / std::sqrt(0.04875) * std::sqrt(0.1), 1e-12);
  EXPECT_NEAR(fit.leverage(0), 0.7, 1e-15);
  EXPECT_NEAR(fit.leverage(1), 0.3, 1e-15);
  EXPECT_NEAR(fit.r_squared, 1.0 - 1.0 / 6.0, 1e-15);
  EXPECT_NEAR(fit.adjusted_r_squared, 1.0 - 0.25, 1e-15);
  EXPECT_NEAR(fit.durbin_watson, 2.0, 1e-15);  // (1 + 0 + 1)/1.
  EXPECT_EQ(fit.degrees_of_freedom, 2);
  // P(|t| > √10) with 2 degrees of freedom: 1 - √(10/12).
  EXPECT_NEAR(fit.p_values(1), 1.0 - std::sqrt(10.0 / 12.0), 1e-14);
}

MatrixXd bread(const MatrixXd& X, const VectorXd& w) {
  return test::inverse(MatrixXd(X.transpose() * w.asDiagonal() * X));
}

// The definitions, by normal equations.
TEST(LeastSquares, RobustErrors) {
  Random random(11);
  for (int trial = 0; trial < 40; ++trial) {
    const Index n = 8 + trial;
    const Index p = 1 + trial % 4;
    const MatrixXd X = random_matrix(random, n, p);
    const VectorXd y = random_matrix(random, n, 1);
    VectorXd w = random_matrix(random, n, 1).cwiseAbs2();
    if (trial % 2 == 0) {
      w.setOnes();
    }
    LeastSquaresOptions options;
    options.weights = w;
    const MatrixXd B = bread(X, w);
    const VectorXd beta = B * (X.transpose() * w.cwiseProduct(y));
    const VectorXd e = y - X * beta;
    const VectorXd h = (X * B * X.transpose() * w.asDiagonal()).diagonal();
    const double degrees = static_cast<double>(n - p);
    const auto sandwich = [&](const VectorXd& squares) {
      return MatrixXd(B * X.transpose() * w.cwiseAbs2().cwiseProduct(squares).asDiagonal() * X * B);
    };
    const VectorXd squares = e.cwiseAbs2();
    const MatrixXd white = sandwich(squares);
    const auto expect = [&](ErrorModel model, const MatrixXd& covariance) {
      options.errors = model;
      const LeastSquares fit = least_squares(X, y, options).value();
      EXPECT_LT((fit.coefficients - beta).norm(), 1e-12 * beta.norm());
      EXPECT_LT((fit.covariance - covariance).norm(), 1e-11 * covariance.norm());
      EXPECT_LT((fit.leverage - h).norm(), 1e-12);
    };
    expect(ErrorModel::classical, w.dot(squares) / degrees * B);
    expect(ErrorModel::hc0, white);
    expect(ErrorModel::hc1, static_cast<double>(n) / degrees * white);
    expect(ErrorModel::hc2, sandwich(squares.array() / (1.0 - h.array())));
    expect(ErrorModel::hc3, sandwich(squares.array() / (1.0 - h.array()).square()));
    MatrixXd meat = MatrixXd::Zero(p, p);
    for (Index i = 0; i < n; ++i) {
      for (Index j = std::max<Index>(0, i - 3); j < std::min(n, i + 4); ++j) {
        const double weight = 1.0 - static_cast<double>(std::abs(i - j)) / 4.0;
        meat += weight * w(i) * e(i) * w(j) * e(j) * X.row(i).transpose() * X.row(j);
      }
    }
    options.lags = 3;
    expect(ErrorModel::hac, static_cast<double>(n) / degrees * B * meat * B);
  }
}

// Of 1500 regressions with errors whose variance grows with x², 95 % intervals by hc3 hold the
// truth in 95 %; classical ones do not.
TEST(LeastSquares, Coverage) {
  Random random(5);
  int robust = 0;
  int classical = 0;
  constexpr int trials = 1500;
  for (int trial = 0; trial < trials; ++trial) {
    MatrixXd X = random_matrix(random, 60, 2);
    X.col(0).setOnes();
    VectorXd y(60);
    for (Index i = 0; i < 60; ++i) {
      y(i) = 2.0 - X(i, 1) + X(i, 1) * random.normal();
    }
    const auto holds = [&](ErrorModel model) {
      LeastSquaresOptions options;
      options.errors = model;
      const MatrixXd intervals = least_squares(X, y, options)->intervals;
      return intervals(1, 0) <= -1.0 && -1.0 <= intervals(1, 1);
    };
    robust += holds(ErrorModel::hc3) ? 1 : 0;
    classical += holds(ErrorModel::classical) ? 1 : 0;
  }
  EXPECT_NEAR(robust / static_cast<double>(trials), 0.95, 0.02);
  EXPECT_LT(classical / static_cast<double>(trials), 0.8);
}

TEST(LeastSquares, SaysWhatIsNotDetermined) {
  Random random(3);
  MatrixXd X = random_matrix(random, 30, 4);
  X.col(2) = 1e6 * X.col(0) + 2e6 * X.col(3);
  const VectorXd y = random_matrix(random, 30, 1);
  const LeastSquares fit = least_squares(X, y).value();
  EXPECT_EQ(fit.rank, 3);
  EXPECT_EQ(fit.determined, (std::vector<bool>{false, true, false, false}));
  ASSERT_EQ(fit.undetermined.cols(), 1);
  EXPECT_LT((X * fit.undetermined).norm(), 1e-13 * X.norm() * fit.undetermined.norm());
  EXPECT_EQ(fit.standard_errors(0), infinity);
  EXPECT_EQ(fit.intervals(2, 0), -infinity);
  EXPECT_TRUE(std::isfinite(fit.standard_errors(1)));
  // What is determined is as without the column that adds nothing.
  const LeastSquares three = least_squares(X(Eigen::all, {0, 1, 3}), y).value();
  EXPECT_NEAR(fit.coefficients(1), three.coefficients(1), 1e-13);
  EXPECT_NEAR(fit.standard_errors(1), three.standard_errors(1), 1e-13);
  EXPECT_NEAR(fit.residual_squares, three.residual_squares, 1e-12);
  // As many rows as coefficients: values, but nothing about their errors.
  const LeastSquares exact = least_squares(X.topLeftCorner(2, 2), y.head(2)).value();
  EXPECT_EQ(exact.degrees_of_freedom, 0);
  EXPECT_EQ(exact.standard_errors(0), infinity);
  // More coefficients than rows, and nothing at all.
  EXPECT_EQ(least_squares(X.topRows(2), y.head(2))->rank, 2);
  const LeastSquares nothing = least_squares(MatrixXd::Zero(5, 2), y.head(5)).value();
  EXPECT_EQ(nothing.rank, 0);
  EXPECT_EQ(nothing.coefficients.norm(), 0.0);
}

// The units of columns and rows change nothing but the units of the answer.
TEST(LeastSquares, UnitsDoNotMatter) {
  Random random(8);
  const MatrixXd X = random_matrix(random, 40, 3);
  const VectorXd y = random_matrix(random, 40, 1);
  const LeastSquares plain = least_squares(X, y).value();
  const Eigen::Vector3d units(0x1p200, 1.0, 0x1p-200);
  const LeastSquares scaled = least_squares(X * units.asDiagonal(), y).value();
  EXPECT_EQ(scaled.rank, 3);
  for (Index j = 0; j < 3; ++j) {
    EXPECT_NEAR(scaled.coefficients(j) * units(j), plain.coefficients(j), 1e-14);
    EXPECT_NEAR(scaled.standard_errors(j) * units(j), plain.standard_errors(j), 1e-14);
  }
}

// β̂ with C β = d by Lagrange's method: [XᵀX Cᵀ; C 0][β; λ] = [Xᵀy; d].
TEST(LeastSquares, EqualityConstraints) {
  Random random(21);
  for (int trial = 0; trial < 20; ++trial) {
    const MatrixXd X = random_matrix(random, 20, 5);
    const VectorXd y = random_matrix(random, 20, 1);
    LeastSquaresOptions options;
    options.equality = {random_matrix(random, 2, 5), random_matrix(random, 2, 1)};
    MatrixXd K = MatrixXd::Zero(7, 7);
    K.topLeftCorner(5, 5) = X.transpose() * X;
    K.topRightCorner(5, 2) = options.equality->C.transpose();
    K.bottomLeftCorner(2, 5) = options.equality->C;
    VectorXd right(7);
    right << X.transpose() * y, options.equality->d;
    const VectorXd expected = test::solve(K, MatrixXd(right));
    const MatrixXd P = test::inverse(K).topLeftCorner(5, 5);
    const LeastSquares fit = least_squares(X, y, options).value();
    EXPECT_LT((fit.coefficients - expected.head(5)).norm(), 1e-11);
    EXPECT_EQ(fit.degrees_of_freedom, 17);
    EXPECT_LT((fit.covariance - fit.variance * P).norm(), 1e-11);
    // Said twice, a constraint is the same; so is one that fixes a coefficient.
    options.equality->C.row(1) = 3.0 * options.equality->C.row(0);
    options.equality->d(1) = 3.0 * options.equality->d(0);
    EXPECT_EQ(least_squares(X, y, options)->rank, 4);
    options.equality = {MatrixXd::Identity(1, 5), VectorXd::Constant(1, 0.3)};
    const LeastSquares fixed = least_squares(X, y, options).value();
    EXPECT_NEAR(fixed.coefficients(0), 0.3, 1e-15);
    EXPECT_NEAR(fixed.standard_errors(0), 0.0, 1e-15);
    const LeastSquares others = least_squares(X.rightCols(4), y - 0.3 * X.col(0)).value();
    EXPECT_LT((fixed.coefficients.tail(4) - others.coefficients).norm(), 1e-13);
  }
}

TEST(LeastSquares, Refusals) {
  const MatrixXd X = MatrixXd::Identity(3, 2);
  const VectorXd y = VectorXd::Ones(3);
  EXPECT_EQ(to_string(least_squares(X, VectorXd::Ones(2)).error()),
            "least_squares: y is 2x1; it must be rows of X (3x1)");
  EXPECT_TRUE(least_squares(MatrixXd(0, 2), VectorXd(0)).error().is(ArgumentError::empty));
  EXPECT_TRUE(least_squares(infinity * X, y).error().is(ArgumentError::not_finite));
  LeastSquaresOptions options;
  options.weights = Eigen::Vector3d(1, -1, 1);
  EXPECT_TRUE(least_squares(X, y, options).error().is(ArgumentError::out_of_range));
  options.weights = {};
  options.confidence = 1.0;
  EXPECT_TRUE(least_squares(X, y, options).error().is(ArgumentError::out_of_range));
  options.confidence = 0.9;
  options.lags = -1;
  EXPECT_TRUE(least_squares(X, y, options).error().is(ArgumentError::out_of_range));
  options.lags = {};
  options.equality = {MatrixXd::Ones(2, 2), Eigen::Vector2d(1.0, 2.0)};
  EXPECT_TRUE(least_squares(X, y, options).error().is(RegressionError::infeasible));
  options.equality = {};
  // Both rows that are not zero determine their coefficient alone.
  options.errors = ErrorModel::hc3;
  const auto alone = least_squares(X, y, options);
  EXPECT_TRUE(alone.error().is(RegressionError::leverage_one));
  options.errors = ErrorModel::hc1;
  EXPECT_TRUE(least_squares(X, y, options));
}

// min (β - t)² between 0 and 1, one coefficient at a time.
TEST(BoundedLeastSquares, Clamps) {
  const VectorXd target = Eigen::Vector4d(-1.0, 0.3, 2.0, 0.0);
  const auto fit =
      bounded_least_squares(MatrixXd::Identity(4, 4), target, VectorXd::Zero(1), VectorXd::Ones(1))
          .value();
  EXPECT_LT((fit.coefficients - Eigen::Vector4d(0.0, 0.3, 1.0, 0.0)).norm(), 1e-15);
  EXPECT_EQ(fit.state[0], BoundState::at_lower);
  EXPECT_EQ(fit.state[1], BoundState::between);
  EXPECT_EQ(fit.state[2], BoundState::at_upper);
  EXPECT_NEAR(fit.residual_norm, std::sqrt(2.0), 1e-15);
}

// The conditions of Karush, Kuhn and Tucker decide: the problem is convex.
TEST(BoundedLeastSquares, SatisfiesItsConditions) {
  Random random(17);
  for (int trial = 0; trial < 400; ++trial) {
    const Index p = 1 + trial % 12;
    const Index n = 1 + static_cast<Index>(random.uniform(0.0, 20.0));
    MatrixXd X = random_matrix(random, n, p);
    if (trial % 3 == 0 && p > 2) {
      X.col(0) = X.col(1) + 1e-9 * X.col(2);  // Nearly dependent.
    }
    for (Index j = 0; j < p; ++j) {
      X.col(j) *= std::exp(random.uniform(-8.0, 8.0));
    }
    const VectorXd y = random_matrix(random, n, 1);
    VectorXd lower = VectorXd::Zero(p);
    VectorXd upper = VectorXd::Constant(p, infinity);
    for (Index j = 0; trial % 2 == 0 && j < p; ++j) {
      lower(j) = random.uniform() < 0.3 ? -infinity : random.uniform(-2.0, 0.5);
      upper(j) = random.uniform() < 0.3 ? infinity : random.uniform(0.5, 2.0);
    }
    const auto fit = bounded_least_squares(X, y, lower, upper);
    ASSERT_TRUE(fit) << to_string(fit.error());
    for (Index j = 0; j < p; ++j) {
      const double slope = fit->gradient(j) / (X.col(j).norm() * (y.norm() + fit->residual_norm));
      EXPECT_GE(fit->coefficients(j), lower(j));
      EXPECT_LE(fit->coefficients(j), upper(j));
      const BoundState state = fit->state[static_cast<std::size_t>(j)];
      if (state != BoundState::at_upper) {
        EXPECT_GT(slope, -1e-9) << trial;
      }
      if (state != BoundState::at_lower) {
        EXPECT_LT(slope, 1e-9) << trial;
      }
    }
  }
}

TEST(BoundedLeastSquares, Refusals) {
  const MatrixXd X = MatrixXd::Identity(2, 2);
  const VectorXd y = VectorXd::Ones(2);
  const VectorXd zero = VectorXd::Zero(1);
  EXPECT_TRUE(
      bounded_least_squares(X, y, VectorXd::Zero(3), zero).error().is(ArgumentError::wrong_shape));
  EXPECT_EQ(to_string(bounded_least_squares(X, y, VectorXd::Ones(1), zero).error()),
            "bounded_least_squares: the bounds of coefficient 0 is from 1 to 0; it must be "
            "increasing, with a number between them");
  EXPECT_TRUE(
      bounded_least_squares(X, y, zero * infinity, zero).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::least_squares_test
