// Problems solved again after a change of their numbers, beside the first solve of the changed
// problem: processor time, iterations, and whether both end in the same place.

#include <cstdio>
#include <numbers>
#include <string>

#include "problems.hpp"

namespace {

using namespace problems;
using namespace flyball::optimization;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The smallest of several first solves, of solves again after a change, and of the changed
/// problem's own first solve.
struct Comparison {
  double first = 1e300;
  double again = 1e300;
  int first_iterations = 0;
  int iterations = 0;
  double cost = 0.0;
  double cold_cost = 0.0;
  bool solved = true;
};

void print(const std::string& name, int N, const char* change, const Comparison& c) {
  std::printf("| %s | %d | %s | %.3f | %d | %.3f | %d | %.0f %% | %.8g | %.8g |%s\n", name.c_str(),
              N, change, c.first, c.first_iterations, c.again, c.iterations,
              100.0 * c.again / c.first, c.cost, c.cold_cost, c.solved ? "" : " not solved");
  std::fflush(stdout);
}

/// The swing-up with data: the pole's mass and the force's limit stay, the initial state and the
/// weight of a reference of the force change.
OptimalControlProblem swing_up_from(int N) {
  OptimalControlProblem problem(4, 1, N, 0, 1);
  const cart_pole::Model model;
  problem.set_derivative(
      [model](const auto& x, const auto& u, const auto&, const auto& d) {
        Eigen::Matrix<Expression, 1, 1> force;
        force(0) = u(0) + d(0);
        return model(x, force);
      },
      5.0);
  problem.set_stage_cost([](const auto&, const auto& u) { return u(0) * u(0); });
  const double inf = std::numeric_limits<double>::infinity();
  for (int k = 1; k < N; ++k) {
    problem.bound_state(k, Eigen::Vector4d(0.0, -inf, -inf, -inf),
                        Eigen::Vector4d(2.0, inf, inf, inf));
  }
  problem.bound_inputs(VectorXd::Constant(1, -20.0), VectorXd::Constant(1, 20.0));
  problem.fix_state(0, Eigen::Vector4d(0.0, 0.0, 0.0, 0.0));
  problem.fix_state(N, Eigen::Vector4d(1.0, std::numbers::pi, 0.0, 0.0));
  problem.set_start(cart_pole::start(N), MatrixXd::Zero(1, N));
  problem.set_data(MatrixXd::Zero(1, N + 1));
  return problem;
}

Comparison swing_up_again(int N, const Eigen::Vector4d& state, double push) {
  Comparison c;
  for (int k = 0; k < (N > 300 ? 3 : 7); ++k) {
    const double begin = process_milliseconds();
    auto solver = OptimalControlSolver::make(swing_up_from(N)).value();
    const OptimalControlSolution first = solver.solve();
    const double middle = process_milliseconds();
    (void)solver.fix_initial_state(state);
    (void)solver.set_data(MatrixXd::Constant(1, N + 1, push));
    const OptimalControlSolution again = solver.resolve();
    const double end = process_milliseconds();
    c.first = std::min(c.first, middle - begin);
    c.again = std::min(c.again, end - middle);
    c.first_iterations = first.counts.iterations;
    c.iterations = again.counts.iterations;
    c.cost = again.cost;
    c.solved = first.solved() && again.solved();
  }
  OptimalControlProblem changed = swing_up_from(N);
  changed.fix_state(0, state);
  changed.set_data(MatrixXd::Constant(1, N + 1, push));
  c.cold_cost = solve(changed).value().cost;
  return c;
}

/// A program of `Problem` whose one parameter goes from a number to another.
template <class Make>
Comparison program_again(Make&& make, double from, double to) {
  Comparison c;
  for (int k = 0; k < 9; ++k) {
    const double begin = process_milliseconds();
    Problem problem;
    Expression parameter = problem.parameter(from);
    make(problem, parameter);
    const ProblemSolution first = problem.solve().value();
    const double middle = process_milliseconds();
    parameter.set_value(to);
    const ProblemSolution again = problem.solve().value();
    const double end = process_milliseconds();
    c.first = std::min(c.first, middle - begin);
    c.again = std::min(c.again, end - middle);
    c.first_iterations = first.counts.iterations;
    c.iterations = again.counts.iterations;
    c.cost = again.cost;
    c.solved = first.solved() && again.solved();
  }
  Problem changed;
  make(changed, changed.parameter(to));
  c.cold_cost = changed.solve().value().cost;
  return c;
}

}  // namespace

int main() {
  std::printf(
      "| problem | N | change | first, ms | iterations | again, ms | iterations | share | cost "
      "| of a first solve |\n|---|---:|---|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const int N : {100, 300, 1000}) {
    const Eigen::Vector4d start(0.0, 0.0, 0.0, 0.0);
    print("cart-pole", N, "none", swing_up_again(N, start, 0.0));
    print("cart-pole", N, "start by 0.001",
          swing_up_again(N, Eigen::Vector4d(0.001, 0.001, 0.001, 0.001), 0.0));
    print("cart-pole", N, "start by 0.01",
          swing_up_again(N, Eigen::Vector4d(0.01, 0.01, 0.01, 0.01), 0.0));
    print("cart-pole", N, "start by 0.1",
          swing_up_again(N, Eigen::Vector4d(0.1, 0.1, 0.1, 0.1), 0.0));
    print("cart-pole", N, "force by 0.01 N", swing_up_again(N, start, 0.01));
    print("cart-pole", N, "force by 0.1 N", swing_up_again(N, start, 0.1));
    print("cart-pole", N, "force by 1 N", swing_up_again(N, start, 1.0));
  }
  for (const int N : {100, 300, 1000}) {
    const auto make = [N](Problem& problem, const Expression& r) { state_flywheel(problem, N, r); };
    print("flywheel", N, "reference by 0.1 %", program_again(make, 10.0, 10.01));
    print("flywheel", N, "reference by 2 %", program_again(make, 10.0, 10.2));
    print("flywheel", N, "reference by 20 %", program_again(make, 10.0, 8.0));
  }
  for (const int N : {100, 300, 700}) {
    const auto make = [N](Problem& problem, const Expression& r) {
      state_double_integrator(problem, N, r);
    };
    print("double integrator", N, "goal by 0.1 %", program_again(make, 2.0, 2.002));
    print("double integrator", N, "goal by 2 %", program_again(make, 2.0, 1.96));
    print("double integrator", N, "goal by 20 %", program_again(make, 2.0, 1.6));
  }
  return 0;
}
