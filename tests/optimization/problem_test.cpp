#include <flyball/optimization/problem/problem.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace problem_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using namespace flyball;
using namespace flyball::optimization;

// Section 17.1.1: from 0 to 2 m in 3.5 s within 1 m/s and 1 m/s², 5 ms a step. CasADi with IPOPT
// found the cost 904.84318 of steps of exactly constant acceleration.
TEST(Problem, DoubleIntegratorOfTheBook) {
  const int N = 700;
  const double dt = 0.005;
  const double r = 2.0;
  Problem problem;
  const ExpressionMatrix X = problem.decision_variable(2, N + 1);
  const ExpressionMatrix U = problem.decision_variable(1, N);
  for (int k = 0; k < N; ++k) {
    problem.subject_to(X(0, k + 1) == X(0, k) + X(1, k) * dt + 0.5 * dt * dt * U(0, k));
    problem.subject_to(X(1, k + 1) == X(1, k) + U(0, k) * dt);
  }
  problem.subject_to(X.col(0) == Vector2d(0.0, 0.0));
  problem.subject_to(X.col(N) == Vector2d(r, 0.0));
  problem.subject_to(-1.0 <= X.row(1));
  problem.subject_to(X.row(1) <= 1.0);
  problem.subject_to(-1.0 <= U);
  problem.subject_to(U <= 1.0);
  Expression J = 0.0;
  for (int k = 0; k <= N; ++k) {
    J += pow(r - X(0, k), 2);
  }
  problem.minimize(J);
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::solved) << solution.message;
  EXPECT_EQ(solution.cost_degree, Degree::quadratic);
  EXPECT_EQ(solution.equality_degree, Degree::linear);
  EXPECT_EQ(solution.inequality_degree, Degree::linear);
  EXPECT_NEAR(solution.cost, 904.84318, 2e-5);
  EXPECT_NEAR(U.value(0, 0), 1.0, 1e-6);
  EXPECT_NEAR(U.value(0, 300), 0.0, 1e-5);
  EXPECT_NEAR(U.value(0, 410), -0.898, 1e-3);
  EXPECT_NEAR(X.value(0, 350), 1.25, 1e-6);
  EXPECT_NEAR(X.value(1, 350), 1.0, 1e-6);
}

/// Σ (10 - x)² of x⁺ = a x + (1 - a) u, |u| ≤ 12, over N steps of a second in all.
ProblemSolution solve_flywheel(int N, bool shuffled) {
  Problem problem;
  ExpressionMatrix X = problem.decision_variable(1, N + 1);
  const ExpressionMatrix U = problem.decision_variable(1, N);
  const double a = std::exp(-5.0 / N);
  for (int k = 0; k < N; ++k) {
    const int at = shuffled ? (7 * k) % N : k;
    problem.subject_to(X(0, at + 1) == a * X(0, at) + (1.0 - a) * U(0, at));
  }
  problem.subject_to(X(0, 0) == 0.0);
  problem.subject_to(-12.0 <= U);
  problem.subject_to(U <= 12.0);
  Expression J = 0.0;
  for (int k = 0; k <= N; ++k) {
    J += pow(10.0 - X(0, k), 2);
  }
  problem.minimize(J);
  return problem.solve().value();
}

// CasADi with IPOPT: 794.34071. Rows in any order are found to be stages.
TEST(Problem, FlywheelAlongItsStages) {
  for (const bool shuffled : {false, true}) {
    const ProblemSolution solution = solve_flywheel(100, shuffled);
    EXPECT_EQ(solution.status, SolveStatus::solved);
    EXPECT_NEAR(solution.cost, 794.34071, 1e-4);
    EXPECT_NE(solution.method.find("along 101 stages"), std::string::npos) << solution.method;
  }
}

// A row that couples the first and the last state is no matter of stages; the answer is the same
// as where it is left out, since it holds anyway.
TEST(Problem, WithoutStagesTheSparseFactorsAnswerTheSame) {
  const int N = 30;
  const auto solve = [&](bool coupled) {
    Problem problem;
    const ExpressionMatrix X = problem.decision_variable(2, N + 1);
    const ExpressionMatrix U = problem.decision_variable(1, N);
    for (int k = 0; k < N; ++k) {
      problem.subject_to(X(0, k + 1) == X(0, k) + 0.1 * X(1, k));
      problem.subject_to(X(1, k + 1) == X(1, k) + 0.1 * (U(0, k) - sin(X(0, k))));
    }
    problem.subject_to(X.col(0) == Vector2d(0.0, 0.0));
    problem.subject_to(X.col(N) == Vector2d(1.0, 0.0));
    problem.subject_to(U <= 2.0);
    if (coupled) {
      problem.subject_to(X(0, 1) + X(0, N - 1) <= 100.0);
    }
    Expression J = 0.0;
    for (int k = 0; k < N; ++k) {
      J += U(0, k) * U(0, k);
    }
    problem.minimize(J);
    return problem.solve().value();
  };
  const ProblemSolution along = solve(false);
  const ProblemSolution across = solve(true);
  EXPECT_EQ(along.status, SolveStatus::solved);
  EXPECT_EQ(across.status, SolveStatus::solved);
  EXPECT_EQ(along.method, "filter interior-point method along 31 stages");
  EXPECT_EQ(across.method, "filter interior-point method");
  EXPECT_NEAR(along.cost, across.cost, 1e-6 * along.cost);
}

TEST(Problem, DegreesOfExpressions) {
  Problem problem;
  const Expression x = problem.decision_variable();
  const Expression y = problem.decision_variable();
  const Expression p = problem.parameter(3.0);
  EXPECT_EQ((p * p + 1.0).degree(), Degree::constant);
  EXPECT_EQ((2.0 * x - p * y + 1.0).degree(), Degree::linear);
  EXPECT_EQ((x / p).degree(), Degree::linear);
  EXPECT_EQ((x * y + x).degree(), Degree::quadratic);
  EXPECT_EQ(pow(x - y, 2).degree(), Degree::quadratic);
  EXPECT_EQ((x * x * y).degree(), Degree::nonlinear);
  EXPECT_EQ(sin(x).degree(), Degree::nonlinear);
  EXPECT_EQ(sin(p).degree(), Degree::constant);
  EXPECT_EQ((0.0 * x).degree(), Degree::constant);
}

// Klee and Minty's cube, on which the simplex method may visit all 2ⁿ corners: max Σ 2^(n-j) xⱼ
// subject to 2 Σ_{j<i} 2^(i-j) xⱼ + xᵢ ≤ 5ⁱ, x ≥ 0; the optimum is 5ⁿ.
TEST(Problem, KleeMinty) {
  const int n = 6;
  Problem problem;
  const ExpressionMatrix x = problem.decision_variable(n);
  Expression gain = 0.0;
  for (int i = 1; i <= n; ++i) {
    gain += std::pow(2.0, n - i) * x(i - 1);
    Expression left = x(i - 1);
    for (int j = 1; j < i; ++j) {
      left += 2.0 * std::pow(2.0, i - j) * x(j - 1);
    }
    problem.subject_to(left <= std::pow(5.0, i));
  }
  problem.subject_to(x >= 0.0);
  problem.maximize(gain);
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::solved) << solution.message;
  EXPECT_NEAR(solution.cost, std::pow(5.0, n), 1e-5 * std::pow(5.0, n));
  EXPECT_NEAR(x.value(n - 1), std::pow(5.0, n), 1e-5 * std::pow(5.0, n));
}

// Beale's example, on which the simplex method with the textbook's rule runs in a circle.
TEST(Problem, BealesCycle) {
  Problem problem;
  const ExpressionMatrix x = problem.decision_variable(4);
  problem.subject_to(0.25 * x(0) - 8.0 * x(1) - x(2) + 9.0 * x(3) <= 0.0);
  problem.subject_to(0.5 * x(0) - 12.0 * x(1) - 0.5 * x(2) + 3.0 * x(3) <= 0.0);
  problem.subject_to(x(2) <= 1.0);
  problem.subject_to(x >= 0.0);
  problem.minimize(-0.75 * x(0) + 20.0 * x(1) - 0.5 * x(2) + 6.0 * x(3));
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::solved) << solution.message;
  EXPECT_NEAR(solution.cost, -1.25, 1e-7);
  EXPECT_NE(solution.method.find("linear program"), std::string::npos);
}

// The first-order conditions of convex programs, from values and multipliers alone.
TEST(Problem, RandomQuadraticPrograms) {
  Random random(17);
  for (int round = 0; round < 40; ++round) {
    const int n = 3 + round % 8;
    const int m = 1 + round % 5;
    const MatrixXd F = MatrixXd::NullaryExpr(n, n - round % 3, [&] { return random.normal(); });
    const MatrixXd Q = F * F.transpose();
    const VectorXd q = VectorXd::NullaryExpr(n, [&] { return random.normal(); });
    const MatrixXd A = MatrixXd::NullaryExpr(m, n, [&] { return random.normal(); });
    const VectorXd inside = VectorXd::NullaryExpr(n, [&] { return random.uniform(0.1, 0.9); });
    const VectorXd b = A * inside;
    Problem problem;
    ExpressionMatrix x = problem.decision_variable(n);
    const bool has_equality = round % 2 == 0 && m < n;
    problem.subject_to(has_equality ? ExpressionMatrix(A) * x == b
                                    : ExpressionMatrix(A) * x <= VectorXd(b.array() + 0.1));
    problem.subject_to(x >= 0.0);
    problem.subject_to(x <= 1.0);
    problem.minimize((0.5 * x.transpose() * ExpressionMatrix(Q) * x)(0) +
                     (x.transpose() * ExpressionMatrix(q))(0));
    const auto solution = problem.solve().value();
    ASSERT_EQ(solution.status, SolveStatus::solved) << round << ": " << solution.message;
    const VectorXd at = x.value();
    const VectorXd l = solution.multipliers;
    // ∇f = Σ λ ∇c with c = Ax - b or b + 0.1 - Ax, x, 1 - x.
    const VectorXd slope = Q * at + q - (has_equality ? 1.0 : -1.0) * A.transpose() * l.head(m) -
                           l.segment(m, n) + l.tail(n);
    EXPECT_LT(slope.cwiseAbs().maxCoeff(), 1e-7) << round;
    EXPECT_GT(l.tail(2 * n).minCoeff(), -1e-12);
    EXPECT_LT((at.array() * l.segment(m, n).array()).abs().maxCoeff(), 1e-7);
    EXPECT_LT(((1.0 - at.array()) * l.tail(n).array()).abs().maxCoeff(), 1e-7);
    EXPECT_GT(at.minCoeff(), -1e-8);
    const VectorXd rows = A * at - b;
    if (has_equality) {
      EXPECT_LT(rows.cwiseAbs().maxCoeff(), 1e-7);
    } else {
      EXPECT_LT((rows.array() - 0.1).maxCoeff(), 1e-7);
      EXPECT_GT(l.head(m).minCoeff(), -1e-8);
      EXPECT_LT(((0.1 - rows.array()) * l.head(m).array()).abs().maxCoeff(), 1e-7);
    }
  }
}

// x + y ≥ 3 and 2x + y ≤ 1 for x, y ≥ 0: the first less the second less x is -x ≥ 2.
TEST(Problem, InfeasibleWithACertificate) {
  Problem problem;
  const Expression x = problem.decision_variable();
  const Expression y = problem.decision_variable();
  problem.subject_to(x + y >= 3.0, "enough");
  problem.subject_to(2.0 * x + y <= 1.0, "not too much");
  problem.subject_to(x >= 0.0);
  problem.subject_to(y >= 0.0);
  problem.minimize(x + y);
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::infeasible);
  ASSERT_EQ(solution.certificate.size(), 4);
  // The combination u (x + y - 3) + v (1 - 2x - y) with u, v ≥ 0 is negative wherever x, y ≥ 0.
  const double u = std::abs(solution.certificate(0));
  const double v = std::abs(solution.certificate(1));
  EXPECT_LE(u - 2.0 * v, 1e-5);
  EXPECT_LE(u - v, 1e-5);
  EXPECT_LT(-3.0 * u + v, 0.0);
  EXPECT_NE(solution.message.find("violated"), std::string::npos);
}

TEST(Problem, UnboundedWithADirection) {
  Problem problem;
  const Expression x = problem.decision_variable();
  const Expression y = problem.decision_variable();
  problem.subject_to(x - y <= 1.0);
  problem.subject_to(x >= 0.0);
  problem.minimize(-x - y);
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::unbounded);
  ASSERT_EQ(solution.certificate.size(), 2);
  EXPECT_GT(solution.certificate.sum(), 0.5);
  EXPECT_LE(solution.certificate(0) - solution.certificate(1), 1e-6);
}

TEST(Problem, ContradictoryBoundsAreNamed) {
  Problem problem;
  const ExpressionMatrix x = problem.decision_variable(3);
  problem.subject_to(x >= 1.0, "the floor");
  problem.subject_to(x(1) <= 0.25, "the ceiling");
  problem.minimize(x.sum());
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::infeasible);
  EXPECT_EQ(solution.violations.front().name, "the floor, entry 0");
  EXPECT_NE(solution.message.find("is violated by 1"), std::string::npos) << solution.message;
}

// x² + y² ≤ 1 and x + y ≥ 3: no point; nearest, where the sum of both violations is least.
TEST(Problem, NonlinearInfeasible) {
  Problem problem;
  ExpressionMatrix x = problem.decision_variable(2);
  problem.subject_to(x(0) * x(0) + x(1) * x(1) <= 1.0, "the disc");
  problem.subject_to(x(0) + x(1) >= 3.0, "the half-plane");
  problem.minimize(x(0));
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::infeasible);
  ASSERT_FALSE(solution.violations.empty());
  EXPECT_NE(solution.message.find("the "), std::string::npos) << solution.message;
}

// min -x y over the unit disc is no convex quadratic program: the general method takes it.
TEST(Problem, NotConvex) {
  Problem problem;
  ExpressionMatrix x = problem.decision_variable(2);
  x.set_value(Vector2d(0.4, 0.1));
  problem.subject_to(x >= -1.0);
  problem.subject_to(x <= 2.0);
  problem.minimize(-x(0) * x(1));
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::solved);
  EXPECT_NEAR(solution.cost, -4.0, 1e-6);
}

TEST(Problem, NoConstraintsAndNoCost) {
  Problem problem;
  ExpressionMatrix x = problem.decision_variable(2);
  problem.minimize(exp(x(0)) - x(0) + pow(x(1) - 3.0, 4));
  EXPECT_EQ(problem.solve().value().status, SolveStatus::solved);
  EXPECT_NEAR(x.value(0), 0.0, 1e-5);
  Problem system;
  ExpressionMatrix y = system.decision_variable(2);
  y.set_value(Vector2d(1.0, 2.0));
  system.subject_to(y(0) * y(0) + y(1) * y(1) == 25.0);
  system.subject_to(y(0) * y(1) == 12.0);
  EXPECT_EQ(system.solve().value().status, SolveStatus::solved);
  EXPECT_NEAR(y.value(0), 3.0, 1e-7);
  EXPECT_NEAR(y.value(1), 4.0, 1e-7);
}

TEST(Problem, ParametersChangeBetweenSolves) {
  Problem problem;
  const ExpressionMatrix x = problem.decision_variable(2);
  Expression goal = problem.parameter(1.0);
  Expression limit = problem.parameter(10.0);
  problem.minimize(pow(x(0) - goal, 2) + pow(x(1) + goal, 2));
  problem.subject_to(x(0) <= limit);
  const auto first = problem.solve().value();
  EXPECT_NEAR(x.value(0), 1.0, 1e-7);
  goal.set_value(4.0);
  limit.set_value(3.0);
  const auto second = problem.solve().value();
  EXPECT_NEAR(x.value(0), 3.0, 1e-7);
  EXPECT_NEAR(x.value(1), -4.0, 1e-7);
  EXPECT_NEAR(second.multipliers(0), 2.0, 1e-6);  // the slope of (x - 4)² at 3, to limit - x ≥ 0
  EXPECT_LE(second.counts.iterations, first.counts.iterations + 8);
}

// A quadratic program whose numbers change a little begins with the bounds that were active: fewer
// steps, and the solution that it has from nothing.
TEST(Problem, SolvedAgainFromItsActiveBounds) {
  const int usual = 100;
  const auto state = [](Problem& problem, const Expression& r, const Expression& x_0, int N) {
    const ExpressionMatrix X = problem.decision_variable(1, N + 1);
    const ExpressionMatrix U = problem.decision_variable(1, N);
    const double a = std::exp(-5.0 / N);
    for (int k = 0; k < N; ++k) {
      problem.subject_to(X(0, k + 1) == a * X(0, k) + (1.0 - a) * U(0, k));
    }
    problem.subject_to(X(0, 0) == x_0);
    problem.subject_to(-12.0 <= U);
    problem.subject_to(U <= 12.0);
    Expression J = 0.0;
    for (int k = 0; k <= N; ++k) {
      J += pow(r - X(0, k), 2);
    }
    problem.minimize(J);
  };
  Problem problem;
  Expression r = problem.parameter(10.0);
  Expression x_0 = problem.parameter(0.0);
  state(problem, r, x_0, usual);
  const int first = problem.solve().value().counts.iterations;
  for (const auto& [to, from] : {std::pair{10.1, 0.1}, {10.2, 0.3}, {9.0, -2.0}, {3.0, 5.0}}) {
    r.set_value(to);
    x_0.set_value(from);
    const ProblemSolution again = problem.solve().value();
    ASSERT_EQ(again.status, SolveStatus::solved) << to;
    Problem fresh;
    state(fresh, fresh.parameter(to), fresh.parameter(from), usual);
    EXPECT_NEAR(again.cost, fresh.solve().value().cost, 1e-7 * again.cost) << to;
    if (to > 10.0) {
      EXPECT_LE(again.counts.iterations, first / 2) << to;
    }
  }
  // Where the bounds that change halve from round to round, they settle before an interior point is
  // near: by a fifth, in no more iterations than from nothing.
  for (const int n : {300, 1000}) {
    SCOPED_TRACE(n);
    Problem longer;
    Expression goal = longer.parameter(10.0);
    state(longer, goal, longer.parameter(0.0), n);
    const int anew = longer.solve().value().counts.iterations;
    goal.set_value(8.0);
    const ProblemSolution again = longer.solve().value();
    EXPECT_EQ(again.status, SolveStatus::solved);
    EXPECT_LE(again.counts.iterations, anew);
  }
}

// Rows that say the same twice have multipliers that are not unique, and one solution.
TEST(Problem, DependentConstraints) {
  Problem problem;
  const Expression x = problem.decision_variable();
  const Expression y = problem.decision_variable();
  problem.subject_to(x + y == 1.0);
  problem.subject_to(2.0 * x + 2.0 * y == 2.0);
  problem.subject_to(x * x + y <= 3.0);
  problem.minimize(pow(x - 2.0, 2) + pow(y, 4));
  const ProblemSolution solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::solved) << solution.message;
  // 2(x - 2) - 4(1 - x)³ = 0: x = 1.5897545...
  const double left = 2.0 * (x.value() - 2.0) - 4.0 * std::pow(1.0 - x.value(), 3);
  EXPECT_NEAR(left, 0.0, 1e-6);
  EXPECT_NEAR(x.value() + y.value(), 1.0, 1e-8);
}

TEST(Problem, NotFiniteIsNamed) {
  Problem problem;
  ExpressionMatrix x = problem.decision_variable(2);
  problem.minimize(x(0));
  problem.subject_to(x(1) <= 1.0);
  problem.subject_to(log(x(0) - 1.0) >= 0.0, "the logarithm");
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::not_finite);
  EXPECT_EQ(solution.message, "the logarithm is not finite");
}

/// Rows, bounds, a linear and a quadratic cost and what is neither, all of parameters: after a
/// change of these the problem is the one that is stated with their new values.
TEST(Problem, EveryNumberFollowsItsParameters) {
  const auto state = [](Problem& problem, const std::array<Expression, 4>& p) {
    ExpressionMatrix x = problem.decision_variable(3);
    x.set_value(Eigen::Vector3d(1.0, 1.0, 1.0));
    problem.subject_to(x(0) + p[0] * x(1) - x(2) / p[1] == p[2] * p[0] - 1.0, "row");
    problem.subject_to(p[1] * x(0) <= p[3] + 4.0, "bound");
    problem.subject_to(x(1) >= -p[3], "lower");
    problem.subject_to(p[2] * exp(x(2)) + p[0] * pow(x(0), 2) <= 9.0 * p[1], "two terms");
    problem.subject_to(pow(x(0) - p[2], 2) + x(2) <= 4.0 * p[3], "a term");
    problem.minimize(p[1] * pow(x(0) - p[3], 2) + p[2] * x(1) + pow(x(1) - p[0], 4) +
                     p[0] * cosh(x(2) - p[1]) + p[3] * p[1]);
    return x;
  };
  const std::array<std::array<double, 4>, 4> values{
      {{1.0, 2.0, 0.5, 1.5}, {1.2, 1.0, 0.8, 2.0}, {0.7, 3.0, 1.1, 1.0}, {1.0, 2.0, 0.5, 1.5}}};
  Problem problem;
  std::array<Expression, 4> p;
  for (std::size_t i = 0; i < 4; ++i) {
    p[i] = problem.parameter(values[0][i]);
  }
  const ExpressionMatrix x = state(problem, p);
  for (const std::array<double, 4>& now : values) {
    Problem anew;
    std::array<Expression, 4> q;
    for (std::size_t i = 0; i < 4; ++i) {
      p[i].set_value(now[i]);
      q[i] = anew.parameter(now[i]);
    }
    const ExpressionMatrix y = state(anew, q);
    const ProblemSolution again = problem.solve().value();
    const ProblemSolution expected = anew.solve().value();
    ASSERT_TRUE(expected.solved()) << expected.message;
    ASSERT_TRUE(again.solved()) << again.message;
    EXPECT_NEAR(again.cost, expected.cost, 1e-7);
    for (Eigen::Index i = 0; i < 3; ++i) {
      EXPECT_NEAR(x.value(i), y.value(i), 1e-6);
    }
    EXPECT_LE((again.multipliers - expected.multipliers).cwiseAbs().maxCoeff(), 1e-5);
  }
  // A number that is not finite is refused; the last good ones are solved again after that.
  p[2].set_value(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(problem.solve().error().is(ProblemError::not_finite));
  p[2].set_value(values[3][2]);
  EXPECT_TRUE(problem.solve().value().solved());
  // Bounds that part, and the way back.
  p[3].set_value(-50.0);
  EXPECT_EQ(problem.solve().value().status, SolveStatus::infeasible);
  p[3].set_value(values[3][3]);
  EXPECT_TRUE(problem.solve().value().solved());
}

TEST(Problem, MisuseIsRefused) {
  Problem empty;
  EXPECT_TRUE(empty.solve().error().is(ProblemError::no_variables));
  Problem problem;
  const ExpressionMatrix x = problem.decision_variable(2, 2);
  problem.subject_to(x.col(0) == Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_TRUE(problem.solve().error().is(ProblemError::wrong_shape));
  Problem other;
  const Expression y = other.decision_variable();
  other.minimize(x(0, 0) + 1.0);
  EXPECT_TRUE(other.solve().error().is(ProblemError::other_problem));
  Problem not_finite;
  const Expression z = not_finite.decision_variable();
  not_finite.subject_to(z * std::numeric_limits<double>::infinity() + z <= 1.0, "the rule");
  const auto refused = not_finite.solve();
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(ProblemError::not_finite));
  EXPECT_NE(to_string(refused.error()).find("the rule"), std::string::npos);
  (void)y;
}

TEST(Problem, LimitsAreHonoured) {
  Problem problem;
  ExpressionMatrix x = problem.decision_variable(2);
  x.set_value(Vector2d(-1.2, 1.0));
  problem.minimize(100.0 * pow(x(1) - pow(x(0), 2), 2) + pow(1.0 - x(0), 2));
  SolverOptions few;
  few.max_iterations = 3;
  const auto stopped = problem.solve(few).value();
  EXPECT_EQ(stopped.status, SolveStatus::iteration_limit);
  EXPECT_EQ(stopped.counts.iterations, 3);
  EXPECT_EQ(stopped.iterations.size(), 3U);
  EXPECT_EQ(problem.solve().value().status, SolveStatus::solved);
  EXPECT_NEAR(x.value(0), 1.0, 1e-7);
}

}  // namespace
}  // namespace problem_test
