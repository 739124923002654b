#include <flyball/optimization/ocp/optimal_control.hpp>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/math/derivatives/dual.hpp>

#include "optimization/cart_pole.hpp"
#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace optimal_control_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using namespace flyball;
using namespace flyball::optimization;

constexpr double inf = std::numeric_limits<double>::infinity();

VectorXd one(double value) {
  return VectorXd::Constant(1, value);
}

struct DoubleIntegrator {
  template <class X, class U>
  auto operator()(const X& x, const U& u) const {
    return std::array{x(1), u(0)};
  }
};

OptimalControlProblem rest_to_rest(int N, double duration, double distance) {
  OptimalControlProblem problem(2, 1, N);
  problem.set_derivative(DoubleIntegrator{}, duration);
  problem.set_stage_cost([](const auto&, const auto& u) { return u(0) * u(0); });
  problem.fix_state(0, Vector2d(0.0, 0.0));
  problem.fix_state(N, Vector2d(distance, 0.0));
  return problem;
}

/// One step of the classical method, by dual numbers: the value and ∂x⁺/∂(x, u).
template <class F>
std::pair<VectorXd, MatrixXd> step_of(const F& f, const VectorXd& x, const VectorXd& u, double h) {
  using Number = Dual<Eigen::Dynamic>;
  const auto n = static_cast<int>(x.size());
  const auto m = static_cast<int>(u.size());
  Eigen::Matrix<Number, Eigen::Dynamic, 1> X(n), U(m);
  for (int i = 0; i < n; ++i) {
    X(i) = Number::variable(x(i), i, n + m);
  }
  for (int i = 0; i < m; ++i) {
    U(i) = Number::variable(u(i), n + i, n + m);
  }
  using Vector = Eigen::Matrix<Number, Eigen::Dynamic, 1>;
  const Vector k1 = f(X, U);
  const Vector k2 = f(Vector(X + k1 * Number(0.5 * h)), U);
  const Vector k3 = f(Vector(X + k2 * Number(0.5 * h)), U);
  const Vector k4 = f(Vector(X + k3 * Number(h)), U);
  VectorXd y(n);
  MatrixXd J(n, n + m);
  for (int i = 0; i < n; ++i) {
    const Number next =
        X(i) + (k1(i) + k2(i) * Number(2.0) + k3(i) * Number(2.0) + k4(i)) * Number(h / 6.0);
    y(i) = next.value;
    J.row(i) = next.gradient.transpose();
  }
  return {y, J};
}

/// The first-order conditions of the swing-up, from its states, inputs and costates alone: the
/// dynamics, and the signs of ∂L/∂x and ∂L/∂u where a bound may hold them, relative to the cost's
/// slope; the largest violation.
double swing_up_residual(const OptimalControlSolution& s, int N) {
  double worst = 0.0;
  // Where the cost rises with a value, this stands at its lower bound: one of both vanishes.
  const auto at_bound = [&](double value, double lower, double upper, double slope) {
    const double distance = slope > 0.0 ? value - lower : upper - value;
    worst = std::max(worst, -distance);
    worst = std::max(worst, std::abs(slope) / 40.0 * std::min(distance, 1.0));
  };
  for (int k = 0; k < N; ++k) {
    const auto [next, J] = step_of(cart_pole::Model{}, s.states.col(k), s.inputs.col(k), 5.0 / N);
    worst = std::max(worst, (next - s.states.col(k + 1)).cwiseAbs().maxCoeff());
    const VectorXd slope = J.transpose() * s.costates.col(k);
    at_bound(s.inputs(0, k), -20.0, 20.0, 2.0 * s.inputs(0, k) + slope(4));
    if (k > 0) {
      const VectorXd along = slope.head(4) - s.costates.col(k - 1);
      at_bound(s.states(0, k), 0.0, 2.0, along(0));
      for (int i = 1; i < 4; ++i) {
        worst = std::max(worst, std::abs(along(i)) / 40.0);
      }
    }
  }
  return worst;
}

// Costs and iterations: CasADi with IPOPT, fatrop and a multi-start found 11190.69659 (and
// 11181.31772), 33336.60091 for N = 100 and 300.
TEST(OptimalControl, SwingUpIsOptimalAtTwoMeshes) {
  for (const auto& [N, best] : {std::pair{100, 11190.69659}, std::pair{300, 33336.60091}}) {
    OptimalControlProblem problem = cart_pole::problem(N);
    problem.set_start(cart_pole::start(N), MatrixXd::Zero(1, N));
    const auto solution = solve(problem);
    ASSERT_TRUE(solution) << to_string(solution.error());
    EXPECT_EQ(solution->status, SolveStatus::solved) << solution->message;
    EXPECT_LE(solution->cost, best * (1.0 + 1e-7));
    EXPECT_GE(solution->cost, 11181.3);
    EXPECT_LE(solution->counts.iterations, 60);
    // Accurate to the tolerance over the objective's scale and multipliers of up to 10³.
    EXPECT_LE(swing_up_residual(*solution, N), 2e-5);
    EXPECT_NEAR(solution->states(1, N), std::numbers::pi, 1e-15);
  }
}

// Starts disturbed by noise of a linear congruential generator, as in the comparison of solvers.
TEST(OptimalControl, SwingUpFromDisturbedStarts) {
  const int N = 60;
  std::uint32_t seed = 12345;
  const auto noise = [&] {
    seed = seed * 1664525U + 1013904223U;
    return static_cast<double>(seed >> 8U) / 8388608.0 - 1.0;
  };
  auto solver = OptimalControlSolver::make(cart_pole::problem(N)).value();
  for (int run = 0; run < 12; ++run) {
    MatrixXd x = cart_pole::start(N);
    MatrixXd u = MatrixXd::Zero(1, N);
    for (double& value : x.reshaped()) {
      value += 0.3 * noise();
    }
    for (double& value : u.reshaped()) {
      value += 0.3 * noise();
    }
    ASSERT_TRUE(solver.set_start(x, u));
    const OptimalControlSolution solution = solver.solve();
    EXPECT_EQ(solution.status, SolveStatus::solved) << "run " << run << ": " << solution.message;
    EXPECT_LE(swing_up_residual(solution, N), 2e-5);
  }
}

// Least Σ u² that moves a double integrator from rest to rest in N steps h: with x_N = Σ c_k u_k,
// c_k = h (h (N - k - ½), 1), u = Cᵀ (C Cᵀ)⁻¹ (distance, 0).
TEST(OptimalControl, LeastEffortOfTheDoubleIntegrator) {
  const int N = 40;
  const double h = 2.0 / N;
  MatrixXd C(2, N);
  for (int k = 0; k < N; ++k) {
    C.col(k) = Vector2d(h * h * (N - k - 0.5), h);
  }
  const VectorXd exact =
      C.transpose() * test::solve(MatrixXd(C * C.transpose()), MatrixXd(Vector2d(1.5, 0.0)));
  const auto solution = solve(rest_to_rest(N, 2.0, 1.5)).value();
  EXPECT_TRUE(solution.solved());
  EXPECT_LT((solution.inputs.transpose() - exact).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(solution.cost, exact.squaredNorm(), 1e-7);
}

// |u| ≤ 1 moves a double integrator over 1 m from rest to rest in no less than 2 s, full ahead to
// the middle, then full astern.
TEST(OptimalControl, LeastTimeOfTheDoubleIntegrator) {
  const int N = 50;
  OptimalControlProblem problem(2, 1, N, 1);
  problem.set_derivative_over_free_time(DoubleIntegrator{}, 0);
  problem.set_terminal_cost([](const auto&, const auto&, const auto& p) { return p(0); });
  problem.fix_state(0, Vector2d(0.0, 0.0));
  problem.fix_state(N, Vector2d(1.0, 0.0));
  problem.bound_inputs(one(-1.0), one(1.0));
  problem.bound_parameters(one(0.1), one(100.0));
  problem.set_parameter_start(one(5.0));
  const auto solution = solve(problem).value();
  EXPECT_EQ(solution.status, SolveStatus::solved) << solution.message;
  EXPECT_NEAR(solution.parameters(0), 2.0, 1e-5);
  EXPECT_NEAR(solution.inputs(0, 10), 1.0, 1e-4);
  EXPECT_NEAR(solution.inputs(0, 40), -1.0, 1e-4);
}

// Around a disc of radius 0.4 at (0.5, 0.1), and through a gate in the middle, both named.
TEST(OptimalControl, PathConstraintsAndEqualitiesInTheMiddle) {
  const int N = 60;
  OptimalControlProblem problem(4, 2, N);
  problem.set_derivative(
      [](const auto& x, const auto& u) { return std::array{x(2), x(3), u(0), u(1)}; }, 3.0);
  problem.set_stage_cost([](const auto&, const auto& u) { return u(0) * u(0) + u(1) * u(1); });
  problem.fix_state(0, VectorXd::Zero(4));
  problem.fix_state(N, Eigen::Vector4d(1.0, 0.0, 0.0, 0.0));
  problem.add_constraint(
      [](const auto& x) { return (x(0) - 0.5) * (x(0) - 0.5) + (x(1) - 0.1) * (x(1) - 0.1); },
      one(0.16), one(inf), 1, N - 1, "the disc");
  problem.add_constraint([](const auto& x) { return x(0) + 2.0 * x(1); }, one(-0.2), one(-0.2),
                         N / 2, N / 2, "the gate");
  MatrixXd start = MatrixXd::Zero(4, N + 1);
  start.row(0).setLinSpaced(0.0, 1.0);
  problem.set_start(start, MatrixXd::Zero(2, N));
  const auto solution = solve(problem).value();
  EXPECT_EQ(solution.status, SolveStatus::solved) << solution.message;
  double nearest = 1.0;
  for (int k = 0; k <= N; ++k) {
    nearest = std::min(nearest, (solution.states.col(k).head(2) - Vector2d(0.5, 0.1)).norm());
  }
  EXPECT_GE(nearest, 0.4 - 1e-7);
  EXPECT_LE(nearest, 0.4 + 1e-4);  // it holds the path
  EXPECT_NEAR(solution.states(0, N / 2) + 2.0 * solution.states(1, N / 2), -0.2, 1e-7);
}

// The same condition twice leaves multipliers undetermined, not the trajectory.
TEST(OptimalControl, DependentConstraints) {
  OptimalControlProblem problem = rest_to_rest(40, 2.0, 1.5);
  const double cost = solve(problem).value().cost;
  for (int copy = 0; copy < 2; ++copy) {
    problem.add_constraint([](const auto& x) { return std::array{x(0), x(1)}; }, Vector2d(1.5, 0.0),
                           Vector2d(1.5, 0.0), 40, 40);
  }
  const auto solution = solve(problem).value();
  EXPECT_EQ(solution.status, SolveStatus::solved) << solution.message;
  EXPECT_NEAR(solution.cost, cost, 1e-6 * cost);
}

TEST(OptimalControl, InfeasibleIsRecognizedAndNamed) {
  OptimalControlProblem problem = rest_to_rest(30, 1.0, 10.0);  // would take |u| = 40
  problem.bound_inputs(one(-1.0), one(1.0));
  const auto solution = solve(problem).value();
  EXPECT_EQ(solution.status, SolveStatus::infeasible);
  EXPECT_FALSE(solution.solved());
  ASSERT_FALSE(solution.violations.empty());
  EXPECT_NE(solution.message.find("dynamics of state"), std::string::npos) << solution.message;
  EXPECT_GT(solution.violations.front().amount, 1e-3);
}

TEST(OptimalControl, NotFiniteIsNamed) {
  OptimalControlProblem problem = rest_to_rest(10, 1.0, 1.0);
  problem.add_constraint([](const auto& x) { return sqrt(x(0) - 5.0); }, one(0.0), one(1.0), 3, 3,
                         "the root");
  const auto solution = solve(problem).value();
  EXPECT_EQ(solution.status, SolveStatus::not_finite);
  EXPECT_EQ(solution.message, "the root is not finite at stage 3");
}

TEST(OptimalControl, LimitsAreHonoured) {
  OptimalControlProblem problem = cart_pole::problem(50);
  problem.set_start(cart_pole::start(50), MatrixXd::Zero(1, 50));
  auto solver = OptimalControlSolver::make(problem).value();
  SolverOptions few;
  few.max_iterations = 5;
  const OptimalControlSolution after_five = solver.solve(few);
  EXPECT_EQ(after_five.status, SolveStatus::iteration_limit);
  EXPECT_EQ(after_five.counts.iterations, 5);
  SolverOptions quick;
  quick.time_limit = 0.0;
  EXPECT_EQ(solver.solve(quick).status, SolveStatus::time_limit);
  int seen = 0;
  const auto watch = [&](const Iteration& row) {
    ++seen;
    return row.number >= 3;
  };
  EXPECT_EQ(solver.solve({}, watch).status, SolveStatus::stopped);
  EXPECT_EQ(seen, 3);
  EXPECT_EQ(solver.solve().status, SolveStatus::solved);  // none of it left a trace
}

// Limits hold in the phase that restores feasibility, too: this problem has no solution. Each look
// at a step takes a while, so that seconds are told from steps.
TEST(OptimalControl, LimitsAreHonouredWhereNothingIsFeasible) {
  OptimalControlProblem problem = rest_to_rest(30, 1.0, 10.0);
  problem.bound_inputs(one(-1.0), one(1.0));
  auto solver = OptimalControlSolver::make(problem).value();
  const OptimalControlSolution whole = solver.solve();
  ASSERT_EQ(whole.status, SolveStatus::infeasible);
  ASSERT_GT(whole.counts.restorations, 0);
  for (int most = 0; most < whole.counts.iterations; ++most) {
    SolverOptions options;
    options.max_iterations = most;
    int seen = 0;
    const OptimalControlSolution solution = solver.solve(options, [&](const Iteration&) {
      ++seen;
      return false;
    });
    EXPECT_EQ(solution.status, SolveStatus::iteration_limit) << most;
    EXPECT_EQ(solution.counts.iterations, most);
    EXPECT_LE(seen, most);
  }
  using Clock = std::chrono::steady_clock;
  for (const double limit : {0.002, 0.02}) {
    SolverOptions options;
    options.time_limit = limit;
    const auto begin = Clock::now();
    int late = 0;  // steps that were begun after the limit
    const OptimalControlSolution solution = solver.solve(options, [&](const Iteration&) {
      const auto now = Clock::now();
      late += std::chrono::duration<double>(now - begin).count() > limit ? 1 : 0;
      while (std::chrono::duration<double>(Clock::now() - now).count() < 1e-3) {
      }
      return false;
    });
    EXPECT_EQ(solution.status, SolveStatus::time_limit) << limit;
    EXPECT_LE(late, 1) << limit;
  }
}

// From the first step to the last no memory is asked for: the restoration phase alone is made when
// it is first needed, and this swing-up does without.
TEST(OptimalControl, IterationsDoNotAllocate) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  OptimalControlProblem problem = cart_pole::problem(80);
  problem.set_start(cart_pole::start(80), MatrixXd::Zero(1, 80));
  auto solver = OptimalControlSolver::make(problem).value();
  std::size_t at_first = 0;
  std::size_t at_last = 0;
  int steps = 0;
  const auto watch = [&](const Iteration&) {
    at_last = test::allocation_count();
    at_first = steps++ == 0 ? at_last : at_first;
    return false;
  };
  const OptimalControlSolution solution = solver.solve({}, watch);
  ASSERT_EQ(solution.status, SolveStatus::solved);
  ASSERT_EQ(solution.counts.restorations, 0);
  EXPECT_GT(steps, 10);
  EXPECT_EQ(at_last, at_first);
}

TEST(OptimalControl, AnotherInitialStateTakesFewerIterations) {
  OptimalControlProblem problem = cart_pole::problem(80);
  problem.set_start(cart_pole::start(80), MatrixXd::Zero(1, 80));
  auto solver = OptimalControlSolver::make(problem).value();
  const OptimalControlSolution first = solver.solve();
  ASSERT_TRUE(first.solved());
  ASSERT_TRUE(solver.fix_initial_state(Eigen::Vector4d(0.01, 0.02, 0.0, 0.0)));
  const OptimalControlSolution second = solver.resolve();
  EXPECT_EQ(second.status, SolveStatus::solved);
  EXPECT_LE(second.counts.iterations * 3, first.counts.iterations);
  EXPECT_NEAR(second.states(1, 0), 0.02, 1e-15);
  EXPECT_LE(swing_up_residual(second, 80), 2e-5);
}

// A force of 0.1 N that pushes along, at stages of 5 s / N: the swing-up solved again.
TEST(OptimalControl, ChangedDataTakeAThirdOfTheIterations) {
  for (const int N : {100, 1000}) {
    OptimalControlProblem problem(4, 1, N, 0, 1);
    problem.set_derivative(
        [](const auto& x, const auto& u, const auto&, const auto& d) {
          Eigen::Matrix<Expression, 1, 1> force;
          force(0) = u(0) + d(0);
          return cart_pole::Model{}(x, force);
        },
        5.0);
    problem.set_stage_cost([](const auto&, const auto& u) { return u(0) * u(0); });
    for (int k = 1; k < N; ++k) {
      problem.bound_state(k, Eigen::Vector4d(0.0, -inf, -inf, -inf),
                          Eigen::Vector4d(2.0, inf, inf, inf));
    }
    problem.bound_inputs(VectorXd::Constant(1, -20.0), VectorXd::Constant(1, 20.0));
    problem.fix_state(0, Eigen::Vector4d::Zero());
    problem.fix_state(N, Eigen::Vector4d(1.0, std::numbers::pi, 0.0, 0.0));
    problem.set_start(cart_pole::start(N), MatrixXd::Zero(1, N));
    auto solver = OptimalControlSolver::make(problem).value();
    const OptimalControlSolution first = solver.solve();
    ASSERT_TRUE(first.solved());
    // Nothing changed: it is where it was.
    EXPECT_EQ(solver.resolve().counts.iterations, 0);
    const MatrixXd push = MatrixXd::Constant(1, N + 1, 0.1);
    ASSERT_TRUE(solver.set_data(push));
    const OptimalControlSolution again = solver.resolve();
    EXPECT_EQ(again.status, SolveStatus::solved);
    EXPECT_LE(again.counts.iterations * 3, first.counts.iterations) << N;
    const OptimalControlSolution anew = solver.solve();
    EXPECT_NEAR(again.cost, anew.cost, 1e-7 * anew.cost) << N;
  }
}

// The number of steps does not grow with the mesh.
TEST(OptimalControl, SixtyStepsAtEveryMesh) {
  for (int N = 30; N <= 400; N += 50) {
    OptimalControlProblem problem = cart_pole::problem(N);
    problem.set_start(cart_pole::start(N), MatrixXd::Zero(1, N));
    const OptimalControlSolution solution = solve(problem).value();
    EXPECT_EQ(solution.status, SolveStatus::solved) << N;
    EXPECT_LE(solution.counts.iterations, 60) << N;
  }
}

TEST(OptimalControl, DataOfStages) {
  // Σ (x - d)² with ẋ = u free: x follows the data exactly.
  const int N = 12;
  OptimalControlProblem problem(1, 1, N, 0, 1);
  problem.set_dynamics([](const auto& x, const auto& u) { return std::array{x(0) + u(0)}; });
  const auto error = [](const auto& x, const auto&, const auto&, const auto& d) {
    return (x(0) - d(0)) * (x(0) - d(0));
  };
  problem.set_stage_cost(error);
  problem.set_terminal_cost(error);
  MatrixXd data(1, N + 1);
  for (int k = 0; k <= N; ++k) {
    data(0, k) = std::sin(0.7 * k);
  }
  problem.set_data(data);
  auto solver = OptimalControlSolver::make(problem).value();
  EXPECT_LT((solver.solve().states - data).cwiseAbs().maxCoeff(), 1e-7);
  ASSERT_TRUE(solver.set_data(2.0 * data));
  EXPECT_LT((solver.solve().states - 2.0 * data).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(OptimalControl, MisuseIsRefused) {
  const auto message = [](const OptimalControlProblem& problem) {
    const auto result = OptimalControlSolver::make(problem);
    return result ? std::string("no error") : to_string(result.error());
  };
  EXPECT_EQ(message(OptimalControlProblem(0, 1, 5)),
            "optimal control: the number of states is 0; it must be 1 to 1000");
  EXPECT_NE(message(OptimalControlProblem(1, 1, 5)).find("set_dynamics"), std::string::npos);
  OptimalControlProblem wrong = rest_to_rest(5, 1.0, 1.0);
  wrong.set_dynamics([](const auto& x, const auto&) { return std::array{x(0)}; });
  EXPECT_EQ(message(wrong),
            "optimal control: what the dynamics return is 1 entries; it must be 2 entries");
  OptimalControlProblem crossed = rest_to_rest(5, 1.0, 1.0);
  crossed.bound_inputs(one(1.0), one(-1.0));
  EXPECT_EQ(message(crossed),
            "optimal control: the bounds of input 0 is 1 to -1; it must be a "
            "lower bound that is not above the upper one");
  OptimalControlProblem far = rest_to_rest(5, 1.0, 1.0);
  far.bound_state(6, Vector2d(0.0, 0.0), Vector2d(1.0, 1.0));
  EXPECT_NE(message(far).find("0 to 5"), std::string::npos);
  OptimalControlProblem start = rest_to_rest(5, 1.0, 1.0);
  start.set_start(MatrixXd::Constant(2, 6, std::nan("")), MatrixXd::Zero(1, 5));
  EXPECT_NE(message(start).find("states"), std::string::npos);
}

}  // namespace
}  // namespace optimal_control_test
