// Absolute values, minima and maxima in problems, and programs of large numbers.
#include <cmath>
#include <string>
#include <utility>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/optimization/problem/problem.hpp>

namespace problem_kinks_test {
namespace {

using namespace flyball;
using namespace flyball::optimization;

// Where the slope of a cost jumps at the minimum and no variable can stand for what jumps, the
// expression is named.
TEST(Problem, KinksAreNamed) {
  Problem problem;
  Expression y = problem.decision_variable();
  y.set_value(1.0);
  problem.minimize(exp(abs(y)));
  const auto solution = problem.solve().value();
  EXPECT_EQ(solution.status, SolveStatus::no_progress);
  EXPECT_NE(solution.message.find("the cost has a kink"), std::string::npos) << solution.message;
}

// |y|, √(y²), max and min are solved as what they are: programs with a variable for each.
TEST(Problem, AbsoluteValuesMinimaAndMaxima) {
  for (const int kind : {0, 1, 2, 3}) {
    SCOPED_TRACE(kind);
    for (const double from : {1.0, 0.0, -3.0}) {
      Problem problem;
      Expression x = problem.decision_variable();
      Expression y = problem.decision_variable();
      x.set_value(1.0);
      y.set_value(from);
      const Expression magnitude = kind == 0   ? abs(y)
                                   : kind == 1 ? sqrt(y * y)
                                   : kind == 2 ? max(y, -y)
                                               : -min(y, -y);
      problem.minimize(2.0 * magnitude + pow(y - 3.0, 2) + x * x);
      const auto solution = problem.solve().value();
      EXPECT_EQ(solution.status, SolveStatus::solved);
      EXPECT_EQ(solution.cost_degree, Degree::quadratic);
      EXPECT_NEAR(y.value(), 2.0, 1e-7);
      EXPECT_NEAR(x.value(), 0.0, 1e-7);
      EXPECT_NEAR(solution.cost, 5.0, 1e-8);
      EXPECT_EQ(solution.multipliers.size(), 0);
    }
  }
  // One in the other, in a constraint, of a parameter, and solved again: x is at the least distance
  // from p that max(|x|, 2 - x) ≤ 3/2 leaves.
  Problem problem;
  Expression x = problem.decision_variable();
  Expression p = problem.parameter(2.0);
  problem.subject_to(max(abs(x), 2.0 - x) <= 1.5);
  problem.minimize(abs(x - p));
  ASSERT_EQ(problem.solve().value().status, SolveStatus::solved);
  EXPECT_NEAR(x.value(), 1.5, 1e-7);
  for (const auto& [to, at] : {std::pair{0.2, 0.5}, std::pair{1.1, 1.1}, std::pair{7.0, 1.5}}) {
    p.set_value(to);
    const auto solution = problem.solve().value();
    EXPECT_EQ(solution.status, SolveStatus::solved);
    EXPECT_NEAR(x.value(), at, 1e-7);
    EXPECT_NEAR(solution.cost, std::abs(at - to), 1e-7);
    ASSERT_EQ(solution.multipliers.size(), 1);
  }
  // What grows against its weight is no program: it stays as it is.
  Problem concave;
  Expression z = concave.decision_variable();
  z.set_value(0.5);
  concave.subject_to(-1.0 <= z);
  concave.subject_to(z <= 2.0);
  concave.maximize(abs(z));
  EXPECT_EQ(concave.solve().value().status, SolveStatus::solved);
  EXPECT_NEAR(std::abs(z.value()), 2.0, 1e-6);
  // A direction without end is one of the problem's own variables.
  Problem unbounded;
  Expression w = unbounded.decision_variable();
  unbounded.minimize(abs(w) - 2.0 * w);
  const auto endless = unbounded.solve().value();
  EXPECT_EQ(endless.status, SolveStatus::unbounded);
  ASSERT_EQ(endless.certificate.size(), 1);
  EXPECT_GT(endless.certificate(0), 0.0);
  // No point is within both.
  Problem impossible;
  Expression v = impossible.decision_variable();
  impossible.subject_to(abs(v) <= 1.0, "the reach");
  impossible.subject_to(v >= 2.0);
  const auto none = impossible.solve().value();
  EXPECT_EQ(none.status, SolveStatus::infeasible);
  EXPECT_NE(none.message.find("the reach"), std::string::npos) << none.message;
}

// Multipliers that do not cancel prove nothing where variables may be large: pascals, counts.
TEST(Problem, LargeNumbersAreNotInfeasible) {
  Problem first;
  Expression x = first.decision_variable();
  Expression y = first.decision_variable();
  first.minimize(x + 2.0 * y);
  first.subject_to(x + y >= 3e7);
  first.subject_to(x - y <= 3e7);
  first.subject_to(x >= 0.0);
  first.subject_to(y >= 0.0);
  EXPECT_NE(first.solve().value().status, SolveStatus::infeasible);
  EXPECT_NEAR(x.value(), 3e7, 1.0);
  Problem second;
  Expression a = second.decision_variable();
  Expression b = second.decision_variable();
  second.minimize(pow(a - 2e7, 2) + pow(b - 2e7, 2));
  second.subject_to(a + b == 5e7);
  second.subject_to(a >= 0.0);
  second.subject_to(a <= 3e7);
  second.subject_to(b >= 0.0);
  EXPECT_NE(second.solve().value().status, SolveStatus::infeasible);
  EXPECT_NEAR(a.value(), 2.5e7, 10.0);
  Problem third;
  Expression c = third.decision_variable();
  Expression d = third.decision_variable();
  third.minimize(c + 2.0 * d);
  third.subject_to(1e-7 * c + 1e-7 * d >= 3.0);
  third.subject_to(c >= 0.0);
  third.subject_to(d >= 0.0);
  EXPECT_NE(third.solve().value().status, SolveStatus::infeasible);
  EXPECT_NEAR(c.value(), 3e7, 10.0);
}

// A start at which a magnitude is no number is the variable's, and can be moved.
TEST(Problem, AStartBeyondAKinkCanBeMoved) {
  Problem problem;
  Expression x = problem.decision_variable();
  problem.minimize(abs(log(x)));
  EXPECT_EQ(problem.solve().value().status, SolveStatus::not_finite);
  x.set_value(3.0);
  const auto solution = problem.solve();
  ASSERT_TRUE(solution) << to_string(solution.error());
  EXPECT_EQ(solution->status, SolveStatus::solved);
  EXPECT_NEAR(x.value(), 1.0, 1e-6);
}

// The least fuel Σ|u| h of a double integrator: along its stages, and all of it at both ends.
TEST(Problem, LeastFuelAlongStages) {
  constexpr int N = 200;
  constexpr double h = 0.02;
  Problem problem;
  const ExpressionMatrix X = problem.decision_variable(2, N + 1);
  const ExpressionMatrix U = problem.decision_variable(1, N);
  problem.subject_to(X.col(0) == Eigen::Vector2d(0.0, 0.0));
  problem.subject_to(X.col(N) == Eigen::Vector2d(1.0, 0.0));
  Expression fuel = 0.0;
  for (int k = 0; k < N; ++k) {
    problem.subject_to(X(0, k + 1) == X(0, k) + h * X(1, k) + 0.5 * h * h * U(0, k));
    problem.subject_to(X(1, k + 1) == X(1, k) + h * U(0, k));
    fuel += h * abs(U(0, k));
  }
  problem.subject_to(-1.0 <= U);
  problem.subject_to(U <= 1.0);
  problem.minimize(fuel);
  const auto solution = problem.solve().value();
  ASSERT_EQ(solution.status, SolveStatus::solved);
  EXPECT_NE(solution.method.find("along"), std::string::npos) << solution.method;
  // v (T - v) = 1 at a thrust of 1: the fuel is 2 v, a little more where a switch is within a step.
  const double v = 0.5 * (4.0 - std::sqrt(12.0));
  EXPECT_GE(solution.cost, 2.0 * v - 1e-8);
  EXPECT_LE(solution.cost, 2.0 * v + 1e-3);
  EXPECT_NEAR(U.value(0, 0), 1.0, 1e-5);
  EXPECT_NEAR(U.value(0, N / 2), 0.0, 1e-5);
  EXPECT_NEAR(U.value(0, N - 1), -1.0, 1e-5);
}

}  // namespace
}  // namespace problem_kinks_test
