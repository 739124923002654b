#include <flyball/optimization/least_squares.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/oracle.hpp"

namespace flyball::optimization::least_squares_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

VectorXd vector(std::initializer_list<double> values) {
  VectorXd v(static_cast<Index>(values.size()));
  std::copy(values.begin(), values.end(), v.begin());
  return v;
}

/// r = A x - b.
std::shared_ptr<const ResidualBlock> linear(const MatrixXd& A, const VectorXd& b) {
  return residual_block(A.rows(), A.cols(), [A, b](const VectorXd& x, VectorXd& r, MatrixXd* J) {
    r = A * x - b;
    if (J != nullptr) {
      *J = A;
    }
    return true;
  });
}

std::shared_ptr<const ResidualBlock> rosenbrock(double unit = 1.0) {
  return residual_block(2, Index{2}, [unit](const VectorXd& x, VectorXd& r, MatrixXd* J) {
    const double x1 = x(0);
    const double x2 = x(1) / unit;
    r << 10.0 * (x2 - x1 * x1), 1.0 - x1;
    if (J != nullptr) {
      *J << -20.0 * x1, 10.0 / unit, -1.0, 0.0;
    }
    return true;
  });
}

// On x1 ≤ 1/2 the least of 100(x2 - x1²)² + (1 - x1)² is 1/4, at (1/2, 1/4).
TEST(LeastSquares, ABoundThatHoldsIsMetExactlyAndSaidSo) {
  const auto result = solve_least_squares({.blocks = {rosenbrock()},
                                           .start = vector({-1.2, 1.0}),
                                           .lower = vector({-infinity, -infinity}),
                                           .upper = vector({0.5, infinity})});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->stop, LeastSquaresStop::optimal);
  EXPECT_EQ(result->x(0), 0.5);
  EXPECT_NEAR(result->x(1), 0.25, 1e-12);
  EXPECT_NEAR(result->cost, 0.25, 1e-15);
  EXPECT_EQ(result->bounds, (std::vector{Bound::upper, Bound::none}));
  EXPECT_EQ(result->free, 1);
  EXPECT_EQ(result->rank, 1);
  EXPECT_LT(result->optimality, 1e-8);
  EXPECT_LT(result->projected_gradient, 1e-8);
}

TEST(LeastSquares, BoundsThatDoNotHoldChangeNothing) {
  const auto result = solve_least_squares({.blocks = {rosenbrock()},
                                           .start = vector({-1.2, 9.0}),
                                           .lower = vector({-5.0, -5.0}),
                                           .upper = vector({5.0, 5.0})});
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->converged);
  EXPECT_NEAR(result->x(0), 1.0, 1e-10);
  EXPECT_NEAR(result->x(1), 1.0, 1e-10);
  EXPECT_EQ(result->bounds, (std::vector{Bound::none, Bound::none}));
}

TEST(LeastSquares, EqualBoundsFixAParameterAndTheStartMovesIntoThem) {
  const auto result = solve_least_squares({.blocks = {rosenbrock()},
                                           .start = vector({-1.2, 1.0}),
                                           .lower = vector({-infinity, 4.0}),
                                           .upper = vector({infinity, 4.0})});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->x(1), 4.0);
  EXPECT_EQ(result->bounds[1], Bound::fixed);
  // 2·10(4 - x²)(-20x)… = 0 of 100(4 - x²)² + (1 - x)²: 200 x³ - 799 x - 1 = 0 near -2 or 2.
  const double x = result->x(0);
  EXPECT_NEAR(200.0 * x * x * x - 799.0 * x - 1.0, 0.0, 1e-5);
}

/// The least ‖A x - b‖² over a box: the best of all sets of active bounds that is feasible.
double least_over_box(const MatrixXd& A, const VectorXd& b, const VectorXd& low,
                      const VectorXd& high) {
  const Index n = A.cols();
  double best = infinity;
  for (int code = 0; code < std::pow(3, n); ++code) {
    VectorXd x(n);
    std::vector<Index> free;
    int rest = code;
    for (Index i = 0; i < n; ++i, rest /= 3) {
      x(i) = rest % 3 == 1 ? low(i) : rest % 3 == 2 ? high(i) : 0.0;
      if (rest % 3 == 0) {
        free.push_back(i);
      }
    }
    if (!free.empty()) {
      const VectorXd solved = test::least_squares(A(Eigen::all, free), b - A * x);
      for (std::size_t i = 0; i < free.size(); ++i) {
        x(free[i]) = solved(static_cast<Index>(i));
      }
    }
    if ((x.array() >= low.array() - 1e-12).all() && (x.array() <= high.array() + 1e-12).all()) {
      best = std::min(best, (A * x - b).squaredNorm());
    }
  }
  return best;
}

TEST(LeastSquares, ALinearProblemInABoxIsSolvedAsTheBestOfAllActiveSets) {
  Random random(7);
  for (int k = 0; k < 200; ++k) {
    const MatrixXd A = MatrixXd::NullaryExpr(9, 5, [&] { return random.normal(); });
    const VectorXd b = VectorXd::NullaryExpr(9, [&] { return 3.0 * random.normal(); });
    const VectorXd low = VectorXd::NullaryExpr(5, [&] { return -random.uniform(); });
    const VectorXd high = VectorXd::NullaryExpr(5, [&] { return random.uniform(); });
    const auto result = solve_least_squares(
        {.blocks = {linear(A, b)}, .start = VectorXd::Zero(5), .lower = low, .upper = high});
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->converged) << to_string(result->stop);
    EXPECT_NEAR(result->cost, least_over_box(A, b, low, high), 1e-12 * b.squaredNorm());
  }
}

// A power of two as the unit scales every number of a column and no digit.
TEST(LeastSquares, TheUnitOfAParameterChangesNoIteration) {
  const double unit = std::ldexp(1.0, 40);
  const auto plain = solve_least_squares({.blocks = {rosenbrock()}, .start = vector({-1.2, 1.0})});
  const auto scaled =
      solve_least_squares({.blocks = {rosenbrock(unit)}, .start = vector({-1.2, unit})});
  ASSERT_TRUE(plain);
  ASSERT_TRUE(scaled);
  EXPECT_TRUE(plain->converged);
  EXPECT_EQ(plain->iterations, scaled->iterations);
  EXPECT_EQ(plain->x(0), scaled->x(0));
  EXPECT_EQ(unit * plain->x(1), scaled->x(1));
  EXPECT_EQ(plain->cost, scaled->cost);
}

/// y = a b t at t = 1 … 5, where y = 6 t + (-1)ᵗ: only the product is determined.
TEST(LeastSquares, WhatIsNotDeterminedIsNamed) {
  const auto block = residual_block(5, Index{3}, [](const VectorXd& x, VectorXd& r, MatrixXd* J) {
    for (Index i = 0; i < 5; ++i) {
      const double t = static_cast<double>(i + 1);
      r(i) = x(0) * x(1) * t - (6.0 * t + (i % 2 == 0 ? -1.0 : 1.0));
      if (J != nullptr) {
        J->row(i) << x(1) * t, x(0) * t, 0.0;
      }
    }
    return true;
  });
  const auto result = solve_least_squares({.blocks = {block}, .start = vector({1.0, 1.0, 8.0})});
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->converged);
  EXPECT_NEAR(result->x(0) * result->x(1), 6.0 - 3.0 / 55.0, 1e-10);  // Σ t y/Σ t²
  EXPECT_EQ(result->x(2), 8.0);
  EXPECT_EQ(result->rank, 1);
  ASSERT_EQ(result->undetermined.cols(), 2);
  // One of them is b alone of the third, the other a against b by equal shares of their columns.
  for (Index k = 0; k < 2; ++k) {
    const VectorXd v = result->undetermined.col(k);
    EXPECT_NEAR(v(0) + v(1), 0.0, 1e-9);
    EXPECT_EQ(v.cwiseAbs().maxCoeff(), 1.0);
  }
}

// log x - 1 on data that ask for x = e, started where a full step leaves x > 0.
TEST(LeastSquares, WhereResidualsAreNotDefinedIsNotEntered) {
  for (const bool says_so : {true, false}) {
    const auto block =
        residual_block(1, Index{1}, [says_so](const VectorXd& x, VectorXd& r, MatrixXd* J) {
          if (says_so && x(0) <= 0.0) {
            return false;
          }
          r(0) = x(0) <= 0.0 ? nan : std::log(x(0)) - 1.0;
          if (J != nullptr) {
            (*J)(0, 0) = 1.0 / x(0);
          }
          return true;
        });
    const auto result = solve_least_squares({.blocks = {block}, .start = vector({50.0})});
    ASSERT_TRUE(result);
    EXPECT_EQ(result->stop, LeastSquaresStop::zero_residual);
    EXPECT_NEAR(result->x(0), std::exp(1.0), 1e-14);
  }
}

TEST(LeastSquares, AStartWithoutResidualsIsRefusedInASentence) {
  const auto block = residual_block(3, Index{1}, [](const VectorXd& x, VectorXd& r, MatrixXd* J) {
    r << x(0), nan, 1.0;
    if (J != nullptr) {
      J->setOnes();
    }
    return true;
  });
  const auto result = solve_least_squares({.blocks = {block}, .start = vector({2.0})});
  ASSERT_FALSE(result);
  EXPECT_TRUE(result.error().is(LeastSquaresError::no_start));
  EXPECT_EQ(to_string(result.error()),
            "solve_least_squares: residual 2 at the start is not finite, or its derivatives are "
            "not; it must be finite, with finite derivatives; start elsewhere, or bound the "
            "parameters to where the residuals are defined (start = 2)");
}

TEST(LeastSquares, AProblemThatDoesNotFitTogetherIsRefused) {
  const auto block = rosenbrock();
  const auto refusal = [&](LeastSquaresProblem problem) {
    const auto result = solve_least_squares(problem);
    return result ? std::string("accepted") : std::string(result.error().code());
  };
  const VectorXd two = vector({1.0, 1.0});
  EXPECT_EQ(refusal({.blocks = {block}}), "empty");
  EXPECT_EQ(refusal({.blocks = {block}, .start = vector({1.0, nan})}), "not_finite");
  EXPECT_EQ(refusal({.blocks = {block}, .start = vector({1.0})}), "out_of_range");
  EXPECT_EQ(refusal({.blocks = {nullptr}, .start = two}), "empty");
  EXPECT_EQ(refusal({.start = two}), "no_residuals");
  EXPECT_EQ(refusal({.blocks = {block}, .start = two, .lower = vector({1.0})}), "wrong_shape");
  EXPECT_EQ(refusal({.blocks = {block},
                     .start = two,
                     .lower = vector({2.0, 0.0}),
                     .upper = vector({1.0, 1.0})}),
            "out_of_range");
  EXPECT_EQ(refusal({.blocks = {block}, .start = two, .upper = vector({nan, 1.0})}),
            "out_of_range");
  EXPECT_EQ(refusal({.blocks = {block}, .start = two, .prior_mean = two}), "wrong_shape");
  EXPECT_EQ(
      refusal(
          {.blocks = {block}, .start = two, .prior_mean = two, .prior_std = vector({1.0, 0.0})}),
      "out_of_range");
  EXPECT_EQ(refusal({.blocks = {block}, .start = two, .loss = {Loss::huber, 0.0}}), "not_positive");
}

// n readings of x with σ = 1 and a prior m ± s: the mean weighted by n and 1/s².
TEST(LeastSquares, APriorIsAReadingOfItsWidth) {
  const VectorXd readings = vector({3.0, 5.0, 4.0, 4.0});
  const auto result = solve_least_squares({.blocks = {linear(MatrixXd::Ones(4, 1), readings)},
                                           .start = vector({0.0}),
                                           .prior_mean = vector({10.0}),
                                           .prior_std = vector({0.5})});
  ASSERT_TRUE(result);
  EXPECT_NEAR(result->x(0), (16.0 + 40.0) / 8.0, 1e-12);
  EXPECT_NEAR(result->cost, 16.0 + 4.0 + 9.0 + 9.0 + 36.0, 1e-12);
}

// A prior alone, of a parameter that no residual has.
TEST(LeastSquares, APriorAloneDeterminesItsParameter) {
  const auto result = solve_least_squares({.blocks = {linear(MatrixXd::Ones(1, 1), vector({3.0}))},
                                           .start = vector({0.0, 0.0}),
                                           .prior_mean = vector({0.0, 7.0}),
                                           .prior_std = vector({infinity, 2.0})});
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->converged);
  EXPECT_NEAR(result->x(1), 7.0, 1e-12);
  EXPECT_EQ(result->rank, 2);
}

/// A line y = 2 + 3 t with noise of 0.01, and of every fifth reading 20 too much.
LeastSquaresProblem with_outliers(RobustLoss loss) {
  Random random(3);
  MatrixXd A(50, 2);
  VectorXd b(50);
  for (Index i = 0; i < 50; ++i) {
    const double t = 0.1 * static_cast<double>(i);
    A.row(i) << 1.0, t;
    b(i) = 2.0 + 3.0 * t + 0.01 * random.normal() + (i % 5 == 0 ? 20.0 : 0.0);
  }
  return {.blocks = {linear(A, b)}, .start = vector({0.0, 0.0}), .loss = loss};
}

TEST(LeastSquares, RobustLossesResistOutliers) {
  const auto squares = solve_least_squares(with_outliers({}));
  ASSERT_TRUE(squares);
  EXPECT_GT(std::abs(squares->x(0) - 2.0), 3.0);
  for (const auto& [loss, error] :
       {std::pair{Loss::soft_l1, 0.02}, {Loss::huber, 0.02}, {Loss::cauchy, 0.006}}) {
    const auto result = solve_least_squares(with_outliers({loss, 0.02}));
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->converged) << to_string(loss) << ": " << to_string(result->stop);
    EXPECT_NEAR(result->x(0), 2.0, error) << to_string(loss);
    EXPECT_NEAR(result->x(1), 3.0, error) << to_string(loss);
  }
  // Tukey's forgets them altogether, from a start that is near.
  LeastSquaresProblem problem = with_outliers({Loss::tukey, 0.06});
  problem.start = vector({2.01, 3.01});
  const auto tukey = solve_least_squares(problem);
  ASSERT_TRUE(tukey);
  EXPECT_TRUE(tukey->converged);
  EXPECT_NEAR(tukey->x(0), 2.0, 0.006);
  EXPECT_NEAR(tukey->cost, 10.0 * 0.06 * 0.06 / 3.0 + 40.0 * 1e-4, 2e-3);
}

// A minimum is where Σ ρ'(r²) r ∂r/∂x vanishes.
TEST(LeastSquares, TheGradientOfARobustLossVanishesAtItsMinimum) {
  for (const Loss loss : {Loss::soft_l1, Loss::huber, Loss::cauchy}) {
    const LeastSquaresProblem problem = with_outliers({loss, 0.02});
    const auto result = solve_least_squares(problem);
    ASSERT_TRUE(result);
    VectorXd r(50);
    MatrixXd J(50, 2);
    ASSERT_TRUE(problem.blocks[0]->evaluate(result->x, r, &J));
    VectorXd gradient = VectorXd::Zero(2);
    double pulls = 0.0;
    for (Index i = 0; i < 50; ++i) {
      const double pull = problem.loss(r(i) * r(i)).slope * r(i);
      gradient += pull * J.row(i).transpose();
      pulls += std::abs(pull);
    }
    EXPECT_LT(gradient.norm(), 1e-6 * pulls) << to_string(loss);
  }
}

/// Runs of y = v(1 - e^(-k t)) + s with a common k and v, and the start s of each.
struct Runs {
  LeastSquaresProblem blocks;  ///< A block a run.
  LeastSquaresProblem dense;   ///< The same as one block.
};
Runs runs(Index count) {
  Random random(11);
  constexpr Index rows = 12;
  const auto model = [](double k, double v, double s, double t) {
    return v * (1.0 - std::exp(-k * t)) + s;
  };
  MatrixXd y(rows, count);
  for (Index j = 0; j < count; ++j) {
    for (Index i = 0; i < rows; ++i) {
      y(i, j) = model(0.7, 2.0, 0.1 * static_cast<double>(j), 0.5 * static_cast<double>(i)) +
                0.05 * random.normal();
    }
  }
  const auto fill = [model](const VectorXd& x, double s, const VectorXd& readings, auto r,
                            MatrixXd* J, Index first, Index column) {
    for (Index i = 0; i < rows; ++i) {
      const double t = 0.5 * static_cast<double>(i);
      r(first + i) = model(x(0), x(1), s, t) - readings(i);
      if (J != nullptr) {
        (*J)(first + i, 0) = x(1) * t * std::exp(-x(0) * t);
        (*J)(first + i, 1) = 1.0 - std::exp(-x(0) * t);
        (*J)(first + i, column) = 1.0;
      }
    }
  };
  Runs made;
  for (Index j = 0; j < count; ++j) {
    const VectorXd readings = y.col(j);
    made.blocks.blocks.push_back(
        residual_block(rows, std::vector<Index>{0, 1, 2 + j},
                       [fill, readings](const VectorXd& x, VectorXd& r, MatrixXd* J) {
                         fill(x, x(2), readings, r.head(rows), J, 0, 2);
                         return true;
                       }));
  }
  made.dense.blocks = {residual_block(
      rows * count, 2 + count, [fill, y, count](const VectorXd& x, VectorXd& r, MatrixXd* J) {
        for (Index j = 0; j < count; ++j) {
          fill(x, x(2 + j), y.col(j), r.head(rows * count), J, rows * j, 2 + j);
        }
        return true;
      })};
  made.blocks.start = VectorXd::Ones(2 + count);
  made.blocks.lower = VectorXd::Constant(2 + count, -infinity);
  made.blocks.upper = VectorXd::Constant(2 + count, infinity);
  made.blocks.upper(4) = 0.05;  // below where the third run starts
  made.blocks.prior_mean = VectorXd::Constant(2 + count, 0.5);
  made.blocks.prior_std = VectorXd::Constant(2 + count, infinity);
  made.blocks.prior_std(3) = 0.1;
  made.blocks.prior_std(0) = 1.0;
  const auto block = made.dense.blocks;
  made.dense = made.blocks;
  made.dense.blocks = block;
  return made;
}

TEST(LeastSquares, RunsWithTheirOwnStartsGiveWhatOneBlockGives) {
  const Runs both = runs(6);
  const auto blocks = solve_least_squares(both.blocks);
  const auto dense = solve_least_squares(both.dense);
  ASSERT_TRUE(blocks);
  ASSERT_TRUE(dense);
  EXPECT_TRUE(blocks->converged);
  EXPECT_LT((blocks->x - dense->x).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(blocks->cost, dense->cost, 1e-12);
  EXPECT_EQ(blocks->rank, 7);
  EXPECT_EQ(dense->rank, 7);
  EXPECT_EQ(blocks->bounds, dense->bounds);
  EXPECT_EQ(blocks->bounds[4], Bound::upper);
  EXPECT_NEAR(blocks->projected_gradient, 0.0, 1e-7);
}

TEST(LeastSquares, AnOffsetSharedByEveryRunIsNotToldFromTheirStarts) {
  Runs both = runs(3);
  std::vector<std::shared_ptr<const ResidualBlock>> blocks;
  for (std::size_t j = 0; j < 3; ++j) {
    const auto inner = both.blocks.blocks[j];
    blocks.push_back(residual_block(
        inner->size(), std::vector<Index>{0, 1, static_cast<Index>(2 + j), 5},
        [inner](const VectorXd& x, VectorXd& r, MatrixXd* J) {
          MatrixXd own(r.size(), 3);
          const VectorXd shifted = vector({x(0), x(1), x(2) + x(3)});
          const bool defined = inner->evaluate(shifted, r, J != nullptr ? &own : nullptr);
          if (J != nullptr) {
            *J << own, own.col(2);
          }
          return defined;
        }));
  }
  const auto result = solve_least_squares({.blocks = blocks, .start = VectorXd::Ones(6)});
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->converged);
  EXPECT_EQ(result->rank, 5);
  ASSERT_EQ(result->undetermined.cols(), 1);
  VectorXd expected = vector({0.0, 0.0, -1.0, -1.0, -1.0, 1.0});
  expected = expected.cwiseQuotient(result->scales);
  expected /= expected(5);
  EXPECT_LT((result->undetermined.col(0) - expected).cwiseAbs().maxCoeff(), 1e-6);
}

// cos 3x + x/10 (as a residual above its infimum) has a minimum near each (2k + 1)π/3.
TEST(LeastSquares, SeveralStartsFindTheBestOfManyMinima) {
  const auto block = residual_block(1, Index{1}, [](const VectorXd& x, VectorXd& r, MatrixXd* J) {
    r(0) = 3.0 + std::cos(3.0 * x(0)) + 0.1 * x(0);
    if (J != nullptr) {
      (*J)(0, 0) = 0.1 - 3.0 * std::sin(3.0 * x(0));
    }
    return true;
  });
  const LeastSquaresProblem problem{
      .blocks = {block}, .start = vector({9.0}), .lower = vector({-10.0}), .upper = vector({10.0})};
  const auto one = solve_least_squares(problem);
  const auto many = solve_from_several_starts(problem, {.starts = 30, .seed = 5});
  ASSERT_TRUE(one);
  ASSERT_TRUE(many);
  EXPECT_GT(one->x(0), 5.0);
  // sin 3x = 1/30 with cos 3x < 0: 3x = π - asin(1/30) - 2π·5, the leftmost within the bounds.
  EXPECT_NEAR(many->best.x(0), (M_PI - std::asin(1.0 / 30.0) - 10.0 * M_PI) / 3.0, 1e-7);
  EXPECT_EQ(many->costs.size(), 30U);
  EXPECT_GE(many->agreeing, 1);
  EXPECT_TRUE(std::is_sorted(many->costs.begin(), many->costs.end()));
  const auto again = solve_from_several_starts(problem, {.starts = 30, .seed = 5});
  ASSERT_TRUE(again);
  EXPECT_EQ(many->costs, again->costs);
}

TEST(LeastSquares, TheCapEndsTheIterationAndIsSaid) {
  const auto result = solve_least_squares({.blocks = {rosenbrock()}, .start = vector({-1.2, 1.0})},
                                          {.max_iterations = 2});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->stop, LeastSquaresStop::iteration_limit);
  EXPECT_FALSE(result->converged);
  EXPECT_EQ(result->iterations, 2);
}

}  // namespace
}  // namespace flyball::optimization::least_squares_test
