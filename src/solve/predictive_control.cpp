#include <limits>

#include <flyball/control/mpc/linear_mpc.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Predictive control: the best inputs over a horizon.
namespace flyball::solve {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::string_view name_of(MpcStatus status) {
  switch (status) {
    case MpcStatus::optimal:
      return "optimal";
    case MpcStatus::softened:
      return "softened";
    case MpcStatus::capped:
      return "capped";
    case MpcStatus::held:
      return "held";
  }
  return "";
}

Outcome solve_mpc(const Problem& problem, JsonWriter& answer) {
  DiscretizedMatrices plant{problem.matrix("A"), problem.matrix("B")};
  if (problem.has("T")) {
    FLYBALL_TRY(plant, discretize_zoh(plant.A, plant.B, Time(problem.number("T"))));
  }
  const auto given = [&](std::string_view name) {
    return problem.has(name) ? VectorXd(problem.matrix(name)) : VectorXd();
  };
  MpcSettings settings{.horizon = problem.integer("horizon"),
                       .u_min = given("u_min"),
                       .u_max = given("u_max"),
                       .du_min = given("du_min"),
                       .du_max = given("du_max"),
                       .x_min = given("x_min"),
                       .x_max = given("x_max"),
                       .sigma = given("sigma"),
                       .rho = given("rho")};
  if (problem.has("Q_end")) {
    settings.Q_end = problem.matrix("Q_end");
  }
  FLYBALL_TRY(auto mpc, LinearMpc<>::create(plant.A, plant.B, problem.matrix("Q"),
                                            problem.matrix("R"), settings));
  const auto or_zeros = [&](std::string_view name, Eigen::Index size) {
    return problem.has(name) ? VectorXd(problem.matrix(name)) : VectorXd(VectorXd::Zero(size));
  };
  const Eigen::Index n = plant.A.rows();
  const Eigen::Index m = plant.B.cols();
  mpc.set_reference(or_zeros("r", n), or_zeros("u_r", m));
  mpc.set_disturbance(or_zeros("d", n));
  if (problem.has("u_last")) {
    mpc.set_last_input(given("u_last"));
  }
  const VectorXd u = mpc.calculate(VectorXd(problem.matrix("x")));
  if (mpc.status() == MpcStatus::held) {
    return refusal(ArgumentError::out_of_range, "mpc", "the program")
        .got("of numbers beyond what a controller takes for signals")
        .expected("states and references within 1e100");
  }
  MatrixXd states(n, mpc.horizon() + 1);
  MatrixXd inputs(m, mpc.horizon());
  for (int k = 0; k <= mpc.horizon(); ++k) {
    states.col(k) = mpc.predicted_state(k);
    if (k < mpc.horizon()) {
      inputs.col(k) = mpc.predicted_input(k);
    }
  }
  answer.add("u", u);
  answer.add("states", states);
  answer.add("inputs", inputs);
  answer.add("cost", mpc.cost());
  answer.add("status", name_of(mpc.status()));
  answer.add("violation", mpc.violation());
  answer.add("iterations", mpc.iterations());
  return {};
}

}  // namespace

std::vector<Kind> predictive_control_kinds() {
  using namespace field;
  const auto of_inputs = [](std::string_view name, std::string_view help) {
    return optional(list(name, "m", "", help));
  };
  const auto of_states = [](std::string_view name, std::string_view help) {
    return optional(list(name, "n", "", help));
  };
  return {
      {"mpc",
       "the inputs over a horizon with the least cost that keep limits; the first is to be applied",
       {A,
        B,
        Q,
        R,
        list("x", "n", "", "the state now"),
        or_number(integer("horizon", "periods that are looked ahead"), 20.0),
        optional(number("T", "s", "period with which a continuous plant is sampled first")),
        of_states("r", "where the states are to be; left out, 0"),
        of_inputs("u_r", "the inputs that hold them there; left out, 0"),
        of_states("d", "what disturbs, x⁺ = Ax + Bu + d; left out, 0"),
        of_inputs("u_last", "the input of the period before, from which rates count"),
        of_inputs("u_min", "limits of the inputs"),
        of_inputs("u_max", "limits of the inputs"),
        of_inputs("du_min", "of their change in a period, at most 0"),
        of_inputs("du_max", "of their change in a period, at least 0"),
        of_states("x_min", "limits of the states"),
        of_states("x_max", "limits of the states"),
        of_states("sigma", "cost of violating a state's limit by ε: σ ε + ½ ρ ε²"),
        of_states("rho", "see sigma; both left out, limits hold where they can"),
        optional(matrix("Q_end", "n", "n", "weight of the last state; left out, the regulator's",
                        "1/state²"))},
       {list("u", "m", "", "the first inputs"),
        matrix("states", "n", "k", "now and after each period"),
        matrix("inputs", "m", "h", "of each period"),
        number("cost", "", "½ Σ (x - r)ᵀQ(x - r) + (u - u_r)ᵀR(u - u_r), violations included"),
        text("status", "optimal, softened or capped"),
        number("violation", "", "of a state's limit, at most"),
        integer("iterations", "sets of active limits and interior-point steps")},
       R"({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "Q": [[100, 0], [0, 1]], "R": [[0.01]], "T": 0.02, "horizon": 10, "x": [1, 0], "u_min": [-12], "u_max": [12]})",
       &solve_mpc}};
}

}  // namespace flyball::solve
