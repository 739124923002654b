#include <optional>
#include <utility>

#include <flyball/systems/response.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// What systems do.
namespace flyball::solve {

namespace {

/// How many numbers x and y have.
double numbers_of(const ContinuousSystem<>& plant, double samples) {
  return samples * static_cast<double>(plant.A.rows() + plant.C.rows());
}

/// x and y at the samples of u, exactly, the input held between them.
Outcome solve_simulate(const Problem& problem, JsonWriter& answer) {
  const ContinuousSystem<> plant = problem.system();
  const Eigen::MatrixXd& u = problem.matrix("u");
  const Eigen::MatrixXd& x0 = problem.matrix("x0");
  const bool discrete = problem.domain() == TimeDomain::discrete;
  if (!discrete && !problem.has("T")) {
    return refusal(ArgumentError::malformed, "simulate", "T")
        .got("left out")
        .expected("the time between the rows of u in seconds");
  }
  const Time period(problem.has("T") ? problem.number("T") : 1.0);
  FLYBALL_CHECK(check_size(numbers_of(plant, static_cast<double>(u.rows())), "simulate", "u"));
  FLYBALL_TRY(const auto response,
              discrete ? forced_response({plant.A, plant.B, plant.C, plant.D, period}, u, x0)
                       : forced_response(plant, u, x0, period));
  answer.add("x", response.x);
  answer.add("y", response.y);
  return {};
}

/// The instants that a problem names, or those that the poles ask for.
Expected<std::optional<ResponseTimes>> times_of(const Problem& problem, std::string_view where) {
  const bool discrete = problem.domain() == TimeDomain::discrete;
  if (!problem.has("samples") && (discrete || !problem.has("T"))) {
    return std::optional<ResponseTimes>();
  }
  if (problem.has("samples")) {
    FLYBALL_CHECK(
        check_size(numbers_of(problem.system(), problem.number("samples")), where, "samples"));
  }
  for (const char* name : {"samples", "T"}) {
    if (!problem.has(name) && !discrete) {
      return refusal(ArgumentError::malformed, where, name)
          .got("left out")
          .expected("there: of a continuous system both samples and T are said, or neither");
    }
  }
  return std::optional<ResponseTimes>({Time(problem.number("T")), problem.integer("samples")});
}

Outcome write_response(const Expected<LinearResponse>& answered, JsonWriter& answer) {
  return answered.map([&](const LinearResponse& response) {
    answer.add("time", response.time);
    answer.add("y", response.y);
  });
}

Outcome solve_step(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto times, times_of(problem, "step-response"));
  return with_system(problem, [&](const auto& plant) {
    return write_response(step_response(plant, problem.integer("input"), times), answer);
  });
}

Outcome solve_impulse(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto times, times_of(problem, "impulse-response"));
  return with_system(problem, [&](const auto& plant) {
    return write_response(impulse_response(plant, problem.integer("input"), times), answer);
  });
}

Outcome solve_initial(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto times, times_of(problem, "initial-response"));
  return with_system(problem, [&](const auto& plant) {
    return write_response(initial_response(plant, problem.matrix("x0"), times), answer);
  });
}

}  // namespace

std::vector<Kind> response_kinds() {
  using namespace field;
  const std::vector<Field> any_system{A, B, C, D, or_first(domain)};
  const std::vector<Field> times{
      or_number(number("T", "s",
                       "time between the samples; a continuous system's is chosen from "
                       "its poles if neither it nor samples is said"),
                1.0),
      optional(integer("samples", "how many, chosen from the poles if left out"))};
  const Field input = or_number(integer("input", "which of the inputs moves, from 0"), 0.0);
  const std::vector<Field> response{list("time", "k", "s", "of the samples"),
                                    matrix("y", "k", "p", "the outputs")};
  return {
      {"simulate",
       "what a system does, its input held between samples",
       {A, B, C, D, samples("u", "k", "m", "the inputs, a row a sample"), domain,
        optional(number("T", "s", "time between the rows of u; a continuous system needs it")),
        or_zero(samples("x0", "n", "1", "the state at the first sample"))},
       {matrix("x", "k+1", "n", "the state at each sample and after the last"),
        matrix("y", "k", "p", "the outputs at the samples")},
       R"({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "domain": "continuous", "T": 0.1, "u": [1, 1, 0]})",
       &solve_simulate},
      {"step-response", "the outputs after one input has gone from 0 to 1, from rest",
       any_system + std::vector{input} + times, response,
       R"({"A": [[0, 1], [-4, -2]], "B": [[0], [4]], "C": [[1, 0]], "T": 0.5, "samples": 5})",
       &solve_step},
      {"impulse-response",
       "the outputs after an impulse of one input, from rest, without that of D itself",
       any_system + std::vector{input} + times, response,
       R"({"A": [[0, 1], [-4, -2]], "B": [[0], [4]], "C": [[1, 0]], "T": 0.5, "samples": 5})",
       &solve_impulse},
      {"initial-response", "the outputs of a system that is left to itself",
       any_system + std::vector{samples("x0", "n", "1", "the state at the first sample")} + times,
       response,
       R"({"A": [[0, 1], [-4, -2]], "B": [[0], [4]], "C": [[1, 0]], "x0": [1, 0], "T": 0.5, "samples": 5})",
       &solve_initial},
  };
}

}  // namespace flyball::solve
