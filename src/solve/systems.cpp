#include <algorithm>
#include <utility>

#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/gramian.hpp>
#include <flyball/systems/input_delay.hpp>
#include <flyball/systems/norms.hpp>
#include <flyball/systems/sampled_cost.hpp>
#include <flyball/systems/structure.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"
#include "solve/sensitivity.hpp"
#include "solve/structure_answer.hpp"

// Systems: conversions and what they are like.
namespace flyball::solve {

using Eigen::MatrixXd;

namespace {

/// Which method, and the frequency that it keeps.
struct Conversion {
  ConversionMethod method = ConversionMethod::zoh;
  AngularVelocity prewarp{0.0};
};

Expected<Conversion> conversion_of(const Problem& problem) {
  FLYBALL_TRY(const ConversionMethod method, parse_conversion_method(problem.choice("method")));
  return Conversion{method, AngularVelocity(problem.number("prewarp"))};
}

Outcome solve_c2d(const Problem& problem, JsonWriter& answer) {
  const ContinuousSystem<> plant = problem.system();
  const Time period(problem.number("T"));
  FLYBALL_TRY(const auto conversion, conversion_of(problem));
  FLYBALL_TRY(const auto discrete,
              convert_to_discrete(plant, period, conversion.method, conversion.prewarp));
  FLYBALL_TRY(double error, error_of([&](int draw) {
                const ContinuousSystem<> other{in_its_last_digits(plant.A, draw),
                                               in_its_last_digits(plant.B, draw), plant.C, plant.D};
                return convert_to_discrete(other, period, conversion.method, conversion.prewarp)
                    .map([&](const auto& moved) {
                      return std::max(relative_difference(discrete.A, moved.A),
                                      relative_difference(discrete.B, moved.B));
                    });
              }));
  if (conversion.method == ConversionMethod::zoh && loses_by_squares(plant.A * period.si())) {
    // Three steps of a third, whose exponential is squared otherwise.
    FLYBALL_TRY(
        const DiscreteSystem<> third,
        convert_to_discrete(plant, Time(period.si() / 3.0), conversion.method, conversion.prewarp));
    const MatrixXd two = third.A * third.B + third.B;
    error = std::max({error, relative_difference(discrete.A, MatrixXd(third.A * third.A * third.A)),
                      relative_difference(discrete.B, MatrixXd(third.A * two + third.B))});
    FLYBALL_CHECK(check_determined(error));
  }
  write_system(discrete, answer);
  answer.add("relative_error", error);
  if (problem.has("Q")) {
    FLYBALL_TRY(const auto noise, discretize(plant.A, ProcessDensity{problem.matrix("Q")}, period));
    answer.add("Q", noise);
  }
  if (problem.has("R")) {
    FLYBALL_TRY(const auto noise, discretize(MeasurementDensity{problem.matrix("R")}, period));
    answer.add("R", noise);
  }
  return {};
}

Outcome solve_d2c(const Problem& problem, JsonWriter& answer) {
  const ContinuousSystem<> given = problem.system();
  FLYBALL_TRY(const auto conversion, conversion_of(problem));
  FLYBALL_TRY(const auto continuous,
              convert_to_continuous({given.A, given.B, given.C, given.D, Time(problem.number("T"))},
                                    conversion.method, conversion.prewarp));
  write_system(continuous, answer);
  return {};
}

Outcome solve_sampled_cost(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto cost,
              sampled_cost(problem.matrix("A"), problem.matrix("B"), problem.matrix("Q"),
                           problem.matrix("R"), problem.matrix("N"), Time(problem.number("T"))));
  answer.add("A", cost.A);
  answer.add("B", cost.B);
  answer.add("Q", cost.Q);
  answer.add("R", cost.R);
  answer.add("N", cost.N);
  return {};
}

Outcome solve_input_delay(const Problem& problem, JsonWriter& answer) {
  const Time period(problem.number("T"));
  const Time delay(problem.number("delay"));
  if (period.si() > 0.0 && delay.si() > 0.0) {
    // Each period of the delay adds states, one an input.
    const double states =
        static_cast<double>(problem.matrix("A").rows()) +
        delay.si() / period.si() * static_cast<double>(problem.matrix("B").cols());
    FLYBALL_CHECK(check_size(states * states, "input-delay", "delay"));
  }
  FLYBALL_TRY(const auto discrete, discretize_with_input_delay(problem.system(), period, delay));
  write_system(discrete, answer);
  return {};
}

Outcome solve_gramians(const Problem& problem, JsonWriter& answer) {
  const ContinuousSystem<> plant{
      problem.matrix("A"), problem.matrix("B"), problem.matrix("C"),
      MatrixXd::Zero(problem.matrix("C").rows(), problem.matrix("B").cols())};
  const TimeDomain domain = problem.domain();
  FLYBALL_TRY(const auto controllability, controllability_gramian(plant.A, plant.B, domain));
  FLYBALL_TRY(const auto observability, observability_gramian(plant.A, plant.C, domain));
  answer.add("Wc", controllability.W);
  answer.add("Wo", observability.W);
  answer.add("stable", controllability.is_energy);
  if (controllability.is_energy) {
    const auto hankel = domain == TimeDomain::continuous
                            ? hankel_singular_values(plant)
                            : hankel_singular_values(
                                  DiscreteSystem<>{plant.A, plant.B, plant.C, plant.D, Time(1.0)});
    if (hankel) {
      answer.add("hankel_singular_values", *hankel);
    }
  }
  answer.add("residual", std::max(controllability.residual, observability.residual));
  answer.add("condition", std::max(controllability.condition, observability.condition));
  return {};
}

Outcome solve_analyze(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto structure,
              analyze_structure(problem.system(), problem.domain(), Time(problem.number("T"))));
  write_structure(structure, {}, answer);
  return {};
}

Outcome solve_h2_norm(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const double norm, h2_norm(plant));
    answer.add("norm", norm);
    return {};
  });
}

Outcome solve_h_infinity_norm(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const HInfinityNorm peak, h_infinity_norm(plant));
    answer.add("norm", peak.norm);
    answer.add("frequency", peak.frequency);
    answer.add("upper_bound", peak.upper_bound);
    return {};
  });
}

}  // namespace

std::vector<Kind> system_kinds() {
  using namespace field;
  const Field sampling = number("T", "s", "sample period");
  const std::vector<Field> conversion{
      A,
      B,
      sampling,
      C,
      D,
      or_first(choice("method", "zoh foh tustin forward-euler backward-euler matched",
                      "what stays exact, or which Table 7.2 names")),
      or_number(number("prewarp", "rad/s", "frequency at which tustin keeps the response"), 0.0)};
  const std::vector<Field> any_system{A, B, C, D, or_first(domain), any_period};
  return {
      {"c2d", "a continuous system as a discrete one",
       conversion +
           std::vector{
               optional(matrix("Q", "n", "n", "density of process noise", "state² s")),
               optional(matrix("R", "p", "p", "density of measurement noise", "output² s"))},
       answered_system("n", "m", "p") +
           std::vector{field::error,
                       optional(matrix("Q", "n", "n", "its covariance a sample (7.8)", "state²")),
                       optional(matrix("R", "p", "p", "its covariance a sample (7.9)", "output²"))},
       R"({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "T": 0.02, "Q": [[0, 0], [0, 1]], "R": [[1, 0], [0, 1]]})",
       &solve_c2d},
      {"d2c", "the continuous system that c2d makes this one of", conversion,
       answered_system("n", "m", "p"),
       R"({"A": [[1, 0.0196], [0, 0.96]], "B": [[0.0006], [0.059]], "T": 0.02, "method": "tustin"})",
       &solve_d2c},
      {"sampled-cost",
       "the discrete cost of one period that is the integral of a continuous one under held inputs",
       {A, B, Q, R, or_zero(N), sampling},
       {matrix("A", "n", "n", "sampled"), matrix("B", "n", "m", "sampled"),
        matrix("Q", "n", "n", "weight of the states at the samples"),
        matrix("R", "m", "m", "weight of the held inputs"),
        matrix("N", "n", "m", "their cross weight, not zero even where N was")},
       R"({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "Q": [[1, 0], [0, 0]], "R": [[0.1]], "T": 0.1})",
       &solve_sampled_cost},
      {"input-delay",
       "a continuous system whose inputs arrive late, sampled, with the inputs on their way as "
       "further states",
       {A, B, sampling, number("delay", "s", "how late, whole periods or not"), C, D},
       answered_system("d", "m", "p"),
       R"({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "T": 0.02, "delay": 0.03})",
       &solve_input_delay},
      {"gramians",
       "AW + WAᵀ + BBᵀ = 0 and AᵀW + WA + CᵀC = 0, or the discrete ones (6.38, 6.42)",
       {A, B, matrix("C", "p", "n", "how the outputs see the states"), domain},
       {matrix("Wc", "n", "n", "controllability Gramian"),
        matrix("Wo", "n", "n", "observability Gramian"),
        flag("stable", "whether they are energies"),
        optional(list("hankel_singular_values", "n", "", "decreasing, of a stable system")),
        residual, condition},
       R"({"A": [[-1, 1], [0, -2]], "B": [[0], [1]], "C": [[1, 0]], "domain": "continuous"})",
       &solve_gramians},
      {"analyze",
       "poles, and what of a system can be moved and seen (6.12)",
       {A, B, domain, C, D, any_period},
       structure_fields(),
       R"({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "C": [[1, 0]], "domain": "continuous"})",
       &solve_analyze},
      {"h2-norm",
       "the deviation of the outputs under white noise of density one on each input",
       any_system,
       {number("norm", "", "√(trace C W_c Cᵀ), and + DDᵀ of a discrete system")},
       R"({"A": [[0, 1], [-4, -2]], "B": [[0], [4]], "C": [[1, 0]]})",
       &solve_h2_norm},
      {"hinf-norm",
       "the largest gain over all frequencies and input directions",
       any_system,
       {number("norm", "", "the largest singular value of G(jω), or of G(e^{jωT})"),
        unbounded(number("frequency", "rad/s", "where it is")),
        number("upper_bound", "", "no gain exceeds it")},
       R"({"A": [[0, 1], [-4, -0.4]], "B": [[0], [4]], "C": [[1, 0]]})",
       &solve_h_infinity_norm},
  };
}

}  // namespace flyball::solve
