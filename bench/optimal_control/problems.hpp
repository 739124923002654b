#pragma once

// Problems along stages, each from nothing: model, derivatives, memory, solution. Times are of the
// process, the smallest of several.

#include <algorithm>
#include <cmath>
#include <ctime>

#include <flyball/optimization/ocp/optimal_control.hpp>
#include <flyball/optimization/problem/problem.hpp>

#include "optimization/cart_pole.hpp"

namespace problems {

using flyball::optimization::Expression;
using flyball::optimization::ExpressionMatrix;
using flyball::optimization::OptimalControlProblem;
using flyball::optimization::OptimalControlSolution;
using flyball::optimization::OptimalControlSolver;
using flyball::optimization::Problem;
using flyball::optimization::ProblemSolution;

inline double process_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

struct Row {
  double milliseconds = 1e300;
  double again = 1e300;  // solved again from what was found
  int iterations = 0;
  double cost = 0.0;
  bool solved = false;
};

/// @param problem  Makes and solves it. @param repetitions  Of which the quickest counts.
template <class Make>
Row measure(int repetitions, Make&& make) {
  Row row;
  for (int k = 0; k < repetitions; ++k) {
    make(row);
  }
  return row;
}

template <class Solution>
void keep(Row& row, double milliseconds, double again, const Solution& solution) {
  row.milliseconds = std::min(row.milliseconds, milliseconds);
  row.again = std::min(row.again, again);
  row.iterations = solution.counts.iterations;
  row.cost = solution.cost;
  row.solved = solution.solved();
}

inline Row swing_up(int N) {
  return measure(N > 1000 ? 3 : 7, [&](Row& row) {
    const double begin = process_milliseconds();
    OptimalControlProblem problem = cart_pole::problem(N);
    problem.set_start(cart_pole::start(N), Eigen::MatrixXd::Zero(1, N));
    auto solver = OptimalControlSolver::make(problem).value();
    const OptimalControlSolution solution = solver.solve();
    const double middle = process_milliseconds();
    (void)solver.resolve();
    keep(row, middle - begin, process_milliseconds() - middle, solution);
  });
}

/// A flywheel of time constant 1 s over 5 s, from rest, to `reference`.
inline void state_flywheel(Problem& problem, int N, const Expression& reference) {
  const ExpressionMatrix X = problem.decision_variable(1, N + 1);
  const ExpressionMatrix U = problem.decision_variable(1, N);
  const double a = std::exp(-5.0 / N);
  for (int k = 0; k < N; ++k) {
    problem.subject_to(X(0, k + 1) == a * X(0, k) + (1.0 - a) * U(0, k));
  }
  problem.subject_to(X(0, 0) == 0.0);
  problem.subject_to(-12.0 <= U);
  problem.subject_to(U <= 12.0);
  Expression J = 0.0;
  for (int k = 0; k <= N; ++k) {
    J += pow(reference - X(0, k), 2);
  }
  problem.minimize(J);
}

/// The double integrator of section 17.1.1 over 3.5 s with exact steps, to `goal`.
inline void state_double_integrator(Problem& problem, int N, const Expression& goal) {
  const ExpressionMatrix X = problem.decision_variable(2, N + 1);
  const ExpressionMatrix U = problem.decision_variable(1, N);
  const double h = 3.5 / N;
  for (int k = 0; k < N; ++k) {
    problem.subject_to(X(0, k + 1) == X(0, k) + h * X(1, k) + 0.5 * h * h * U(0, k));
    problem.subject_to(X(1, k + 1) == X(1, k) + h * U(0, k));
  }
  problem.subject_to(X.col(0) == Eigen::Vector2d(0.0, 0.0));
  problem.subject_to(X(0, N) == goal);
  problem.subject_to(X(1, N) == 0.0);
  problem.subject_to(-1.0 <= X.row(1));
  problem.subject_to(X.row(1) <= 1.0);
  problem.subject_to(-1.0 <= U);
  problem.subject_to(U <= 1.0);
  Expression J = 0.0;
  for (int k = 0; k <= N; ++k) {
    J += pow(goal - X(0, k), 2);
  }
  problem.minimize(J);
}

/// Stated and solved, then solved again from what was found.
template <class State>
Row solve_twice(State&& state) {
  return measure(9, [&](Row& row) {
    const double begin = process_milliseconds();
    Problem problem;
    state(problem);
    const ProblemSolution solution = problem.solve().value();
    const double middle = process_milliseconds();
    (void)problem.solve();
    keep(row, middle - begin, process_milliseconds() - middle, solution);
  });
}

inline Row flywheel(int N) {
  return solve_twice([N](Problem& problem) { state_flywheel(problem, N, 10.0); });
}

inline Row double_integrator(int N) {
  return solve_twice([N](Problem& problem) { state_double_integrator(problem, N, 2.0); });
}

}  // namespace problems
