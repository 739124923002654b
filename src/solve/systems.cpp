#include <algorithm>
#include <utility>

#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/gramian.hpp>
#include <flyball/systems/response.hpp>

#include "core/try.hpp"
#include "solve/kernels.hpp"
#include "solve/structure_answer.hpp"

// Systems: conversions, what they are like, what they do.
namespace flyball::solve {

using Eigen::MatrixXd;

namespace {

struct Conversion {
  ConversionMethod method = ConversionMethod::zoh;
  AngularVelocity prewarp{0.0};
};

Expected<Conversion> read_conversion(ProblemReader& problem) {
  Conversion conversion;
  if (problem.has("prewarp")) {
    conversion.prewarp = AngularVelocity(problem.number("prewarp"));
  }
  if (problem.has("method")) {
    const std::string name = problem.text("method");
    if (!problem.status()) {
      return tl::unexpected(problem.status().error());
    }
    FLYBALL_TRY(auto method, parse_conversion_method(name));
    conversion.method = method;
  }
  if (!problem.status()) {
    return tl::unexpected(problem.status().error());
  }
  return conversion;
}

template <class System>
void write_system(const System& system, AnswerWriter& answer) {
  answer.add("A", system.A);
  answer.add("B", system.B);
  answer.add("C", system.C);
  answer.add("D", system.D);
}

}  // namespace

Outcome solve_c2d(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = problem.system();
  const Time period(problem.number("T"));
  FLYBALL_TRY(const auto conversion, read_conversion(problem));
  FLYBALL_TRY(const auto discrete,
              convert_to_discrete(system, period, conversion.method, conversion.prewarp));
  write_system(discrete, answer);
  if (problem.has("Q")) {
    const MatrixXd Q = problem.matrix("Q");
    if (!problem.status()) {
      return problem.status();
    }
    FLYBALL_TRY(const auto noise, discretize(system.A, ProcessDensity{Q}, period));
    answer.add("Q", noise);
  }
  if (problem.has("R")) {
    const MatrixXd R = problem.matrix("R");
    if (!problem.status()) {
      return problem.status();
    }
    FLYBALL_TRY(const auto noise, discretize(MeasurementDensity{R}, period));
    answer.add("R", noise);
  }
  return {};
}

Outcome solve_d2c(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> matrices = problem.system();
  const Time period(problem.number("T"));
  FLYBALL_TRY(const auto conversion, read_conversion(problem));
  FLYBALL_TRY(const auto continuous,
              convert_to_continuous({matrices.A, matrices.B, matrices.C, matrices.D, period},
                                    conversion.method, conversion.prewarp));
  write_system(continuous, answer);
  return {};
}

Outcome solve_gramians(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = problem.system();
  const TimeDomain domain = problem.domain();
  if (!problem.status()) {
    return problem.status();
  }
  FLYBALL_TRY(const auto controllability, controllability_gramian(system.A, system.B, domain));
  FLYBALL_TRY(const auto observability, observability_gramian(system.A, system.C, domain));
  answer.add("Wc", controllability.W);
  answer.add("Wo", observability.W);
  answer.add("stable", controllability.is_energy);
  if (controllability.is_energy) {
    const auto hankel = domain == TimeDomain::continuous
                            ? hankel_singular_values(system)
                            : hankel_singular_values(DiscreteSystem<>{system.A, system.B, system.C,
                                                                      system.D, Time(1.0)});
    if (hankel) {
      answer.add_list("hankel_singular_values", *hankel);
    }
  }
  answer.add("residual", std::max(controllability.residual, observability.residual));
  answer.add("condition", std::max(controllability.condition, observability.condition));
  return {};
}

Outcome solve_analyze(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = problem.system();
  const TimeDomain domain = problem.domain();
  const Time period(problem.has("T") ? problem.number("T") : 1.0);
  if (!problem.status()) {
    return problem.status();
  }
  FLYBALL_TRY(const auto structure, analyze_structure(system, domain, period));
  write_structure(structure, {}, answer);
  return {};
}

/// x and y at the samples of u, exactly, the input held between them.
Outcome solve_simulate(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = problem.system();
  const TimeDomain domain = problem.domain();
  const MatrixXd u = problem.columns("u");
  const Eigen::Index n = system.A.rows();
  const MatrixXd x0 = problem.has("x0") ? problem.columns("x0") : MatrixXd(MatrixXd::Zero(n, 1));
  const Time period(problem.has("T") ? problem.number("T") : 1.0);
  if (!problem.status()) {
    return problem.status();
  }
  if (domain == TimeDomain::continuous && !problem.has("T")) {
    return tl::unexpected(Error(ArgumentError::malformed)
                              .in("simulate")
                              .about("T")
                              .got("left out")
                              .expected("the time between the rows of u in seconds"));
  }
  const auto answered =
      domain == TimeDomain::continuous
          ? forced_response(system, u, x0, period)
          : forced_response({system.A, system.B, system.C, system.D, period}, u, x0);
  FLYBALL_TRY(const auto response, answered);
  answer.add("x", response.x);
  answer.add("y", response.y);
  return {};
}

}  // namespace flyball::solve
