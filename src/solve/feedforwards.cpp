#include <cmath>
#include <utility>
#include <vector>

#include <flyball/control/delay_compensation.hpp>
#include <flyball/control/feedforward.hpp>
#include <flyball/control/latency.hpp>
#include <flyball/control/steady_state_feedforward.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// What is added to a feedback, and what a feedback bears.
namespace flyball::solve {

using Eigen::MatrixXd;

namespace {

Outcome solve_plant_inversion(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& A = problem.matrix("A");
  const MatrixXd& B = problem.matrix("B");
  if (problem.has("Q") || problem.has("R")) {
    const MatrixXd I = MatrixXd::Identity(A.rows(), A.cols());
    const MatrixXd O = MatrixXd::Zero(B.cols(), B.cols());
    FLYBALL_TRY(const MatrixXd K_ff, qr_weighted_gain(B, problem.has("Q") ? problem.matrix("Q") : I,
                                                      problem.has("R") ? problem.matrix("R") : O));
    answer.add("K_ff", K_ff);
    return {};
  }
  const Eigen::Index n = A.rows();
  FLYBALL_TRY(const auto inversion,
              linear_plant_inversion(DiscreteSystem<>{A, B, MatrixXd::Identity(n, n),
                                                      MatrixXd::Zero(n, B.cols()), Time(1.0)}));
  answer.add("K_ff", MatrixXd(inversion.B_pinv()));
  return {};
}

Outcome solve_steady_state(const Problem& problem, JsonWriter& answer) {
  MatrixXd A = problem.matrix("A");
  if (problem.domain() == TimeDomain::discrete) {
    A -= MatrixXd::Identity(A.rows(), A.cols());  // (C.5)
  }
  const MatrixXd& B = problem.matrix("B");
  const MatrixXd& C = problem.matrix("C");
  const MatrixXd& D = problem.matrix("D");
  std::vector<int> inputs;
  if (problem.has("pairs")) {
    for (const double input : problem.matrix("pairs").reshaped()) {
      if (input != std::floor(input) || std::abs(input) > 1e9) {
        return refusal(ArgumentError::malformed, "steady-state-feedforward", "pairs")
            .got(format_number(input))
            .expected("the number of an input, from 0");
      }
      inputs.push_back(static_cast<int>(input));
    }
  }
  FLYBALL_TRY(const auto feedforward, inputs.empty()
                                          ? steady_state_feedforward(A, B, C, D)
                                          : steady_state_feedforward_of_pairs(A, B, C, D, inputs));
  answer.add("N_x", feedforward.N_x);
  answer.add("N_u", feedforward.N_u);
  answer.add("K_ff", feedforward.K_ff);
  return {};
}

Outcome solve_delay_compensation(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& K = problem.matrix("K");
  const MatrixXd& A = problem.matrix("A");
  const MatrixXd& B = problem.matrix("B");
  const Time latency(problem.number("delay"));
  if (problem.domain() == TimeDomain::continuous) {
    // At t = L and from then on (B.9).
    FLYBALL_TRY(const MatrixXd gain, continuous_latency_gain(K, A, B, latency, latency));
    answer.add("K", gain);
    return {};
  }
  FLYBALL_TRY(const auto gains, latency_gains(K, A, B, Time(problem.number("T")), latency));
  answer.add("K", gains.back());
  answer.add("start", gains);
  return {};
}

}  // namespace

std::vector<Kind> feedforward_kinds() {
  using namespace field;
  const Field K = matrix("K", "m", "n", "gain of u = K(r - x)", "input/state");
  return {
      {"plant-inversion",
       "the feedforward u = K_ff(r⁺ - Ar) that takes a discrete plant from reference to reference "
       "(7.8, C.1)",
       {A, B, optional(matrix("Q", "n", "n", "weight of the deviation, the identity if left out")),
        optional(matrix("R", "m", "m", "weight of the effort, zero if left out"))},
       {matrix("K_ff", "m", "n", "(BᵀQB + R)⁻¹BᵀQ; B⁺ without weights")},
       R"({"A": [[1, 0.02], [0, 0.9]], "B": [[0.0006], [0.059]]})",
       &solve_plant_inversion},
      {"steady-state-feedforward",
       "what holds a plant at a reference: x = N_x y, u = N_u y, u = K_ff r (C.2)",
       {A, B, C, D, or_first(domain),
        optional(list("pairs", "p", "", "for each output the input that drives it, from 0"))},
       {matrix("N_x", "n", "p", "outputs to states"), matrix("N_u", "m", "p", "outputs to inputs"),
        matrix("K_ff", "m", "n", "the states' reference to inputs")},
       R"({"A": [[-2]], "B": [[3]], "C": [[1]]})",
       &solve_steady_state},
      {"delay-compensation",
       "the gain for a state that is old, K(A - BK)^(delay/T) or Ke^((A - BK)delay) (B.4)",
       {K, A, B, number("delay", "s", "how old the state is, whole periods or not"),
        or_first(domain), any_period},
       {matrix("K", "m", "n", "the gain once the delay has passed"),
        optional(matrices("start", "m", "n",
                          "of a discrete plant the gains from the first step on, while no input "
                          "has arrived yet; the last is K"))},
       R"({"K": [[20, 3]], "A": [[1, 0.02], [0, 0.9]], "B": [[0.0006], [0.059]], "delay": 0.03, "domain": "discrete", "T": 0.02})",
       &solve_delay_compensation},
  };
}

}  // namespace flyball::solve
