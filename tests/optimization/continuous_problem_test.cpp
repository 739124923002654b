#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <flyball/math/expression/formula.hpp>
#include <flyball/optimization/ocp/continuous_solution.hpp>

namespace continuous_problem_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace flyball;
using namespace flyball::optimization;

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::array all_methods{Transcription::runge_kutta, Transcription::multiple_shooting,
                                 Transcription::hermite_simpson, Transcription::radau};

VectorXd one(double value) {
  return VectorXd::Constant(1, value);
}

const auto double_integrator = [](const auto& x, const auto& u) {
  return std::array<Expression, 2>{x(1), u(0)};
};
const auto squared_input = [](const auto& /*x*/, const auto& u) { return u(0) * u(0); };

ContinuousSolution solved(const ContinuousProblem& problem, Transcription method, int intervals,
                          double error_tolerance = 0.0) {
  TranscriptionOptions options{.method = method, .intervals = intervals};
  options.error_tolerance = error_tolerance;
  const auto solution = solve(problem, options);
  EXPECT_TRUE(solution) << to_string(solution.error());
  if (!solution) {
    return {};
  }
  EXPECT_TRUE(solution->solved()) << to_string(method) << ": " << solution->message;
  return *solution;
}

// min ½ ∫ x² + u², ẋ = u, x(0) = 1 over 1 s: the Riccati equation gives ½ tanh 1. The cost's error
// falls with the order of the quadrature and of what the input may be.
TEST(ContinuousProblem, MethodsConvergeWithTheirOrder) {
  ContinuousProblem problem(1, 1);
  problem.set_derivative([](const auto& /*x*/, const auto& u) { return u(0); });
  problem.set_running_cost(
      [](const auto& x, const auto& u) { return 0.5 * (x(0) * x(0) + u(0) * u(0)); });
  problem.fix_start(one(1.0));
  problem.set_duration(1.0);
  const double best = 0.5 * std::tanh(1.0);
  const auto order = [&](Transcription method, int coarse) {
    const double a = std::abs(solved(problem, method, coarse).cost - best);
    const double b = std::abs(solved(problem, method, 2 * coarse).cost - best);
    return std::log2(a / b);
  };
  EXPECT_NEAR(order(Transcription::runge_kutta, 8), 2.0, 0.1);  // the held input
  EXPECT_NEAR(order(Transcription::multiple_shooting, 8), 2.0, 0.1);
  EXPECT_NEAR(order(Transcription::hermite_simpson, 4), 4.0, 0.3);
  EXPECT_GT(order(Transcription::radau, 2), 4.7);
}

// A mass of 1 kg, |u| ≤ 1 N, over 1 m from rest to rest: full ahead, full astern, 2 s.
TEST(ContinuousProblem, MinimumTimeIsBangBang) {
  ContinuousProblem problem(2, 1);
  problem.set_derivative(double_integrator);
  problem.bound_inputs(one(-1.0), one(1.0));
  problem.fix_start(Vector2d(0.0, 0.0));
  problem.fix_end(Vector2d(1.0, 0.0));
  problem.free_duration(0.1, 20.0, 5.0);
  problem.minimize_time();
  for (const Transcription method : all_methods) {
    const ContinuousSolution s = solved(problem, method, 20);
    // A continuous input takes an interval to change its sign.
    const double slack = method == Transcription::hermite_simpson ? 0.01 : 1e-5;
    EXPECT_GE(s.duration, 2.0 - 1e-6) << to_string(method);
    EXPECT_LE(s.duration, 2.0 + slack) << to_string(method);
    EXPECT_NEAR(s.phases[0].input(0.3)(0), 1.0, 1e-3);
    EXPECT_NEAR(s.phases[0].input(1.7)(0), -1.0, 1e-3);
    EXPECT_LT(s.largest_error, 1e-9);  // parabolas are exact
  }
}

// The brachistochrone: from rest down to the cycloid's point at angle 2, with R = 1 m:
// x = 2 - sin 2, y = 1 - cos 2, and T = 2 √(R/g).
TEST(ContinuousProblem, BrachistochroneIsACycloid) {
  constexpr double g = 9.80665;
  ContinuousProblem problem(3, 1);
  problem.set_derivative([](const auto& x, const auto& u) {
    return std::array<Expression, 3>{x(2) * sin(u(0)), x(2) * cos(u(0)), g * cos(u(0))};
  });
  problem.fix_start(Vector3d(0.0, 0.0, 0.0));
  problem.fix_end(Vector3d(2.0 - std::sin(2.0), 1.0 - std::cos(2.0), nan));
  problem.bound_inputs(one(0.0), one(3.0));
  problem.free_duration(0.1, 10.0, 1.0);
  problem.minimize_time();
  const double T = 2.0 / std::sqrt(g);
  for (const Transcription method : {Transcription::hermite_simpson, Transcription::radau}) {
    const ContinuousSolution s = solved(problem, method, 20);
    EXPECT_NEAR(s.duration, T, 1e-6) << to_string(method);
    // The angle of the tangent from the vertical is half the cycloid's angle, which grows evenly.
    EXPECT_NEAR(s.phases[0].input(0.5 * T)(0), 0.5, 2e-3) << to_string(method);
  }
  EXPECT_NEAR(solved(problem, Transcription::runge_kutta, 60).duration, T, 1e-4);
}

// Bryson and Denham: min ½ ∫ u² from (0, 1) to (0, -1) in 1 s with x ≤ l costs 4/(9 l), l ≤ 1/6.
TEST(ContinuousProblem, APathConstraintIsTouchedAlongAnArc) {
  ContinuousProblem problem(2, 1);
  problem.set_derivative(double_integrator);
  problem.set_running_cost([](const auto&, const auto& u) { return 0.5 * u(0) * u(0); });
  problem.add_path_constraint([](const auto& x) { return x(0); }, one(-inf), one(1.0 / 9.0),
                              "ceiling");
  problem.fix_start(Vector2d(0.0, 1.0));
  problem.fix_end(Vector2d(0.0, -1.0));
  problem.set_duration(1.0);
  for (const Transcription method : all_methods) {
    EXPECT_NEAR(solved(problem, method, 60).cost, 4.0, 0.01) << to_string(method);
  }
  problem.bound_states(Vector2d(-inf, -inf), Vector2d(1.0 / 12.0, inf));
  EXPECT_NEAR(solved(problem, Transcription::hermite_simpson, 60).cost, 16.0 / 3.0, 0.02);
}

// Goddard's rocket in the usual units: it rises to 1.01283.
TEST(ContinuousProblem, GoddardsRocket) {
  ContinuousProblem problem(3, 1);
  problem.set_derivative([](const auto& x, const auto& u) {
    const auto drag = 310.0 * x(1) * x(1) * exp(500.0 * (1.0 - x(0)));
    return std::array<Expression, 3>{x(1), (u(0) - drag) / x(2) - 1.0 / (x(0) * x(0)), -2.0 * u(0)};
  });
  problem.set_final_cost([](const auto& x) { return -x(0); });
  problem.bound_inputs(one(0.0), one(3.5));
  problem.bound_states(Vector3d(1.0, 0.0, 0.6), Vector3d(inf, inf, 1.0));
  problem.fix_start(Vector3d(1.0, 0.0, 1.0));
  problem.fix_end(Vector3d(nan, nan, 0.6));
  problem.free_duration(0.02, 1.0, 0.2);
  const ContinuousSolution s = solved(problem, Transcription::radau, 40);
  EXPECT_NEAR(-s.cost, 1.01283, 2e-5);
  EXPECT_LT(s.largest_error, 1e-4);
}

// Van der Pol's oscillator: one optimum, by three methods, and the integrator's word on each.
TEST(ContinuousProblem, VanDerPol) {
  ContinuousProblem problem(2, 1);
  problem.set_derivative([](const auto& x, const auto& u) {
    return std::array<Expression, 2>{(1.0 - x(1) * x(1)) * x(0) - x(1) + u(0), x(0)};
  });
  problem.set_running_cost(
      [](const auto& x, const auto& u) { return x(0) * x(0) + x(1) * x(1) + u(0) * u(0); });
  problem.fix_start(Vector2d(0.0, 1.0));
  problem.set_duration(10.0);
  const ContinuousSolution radau = solved(problem, Transcription::radau, 40);
  const ContinuousSolution simpson = solved(problem, Transcription::hermite_simpson, 80);
  const ContinuousSolution held = solved(problem, Transcription::runge_kutta, 400);
  EXPECT_NEAR(radau.cost, simpson.cost, 1e-5);
  EXPECT_NEAR(radau.cost, held.cost, 1e-3);
  EXPECT_GT(held.cost, radau.cost);  // what is held is a restriction
  EXPECT_LT(radau.largest_error, 1e-6);
  EXPECT_LT(simpson.largest_error, 1e-5);
  // The minimum principle: u = -λ/2 where λ' = -∂H/∂x, which a trajectory of the optimum obeys
  // backwards from λ(10) = 0.
  const PhaseTrajectory& t = radau.phases[0];
  Vector2d lambda = Vector2d::Zero();
  const int steps = 20000;
  const double h = 10.0 / steps;
  double worst = 0.0;
  const auto slope = [&](double at, const Vector2d& l) {
    const VectorXd x = t.state(at);
    return Vector2d(-2.0 * x(0) - (1.0 - x(1) * x(1)) * l(0) - l(1),
                    -2.0 * x(1) + (2.0 * x(1) * x(0) + 1.0) * l(0));
  };
  for (int k = steps; k > 0; --k) {
    const double at = k * h;
    const Vector2d middle = lambda - 0.5 * h * slope(at, lambda);
    lambda -= h * slope(at - 0.5 * h, middle);
    worst = std::max(worst, std::abs(t.input(at - h)(0) + 0.5 * lambda(0)));
  }
  EXPECT_LT(worst, 5e-3);
}

// From rest to rest by way of x = 1: two cubics of cost 12 each; the input passes -6.
TEST(ContinuousProblem, PhasesMeet) {
  ContinuousProblem problem(2, 1, 2);
  problem.set_derivative(double_integrator);
  problem.set_running_cost(squared_input);
  problem.fix_start(Vector2d(0.0, 0.0));
  problem.fix_end(Vector2d(1.0, nan), 0);
  problem.fix_end(Vector2d(0.0, 0.0));
  problem.set_duration(1.0);
  for (const Transcription method : all_methods) {
    const ContinuousSolution s = solved(problem, method, 30);
    EXPECT_NEAR(s.cost, 24.0, 0.1) << to_string(method);
    EXPECT_NEAR(s.phases[0].states(1, 30), 0.0, 1e-6);
    EXPECT_DOUBLE_EQ(s.phases[1].times(0), 1.0);
    EXPECT_NEAR(s.phases[1].state(1.5)(0), 0.5, 2e-3);
  }
  EXPECT_NEAR(solved(problem, Transcription::hermite_simpson, 4).cost, 24.0, 1e-6);
}

// Phases of other dynamics: u counts double in the second, where all time is spent that pays.
TEST(ContinuousProblem, PhasesOfTheirOwnDynamics) {
  ContinuousProblem problem(1, 1, 2);
  problem.set_derivative([](const auto&, const auto& u) { return u(0); }, 0);
  problem.set_derivative([](const auto&, const auto& u) { return 2.0 * u(0); }, 1);
  problem.bound_inputs(one(-1.0), one(1.0));
  problem.fix_start(one(0.0));
  problem.fix_end(one(3.0));
  problem.free_duration(0.5, 10.0, 2.0);
  problem.minimize_time();
  for (const Transcription method : all_methods) {
    const ContinuousSolution s = solved(problem, method, 5);
    EXPECT_NEAR(s.phases[0].duration, 0.5, 1e-6) << to_string(method);
    EXPECT_NEAR(s.phases[1].duration, 1.25, 1e-6) << to_string(method);
  }
  problem.share_duration(1, 0);  // 3 T = 3
  const ContinuousSolution s = solved(problem, Transcription::radau, 5);
  EXPECT_NEAR(s.phases[0].duration, 1.0, 1e-6);
  EXPECT_NEAR(s.phases[1].duration, 1.0, 1e-6);
}

// A ball that falls from 1 m and leaves the ground with half its speed: times and height.
TEST(ContinuousProblem, APhaseBeginsWithAJump) {
  constexpr double g = 10.0;
  ContinuousProblem problem(2, 0, 2);
  problem.set_derivative([](const auto& x) { return std::array<Expression, 2>{x(1), -g}; });
  problem.set_jump([](const auto& x) { return std::array<Expression, 2>{x(0), -0.5 * x(1)}; }, 1);
  problem.fix_start(Vector2d(1.0, 0.0));
  problem.fix_end(Vector2d(0.0, nan), 0);
  problem.add_end_constraint([](const auto& x) { return x(1); }, one(0.0), one(0.0), 1,
                             ContinuousProblem::End::end, "the top");
  problem.free_duration(0.01, 5.0, 0.5);
  problem.minimize_time();
  const double fall = std::sqrt(2.0 / g);
  for (const Transcription method : all_methods) {
    const ContinuousSolution s = solved(problem, method, 4);
    EXPECT_NEAR(s.phases[0].duration, fall, 1e-6) << to_string(method);
    EXPECT_NEAR(s.phases[1].duration, 0.5 * fall, 1e-6) << to_string(method);
    EXPECT_NEAR(s.phases[1].states(0, 4), 0.25, 1e-6);
    EXPECT_NEAR(s.phases[1].states(1, 0), 0.5 * g * fall, 1e-6);
  }
}

// Rao's hypersensitive problem: what happens is at the two ends, and so is the mesh.
TEST(ContinuousProblem, TheMeshIsFineWhereTheErrorIs) {
  ContinuousProblem problem(1, 1);
  problem.set_derivative([](const auto& x, const auto& u) { return -x(0) * x(0) * x(0) + u(0); });
  problem.set_running_cost([](const auto& x, const auto& u) { return x(0) * x(0) + u(0) * u(0); });
  problem.fix_start(one(1.0));
  problem.fix_end(one(1.5));
  problem.set_duration(100.0);
  const ContinuousSolution coarse = solved(problem, Transcription::hermite_simpson, 20);
  EXPECT_GT(coarse.largest_error, 1e-2);
  const ContinuousSolution s = solved(problem, Transcription::hermite_simpson, 20, 1e-6);
  EXPECT_TRUE(s.accurate) << s.message;
  EXPECT_LE(s.largest_error, 1e-6);
  EXPECT_GT(s.refinements, 0);
  const VectorXd& t = s.phases[0].times;
  const auto N = t.size() - 1;
  EXPECT_LT(t(1) - t(0), 0.2);
  EXPECT_LT(t(N) - t(N - 1), 0.2);
  EXPECT_GT((t.tail(N) - t.head(N)).maxCoeff(), 2.0);
  EXPECT_LT(N, 400);
}

// The estimate is the error: it falls by 2⁵ as intervals halve.
TEST(ContinuousProblem, ErrorsOfIntervalsFallWithTheOrder) {
  ContinuousProblem problem(2, 1);
  problem.set_derivative([](const auto& x, const auto& u) {
    return std::array<Expression, 2>{x(1), -sin(x(0)) + u(0)};
  });
  problem.set_running_cost(squared_input);
  problem.fix_start(Vector2d(0.0, 0.0));
  problem.fix_end(Vector2d(2.0, 0.0));
  problem.set_duration(2.0);
  for (const Transcription method : {Transcription::runge_kutta, Transcription::hermite_simpson}) {
    const double a = solved(problem, method, 10).largest_error;
    const double b = solved(problem, method, 20).largest_error;
    EXPECT_NEAR(std::log2(a / b), 5.0, 0.7) << to_string(method);
  }
}

/// The end of an interval by 400 steps of Runge and Kutta's method, from where it begins and with
/// its input.
Vector2d end_of(const PhaseTrajectory& phase, Eigen::Index k) {
  const auto slope = [&](double t, const Vector2d& x) {
    return Vector2d(x(1), -std::sin(x(0)) + phase.input(t)(0));
  };
  const double from = phase.times(k);
  const double whole = phase.times(k + 1) - from;
  // An input of its own each interval: its ends belong to it.
  const auto inside = [&](double t) {
    return std::clamp(t, from + 1e-12 * whole, from + (1.0 - 1e-12) * whole);
  };
  Vector2d x = phase.states.col(k);
  const double h = whole / 400;
  for (int i = 0; i < 400; ++i) {
    const double t = from + h * i;
    const Vector2d a = slope(inside(t), x);
    const Vector2d b = slope(t + 0.5 * h, x + 0.5 * h * a);
    const Vector2d c = slope(t + 0.5 * h, x + 0.5 * h * b);
    const Vector2d d = slope(inside(t + h), x + h * c);
    x += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  return x;
}

// What refinement goes by is the error that an integrator of this file's own finds, interval by
// interval, on the first mesh and on each that refinement makes; the largest one falls below what
// was asked for.
TEST(ContinuousProblem, RefinementLowersAnErrorThatIsTrue) {
  ContinuousProblem problem(2, 1);
  problem.set_derivative([](const auto& x, const auto& u) {
    return std::array<Expression, 2>{x(1), -sin(x(0)) + u(0)};
  });
  problem.set_running_cost(squared_input);
  problem.fix_start(Vector2d(0.0, 0.0));
  problem.fix_end(Vector2d(2.0, 0.0));
  problem.set_duration(2.0);
  for (const Transcription method : {Transcription::hermite_simpson, Transcription::radau}) {
    double before = inf;
    for (const int rounds : {0, 1, 8}) {
      TranscriptionOptions options{.method = method, .intervals = 3};
      options.error_tolerance = 1e-9;
      options.max_refinements = rounds;
      const ContinuousSolution s = solve(problem, options).value();
      ASSERT_TRUE(s.solved()) << to_string(method) << ": " << s.message;
      const PhaseTrajectory& phase = s.phases[0];
      const Eigen::ArrayXd size = 1.0 + phase.states.cwiseAbs().rowwise().maxCoeff().array();
      double largest = 0.0;
      for (Eigen::Index k = 0; k < phase.errors.size(); ++k) {
        const Vector2d end = phase.states.col(k + 1);
        const double error = ((end - end_of(phase, k)).array().abs() / size).maxCoeff();
        EXPECT_NEAR(phase.errors(k), error, 0.05 * error + 2e-11)
            << to_string(method) << ", interval " << k << " after " << s.refinements;
        largest = std::max(largest, error);
      }
      EXPECT_NEAR(s.largest_error, largest, 0.05 * largest + 2e-11);
      EXPECT_LT(largest, 0.3 * before) << to_string(method) << " after " << s.refinements;
      EXPECT_LE(s.refinements, rounds);
      before = largest;
      EXPECT_EQ(s.accurate, rounds == 8) << s.message;
    }
    EXPECT_LE(before, 1e-9);
  }
}

TEST(ContinuousProblem, GoesAroundAnObstacle) {
  ContinuousProblem problem(4, 2);
  problem.set_derivative([](const auto& x, const auto& u) {
    return std::array<Expression, 4>{x(2), x(3), u(0), u(1)};
  });
  problem.set_running_cost([](const auto&, const auto& u) { return u(0) * u(0) + u(1) * u(1); });
  problem.fix_start(Eigen::Vector4d(0.0, 0.0, 0.0, 0.0));
  problem.fix_end(Eigen::Vector4d(4.0, 0.0, 0.0, 0.0));
  problem.set_duration(3.0);
  problem.keep_out(0, 1, Vector2d(2.0, 0.1), 0.5, "post");
  const ContinuousSolution s = solved(problem, Transcription::radau, 20);
  const MatrixXd& x = s.phases[0].states;
  for (Eigen::Index k = 0; k < x.cols(); ++k) {
    EXPECT_GT((x.col(k).head<2>() - Vector2d(2.0, 0.1)).norm(), 0.5 - 1e-6);
  }
  EXPECT_LT(x.row(1).minCoeff(), -0.3);  // below, where the way is shorter
}

// A formula's tape and the lambda that says the same give the same trajectory.
TEST(ContinuousProblem, TakesTapesOfFormulas) {
  const auto compiled =
      expression::compile({.variables = {{"x", ""}, {"v", ""}, {"u", ""}},
                           .outputs = {{"dx", "v", ""}, {"dv", "u - sin(x)", ""}}});
  ASSERT_TRUE(compiled);
  const auto statement = [](const auto& f) {
    ContinuousProblem problem(2, 1);
    problem.set_derivative(f);
    problem.set_running_cost(squared_input);
    problem.fix_start(Vector2d(0.0, 0.0));
    problem.fix_end(Vector2d(3.0, 0.0));
    problem.set_duration(3.0);
    return problem;
  };
  const double by_lambda = solved(statement([](const auto& x, const auto& u) {
                                    return std::array<Expression, 2>{x(1), u(0) - sin(x(0))};
                                  }),
                                  Transcription::hermite_simpson, 20)
                               .cost;
  EXPECT_NEAR(solved(statement(compiled->tape), Transcription::hermite_simpson, 20).cost, by_lambda,
              1e-9);
}

TEST(ContinuousProblem, RefusesWhatMakesNoSense) {
  const auto message = [](const ContinuousProblem& problem) {
    const auto s = solve(problem);
    return s ? std::string("no error") : to_string(s.error());
  };
  const auto with = [&](auto&& change) {
    ContinuousProblem problem(2, 1, 2);
    problem.set_derivative(double_integrator);
    problem.set_duration(1.0);
    change(problem);
    return message(problem);
  };
  EXPECT_NE(message(ContinuousProblem(0, 1)).find("the number of states"), std::string::npos);
  EXPECT_NE(message(ContinuousProblem(2, 1)).find("the derivative of phase 0"), std::string::npos);
  using P = ContinuousProblem;
  EXPECT_NE(with([](P& p) { p.set_duration(-1.0); }).find("duration"), std::string::npos);
  EXPECT_NE(with([](P& p) {
              p.set_derivative([](const auto& x) { return x(0); });
            }).find("what the derivative returns"),
            std::string::npos);
  EXPECT_NE(with([](P& p) { p.bound_inputs(one(1.0), one(-1.0)); }).find("the inputs"),
            std::string::npos);
  EXPECT_NE(with([](P& p) { p.bound_states(one(1.0), one(1.0)); }).find("the states"),
            std::string::npos);
  EXPECT_NE(with([](P& p) { p.fix_start(Vector2d(inf, 0.0)); }).find("the start"),
            std::string::npos);
  EXPECT_NE(with([](P& p) { p.fix_end(Vector2d(0.0, 0.0), 2); }).find("phase"), std::string::npos);
  EXPECT_NE(with([](P& p) { p.share_duration(0, 1); }).find("share"), std::string::npos);
  EXPECT_NE(with([](P& p) { p.minimize_time(nan); }).find("weight of time"), std::string::npos);
  EXPECT_NE(with([](P& p) { p.keep_out(0, 5, Vector2d::Zero(), 1.0); }).find("obstacle"),
            std::string::npos);
  EXPECT_NE(with([](P& p) {
              p.set_guess(one(0.0), MatrixXd::Zero(2, 1), MatrixXd(1, 0));
            }).find("a guess"),
            std::string::npos);
  EXPECT_NE(with([](P& p) {
              p.set_jump([](const auto& x) { return std::array<Expression, 2>{x(0), x(1)}; }, 0);
            }).find("jump"),
            std::string::npos);
}

TEST(ContinuousProblem, SaysWhatCannotBeDone) {
  // 1 m from rest to rest in 1 s takes 4 N.
  ContinuousProblem problem(2, 1);
  problem.set_derivative(double_integrator);
  problem.bound_inputs(one(-1.0), one(1.0));
  problem.fix_start(Vector2d(0.0, 0.0));
  problem.fix_end(Vector2d(1.0, 0.0));
  problem.set_duration(1.0);
  for (const Transcription method : {Transcription::runge_kutta, Transcription::multiple_shooting,
                                     Transcription::hermite_simpson, Transcription::radau}) {
    const auto s = solve(problem, {.method = method}).value();
    EXPECT_EQ(s.status, SolveStatus::infeasible) << to_string(method) << ": " << s.message;
    ASSERT_FALSE(s.violations.empty()) << to_string(method);
    EXPECT_GT(s.violations[0].amount, 1e-4);
    EXPECT_NE(s.message.find("infeasible"), std::string::npos) << s.message;
    EXPECT_NE(s.message.find("at stage"), std::string::npos) << s.message;
    EXPECT_NE(s.message.find(" s)"), std::string::npos) << s.message;  // when
  }
  // A root of what turns negative.
  problem.set_derivative([](const auto& x, const auto& u) {
    return std::array<Expression, 2>{x(1), u(0) + sqrt(-1.0 - x(0) * x(0))};
  });
  const auto bad = solve(problem).value();
  EXPECT_EQ(bad.status, SolveStatus::not_finite);
  EXPECT_NE(bad.message.find("stage"), std::string::npos) << bad.message;
  // A root's slope where it ends: the value is finite, the derivative is not.
  problem.set_derivative([](const auto& x, const auto& u) {
    return std::array<Expression, 2>{x(1), u(0) + sqrt(x(0) * x(0))};
  });
  const auto steep = solve(problem, {.method = Transcription::runge_kutta}).value();
  EXPECT_EQ(steep.status, SolveStatus::not_finite);
  EXPECT_EQ(steep.message, "a derivative of dynamics of state 0 is not finite at stage 0");
}

}  // namespace
}  // namespace continuous_problem_test
