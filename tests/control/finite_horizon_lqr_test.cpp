#include <flyball/control/finite_horizon_lqr.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/riccati/riccati.hpp>

#include "support/oracle.hpp"

namespace flyball::finite_horizon_lqr_test {
namespace {

using namespace flyball::literals;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

/// A random plant and a jointly positive definite cost.
struct Problem {
  Eigen::MatrixXd A, B, S;
  QuadraticCost cost;
};
Problem random_problem(Random& random, Eigen::Index n, Eigen::Index m) {
  const Eigen::MatrixXd G = random_matrix(random, n + m, n + m);
  const Eigen::MatrixXd W = G * G.transpose() + 0.1 * Eigen::MatrixXd::Identity(n + m, n + m);
  const Eigen::MatrixXd T = random_matrix(random, n, n);
  return {0.7 * random_matrix(random, n, n),
          random_matrix(random, n, m),
          T * T.transpose(),
          {W.topLeftCorner(n, n), W.bottomRightCorner(m, m), W.topRightCorner(n, m)}};
}

// Scalar A = B = Q = R = 1, S_N = 0: S is 0, 1, 3/2, 8/5, 21/13, ratios of Fibonacci numbers.
TEST(FiniteHorizonLqr, Fibonacci) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(1, 1);
  const auto design = finite_horizon_lqr(one, one, {one, one, {}}, zero, 4).value();
  ASSERT_EQ(design.K.size(), 4u);
  ASSERT_EQ(design.S.size(), 5u);
  EXPECT_EQ(design.S[4](0, 0), 0.0);
  EXPECT_NEAR(design.S[3](0, 0), 1.0, 1e-15);
  EXPECT_NEAR(design.S[2](0, 0), 3.0 / 2.0, 1e-15);
  EXPECT_NEAR(design.S[1](0, 0), 8.0 / 5.0, 1e-15);
  EXPECT_NEAR(design.S[0](0, 0), 21.0 / 13.0, 1e-15);
  EXPECT_NEAR(design.K[0](0, 0), 8.0 / 13.0, 1e-15);
}

// The cost that the gains run up is xᵀS₀x, and no other gains run up less.
TEST(FiniteHorizonLqr, CostToGo) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::Index m = 1 + trial % 2;
    const Problem problem = random_problem(random, n, m);
    const int steps = 1 + trial % 12;
    const auto design =
        finite_horizon_lqr(problem.A, problem.B, problem.cost, problem.S, steps).value();
    const Eigen::VectorXd start = random_matrix(random, n, 1);
    const auto cost = [&](double disturbed) {
      Eigen::VectorXd x = start;
      double sum = 0.0;
      for (int k = 0; k < steps; ++k) {
        const Eigen::VectorXd u =
            -design.K[static_cast<std::size_t>(k)] * x + disturbed * Eigen::VectorXd::Ones(m);
        sum +=
            x.dot(problem.cost.Q * x) + 2.0 * x.dot(problem.cost.N * u) + u.dot(problem.cost.R * u);
        x = (problem.A * x + problem.B * u).eval();
      }
      return sum + x.dot(problem.S * x);
    };
    const double least = start.dot(design.S[0] * start);
    ASSERT_NEAR(cost(0.0), least, 1e-9 * (1.0 + least));
    ASSERT_GT(cost(0.1), least);
    ASSERT_GT(cost(-0.1), least);
  }
}

// A long horizon ends in the algebraic Riccati equation.
TEST(FiniteHorizonLqr, ConvergesToTheInfiniteHorizon) {
  Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const Problem problem = random_problem(random, 1 + trial % 5, 1 + trial % 2);
    const auto infinite =
        dare(problem.A, problem.B, problem.cost.Q, problem.cost.R, problem.cost.N).value();
    const auto design =
        finite_horizon_lqr(problem.A, problem.B, problem.cost, problem.S, 400).value();
    ASSERT_LT((design.S[0] - infinite.X).norm(), 1e-9 * infinite.X.norm());
    ASSERT_LT((design.K[0] - infinite.K).norm(), 1e-8 * (1.0 + infinite.K.norm()));
  }
}

// S_N already there stays there.
TEST(FiniteHorizonLqr, StaysAtTheSolution) {
  Random random(3);
  const Problem problem = random_problem(random, 3, 2);
  const auto infinite =
      dare(problem.A, problem.B, problem.cost.Q, problem.cost.R, problem.cost.N).value();
  const auto design =
      finite_horizon_lqr(problem.A, problem.B, problem.cost, infinite.X, 50).value();
  for (const Eigen::MatrixXd& S : design.S) {
    ASSERT_LT((S - infinite.X).norm(), 1e-10 * infinite.X.norm());
  }
}

// A plant that changes from step to step; a constant one gives the same as the constant form.
TEST(FiniteHorizonLqr, ChangingPlants) {
  Random random(4);
  const Problem problem = random_problem(random, 3, 1);
  const std::vector<DiscretizedMatrices> same(7, {problem.A, problem.B});
  const auto constant =
      finite_horizon_lqr(problem.A, problem.B, problem.cost, problem.S, 7).value();
  const auto listed = finite_horizon_lqr(same, problem.cost, problem.S).value();
  EXPECT_EQ(listed.S[0], constant.S[0]);
  auto changing = same;
  changing[0].A *= 0.5;
  const auto other = finite_horizon_lqr(changing, problem.cost, problem.S).value();
  EXPECT_EQ(other.S[1], constant.S[1]);
  EXPECT_GT((other.S[0] - constant.S[0]).norm(), 1e-3);
}

// Scalar dx/dt = u with q = r = 1, S_T = 0: S(t) = tanh(T - t).
TEST(ContinuousFiniteHorizonLqr, Tanh) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(1, 1);
  const auto design =
      continuous_finite_horizon_lqr(zero, one, {one, one, {}}, zero, 2_s, 8).value();
  ASSERT_EQ(design.S.size(), 9u);
  for (std::size_t k = 0; k <= 8; ++k) {
    const double left = 2.0 - 0.25 * static_cast<double>(k);
    EXPECT_NEAR(design.S[k](0, 0), std::tanh(left), 1e-14);
    EXPECT_NEAR(design.K[k](0, 0), std::tanh(left), 1e-14);
  }
}

// The samples do not depend on how many there are, and obey the differential equation.
TEST(ContinuousFiniteHorizonLqr, IsTheDifferentialEquations) {
  Random random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Problem problem = random_problem(random, n, 1 + trial % 2);
    const auto coarse =
        continuous_finite_horizon_lqr(problem.A, problem.B, problem.cost, problem.S, 3_s, 3)
            .value();
    const auto fine =
        continuous_finite_horizon_lqr(problem.A, problem.B, problem.cost, problem.S, 3_s, 3000)
            .value();
    ASSERT_LT((coarse.S[0] - fine.S[0]).norm(), 1e-9 * fine.S[0].norm());
    ASSERT_LT((coarse.S[2] - fine.S[2000]).norm(), 1e-9 * fine.S[2000].norm());
    // Central difference over 2 ms at an inner sample.
    const Eigen::MatrixXd& S = fine.S[1500];
    const Eigen::MatrixXd rate = (fine.S[1501] - fine.S[1499]) / 2e-3;
    const Eigen::MatrixXd K =
        test::solve(problem.cost.R, problem.B.transpose() * S + problem.cost.N.transpose());
    const Eigen::MatrixXd right = problem.A.transpose() * S + S * problem.A -
                                  K.transpose() * problem.cost.R * K + problem.cost.Q;
    ASSERT_LT((rate + right).norm(), 1e-3 * (1.0 + problem.cost.Q.norm() + right.norm()));
    ASSERT_LT((fine.K[1500] - K).norm(), 1e-9 * (1.0 + K.norm()));
  }
}

// dx/dt = u, cost -x² + u²: S(t) = -tan(T - t) has no end beyond T = π/2.
TEST(ContinuousFiniteHorizonLqr, ConjugatePoint) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(1, 1);
  const Eigen::MatrixXd negative = -one;
  const auto within =
      continuous_finite_horizon_lqr(zero, one, {negative, one, {}}, zero, 1.5_s, 30).value();
  EXPECT_NEAR(within.S[0](0, 0), -std::tan(1.5), 1e-11);
  for (const int steps : {1, 2, 7, 100}) {
    const auto beyond =
        continuous_finite_horizon_lqr(zero, one, {negative, one, {}}, zero, 2_s, steps);
    ASSERT_FALSE(beyond.has_value()) << steps;
    EXPECT_TRUE(beyond.error().is(RiccatiError::singular));
  }
}

TEST(FiniteHorizonLqr, Errors) {
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd B = Eigen::Vector2d(0.0, 1.0);
  const Eigen::MatrixXd r = Eigen::MatrixXd::Ones(1, 1);
  const QuadraticCost cost{I, r, {}};
  EXPECT_TRUE(finite_horizon_lqr(I, B, cost, I, 0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      finite_horizon_lqr(I, B, cost, I, 100'000'000).error().is(ArgumentError::out_of_range));
  EXPECT_EQ(finite_horizon_lqr(r, r, {r, r, {}}, r, 100'000).value().K.size(), 100'000U);
  EXPECT_TRUE(
      finite_horizon_lqr(r, r, {r, r, {}}, r, 1'000'000).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(finite_horizon_lqr(I, B, cost, r, 2).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(finite_horizon_lqr(I, B, {I, I, {}}, I, 2).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(finite_horizon_lqr(I, B, cost, bryson({0.0, 1.0}), 2)
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(finite_horizon_lqr(std::vector<DiscretizedMatrices>{}, cost, I)
                  .error()
                  .is(ArgumentError::empty));
  EXPECT_TRUE(finite_horizon_lqr(std::vector<DiscretizedMatrices>{{I, B}, {r, r}}, cost, I)
                  .error()
                  .is(ArgumentError::wrong_shape));
  const auto indefinite = finite_horizon_lqr(I, B, {I, -5.0 * r, {}}, I, 3);
  EXPECT_TRUE(indefinite.error().is(RiccatiError::singular));
  EXPECT_EQ(indefinite.error().evidence().front().values.front(), 2.0);
  EXPECT_TRUE(continuous_finite_horizon_lqr(I, B, {I, -r, {}}, I, 1_s, 3)
                  .error()
                  .is(RiccatiError::singular));
  EXPECT_TRUE(
      continuous_finite_horizon_lqr(I, B, cost, I, 0_s, 3).error().is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::finite_horizon_lqr_test
