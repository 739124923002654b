#include <utility>

#include <flyball/control/continuous_lqr.hpp>
#include <flyball/control/finite_horizon_lqr.hpp>
#include <flyball/control/implicit_model_following.hpp>
#include <flyball/control/integral_control.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/pole_placement.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Gains of state feedback.
namespace flyball::solve {

using Eigen::MatrixXd;

namespace {

/// With T a continuous plant is sampled, and the weights are the discrete cost's, as in Theorem
/// 7.7.1.
Outcome solve_lqr(const Problem& problem, JsonWriter& answer) {
  DiscretizedMatrices plant{problem.matrix("A"), problem.matrix("B")};
  bool discrete = problem.domain() == TimeDomain::discrete;
  if (!discrete && problem.has("T")) {
    FLYBALL_TRY(plant, discretize_zoh(plant.A, plant.B, Time(problem.number("T"))));
    discrete = true;
  }
  const MatrixXd& Q = problem.matrix("Q");
  const MatrixXd& R = problem.matrix("R");
  const auto solve = [&](const auto&... N) {
    return discrete ? lqr(plant.A, plant.B, Q, R, N...)
                    : continuous_lqr(plant.A, plant.B, Q, R, N...);
  };
  FLYBALL_TRY(const auto design, problem.has("N") ? solve(problem.matrix("N")) : solve());
  answer.add("K", design.K);
  answer.add("S", design.S);
  answer.add("poles", Eigen::VectorXcd(design.poles));
  answer.add("residual", design.residual);
  answer.add("condition", design.condition);
  return {};
}

Outcome solve_lqi(const Problem& problem, JsonWriter& answer) {
  const ContinuousSystem<> plant = problem.system();
  const MatrixXd& Q = problem.matrix("Q");
  const MatrixXd& R = problem.matrix("R");
  const bool discrete = problem.domain() == TimeDomain::discrete;
  if (discrete && !problem.has("T")) {
    return refusal(ArgumentError::malformed, "lqi", "T")
        .got("left out")
        .expected("the time over which a sample of the error is integrated");
  }
  const Time period(problem.has("T") ? problem.number("T") : 1.0);
  FLYBALL_TRY(const auto design,
              discrete ? lqi(DiscreteSystem<>{plant.A, plant.B, plant.C, plant.D, period}, Q, R)
              : problem.has("T")
                  ? discretize(plant, period).and_then([&](const DiscreteSystem<>& sampled) {
                      return lqi(sampled, Q, R);
                    })
                  : continuous_lqi(plant, Q, R));
  answer.add("K", design.K);
  answer.add("K_I", design.K_I);
  answer.add("S", design.S);
  answer.add("poles", design.poles);
  answer.add("residual", design.residual);
  answer.add("condition", design.condition);
  return {};
}

Outcome solve_finite_horizon(const Problem& problem, JsonWriter& answer) {
  const QuadraticCost cost{problem.matrix("Q"), problem.matrix("R"), problem.matrix("N")};
  const bool discrete = problem.domain() == TimeDomain::discrete;
  if (!discrete && !problem.has("horizon")) {
    return refusal(ArgumentError::malformed, "finite-horizon-lqr", "horizon")
        .got("left out")
        .expected("how long a continuous regulator acts, in seconds");
  }
  const MatrixXd& A = problem.matrix("A");
  const MatrixXd& B = problem.matrix("B");
  const MatrixXd& S_end = problem.matrix("S_end");
  const int steps = problem.integer("steps");
  FLYBALL_TRY(const auto design,
              discrete ? finite_horizon_lqr(A, B, cost, S_end, steps)
                       : continuous_finite_horizon_lqr(A, B, cost, S_end,
                                                       Time(problem.number("horizon")), steps));
  answer.add("K", design.K);
  answer.add("S", design.S);
  return {};
}

Outcome solve_implicit_model(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto model, implicit_model_following(
                                    problem.matrix("A"), problem.matrix("B"), problem.matrix("C"),
                                    problem.matrix("A_ref"), problem.matrix("B_ref"),
                                    problem.matrix("Q"), problem.matrix("R")));
  answer.add("K", model.K);
  answer.add("K_u", model.K_u);
  answer.add("poles", model.poles);
  answer.add("mismatch", model.mismatch);
  answer.add("Q", model.cost.Q);
  answer.add("R", model.cost.R);
  answer.add("N", model.cost.N);
  return {};
}

Outcome solve_place(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto placed,
              place(problem.matrix("A"), problem.matrix("B"), problem.complex_list("poles")));
  answer.add("K", placed.K);
  answer.add("poles", Eigen::VectorXcd(placed.poles));
  answer.add("condition", placed.condition);
  answer.add("pole_error", placed.pole_error);
  return {};
}

}  // namespace

std::vector<Kind> regulator_kinds() {
  using namespace field;
  const Field gain = matrix("K", "m", "n", "gain of u = K(r - x)", "input/state");
  const Field closed_loop = complex_list("poles", "n", "eigenvalues of A - BK");
  const Field sampling =
      optional(number("T", "s", "period with which a continuous plant is sampled first"));
  return {
      {"lqr",
       "the regulator u = K(r - x) with the least Σ xᵀQx + 2xᵀNu + uᵀRu (7.7)",
       {A, B, Q, R, N, sampling, or_first(domain)},
       {gain, matrix("S", "n", "n", "cost xᵀSx of what is to come"), closed_loop, riccati_residual,
        condition},
       R"({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "Q": [[100, 0], [0, 1]], "R": [[0.01]], "T": 0.02})",
       &solve_lqr},
      {"lqi",
       "the regulator with the integral of the outputs' error, u = K(r - x) - K_I x_I (6.7.1)",
       {A, B, matrix("C", "p", "n", "the outputs that are to stay at their references"), D,
        matrix("Q", "n+p", "n+p", "weight of the states and then of the integrals",
               "1/state², 1/(output s)²"),
        R, optional(number("T", "s", "sample period; with it a continuous plant is sampled first")),
        or_first(domain)},
       {gain, matrix("K_I", "m", "p", "gain of the integral ∫(r_y - y)dt", "input/(output s)"),
        matrix("S", "n+p", "n+p", "cost of what is to come, of [x; x_I]"),
        complex_list("poles", "n+p", "eigenvalues of the loop with its integrals"),
        riccati_residual, condition},
       R"({"A": [[-2]], "B": [[3]], "C": [[1]], "Q": [[1, 0], [0, 10]], "R": [[0.1]], "T": 0.02})",
       &solve_lqi},
      {"finite-horizon-lqr",
       "the regulator that changes with time, u_k = K[k](r_k - x_k), because it ends (7.7.2)",
       {A, B, Q, R, or_zero(N),
        matrix("S_end", "n", "n", "weight of the states at the end", "1/state²"),
        integer("steps", "how many"),
        choice("domain", "continuous discrete", "whether dx/dt = Ax + Bu or x⁺ = Ax + Bu"),
        optional(number("horizon", "s", "how long a continuous regulator acts"))},
       {matrices("K", "m", "n", "a gain a step, or one at each of steps + 1 times"),
        matrices("S", "n", "n", "cost xᵀSx of what is to come, at each step and at the end")},
       R"({"A": [[1, 0.1], [0, 1]], "B": [[0.005], [0.1]], "Q": [[1, 0], [0, 1]], "R": [[1]], "S_end": [[10, 0], [0, 10]], "steps": 3, "domain": "discrete"})",
       &solve_finite_horizon},
      {"implicit-model-following",
       "the feedback u = -Kx + K_u u that makes a discrete plant move like a reference model (B.3)",
       {A, B, C, matrix("A_ref", "p", "p", "how the reference model moves by itself"),
        matrix("B_ref", "p", "q", "how its inputs move it"),
        matrix("Q", "p", "p", "symmetric weight of the deviation a period ahead", "1/output²"), R},
       {matrix("K", "m", "n", "gain of the states"),
        matrix("K_u", "m", "q", "what the reference model's inputs become"), closed_loop,
        number("mismatch", "", "how far the plant does not follow, ‖(CA - A_ref C) - CBK‖"),
        matrix("Q", "n", "n", "the states' weight that this is (B.4)"),
        matrix("R", "m", "m", "the inputs' weight"), matrix("N", "n", "m", "the cross weight")},
       R"({"A": [[0.9]], "B": [[0.1]], "A_ref": [[0.7]], "B_ref": [[0.3]], "Q": [[1]], "R": [[0.0001]]})",
       &solve_implicit_model},
      {"place",
       "the gain with which A - BK has given eigenvalues (7.6)",
       {A, B, complex_list("poles", "n", "where they are to be")},
       {gain, complex_list("poles", "n", "where they are with this K, in the same order"),
        unbounded(number("condition", "", "how much a relative error of A - BK moves a pole")),
        number("pole_error", "",
               "no pole is further from its place, relative to itself (at 0: to the largest pole); "
               "at most 0.1")},
       R"({"A": [[0, 1], [0, 0]], "B": [[0], [1]], "poles": [[-1, 1], [-1, -1]]})",
       &solve_place},
  };
}

}  // namespace flyball::solve
