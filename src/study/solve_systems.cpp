#include <algorithm>
#include <utility>

#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/gramian.hpp>

#include "study/analysis_json.hpp"
#include "study/linear_response.hpp"
#include "study/solve_kernels.hpp"

// Systems: conversions, what they are like, what they do.
namespace flyball::study {

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
    auto method = parse_conversion_method(name);
    if (!method) {
      return tl::unexpected(method.error());
    }
    conversion.method = *method;
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
  const auto conversion = read_conversion(problem);
  if (!conversion) {
    return tl::unexpected(conversion.error());
  }
  const auto discrete =
      convert_to_discrete(system, period, conversion->method, conversion->prewarp);
  if (!discrete) {
    return tl::unexpected(discrete.error());
  }
  write_system(*discrete, answer);
  if (problem.has("Q")) {
    const MatrixXd Q = problem.matrix("Q");
    if (!problem.status()) {
      return problem.status();
    }
    const auto noise = discretize(system.A, ProcessDensity{Q}, period);
    if (!noise) {
      return tl::unexpected(noise.error());
    }
    answer.add("Q", *noise);
  }
  if (problem.has("R")) {
    const MatrixXd R = problem.matrix("R");
    if (!problem.status()) {
      return problem.status();
    }
    const auto noise = discretize(MeasurementDensity{R}, period);
    if (!noise) {
      return tl::unexpected(noise.error());
    }
    answer.add("R", *noise);
  }
  return {};
}

Outcome solve_d2c(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> matrices = problem.system();
  const Time period(problem.number("T"));
  const auto conversion = read_conversion(problem);
  if (!conversion) {
    return tl::unexpected(conversion.error());
  }
  const auto continuous =
      convert_to_continuous({matrices.A, matrices.B, matrices.C, matrices.D, period},
                            conversion->method, conversion->prewarp);
  if (!continuous) {
    return tl::unexpected(continuous.error());
  }
  write_system(*continuous, answer);
  return {};
}

Outcome solve_gramians(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = problem.system();
  const TimeDomain domain = problem.domain();
  if (!problem.status()) {
    return problem.status();
  }
  const auto controllability = controllability_gramian(system.A, system.B, domain);
  if (!controllability) {
    return tl::unexpected(controllability.error());
  }
  const auto observability = observability_gramian(system.A, system.C, domain);
  if (!observability) {
    return tl::unexpected(observability.error());
  }
  answer.add("Wc", controllability->W);
  answer.add("Wo", observability->W);
  answer.add("stable", controllability->is_energy);
  if (controllability->is_energy) {
    const auto hankel = domain == TimeDomain::continuous
                            ? hankel_singular_values(system)
                            : hankel_singular_values(DiscreteSystem<>{system.A, system.B, system.C,
                                                                      system.D, Time(1.0)});
    if (hankel) {
      answer.add_list("hankel_singular_values", *hankel);
    }
  }
  answer.add("residual", std::max(controllability->residual, observability->residual));
  answer.add("condition", std::max(controllability->condition, observability->condition));
  return {};
}

Outcome solve_analyze(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = problem.system();
  const TimeDomain domain = problem.domain();
  const Time period(problem.has("T") ? problem.number("T") : 1.0);
  if (!problem.status()) {
    return problem.status();
  }
  const auto structure = analyze_structure(system, domain, period);
  if (!structure) {
    return tl::unexpected(structure.error());
  }
  write_structure(*structure, {}, answer);
  return {};
}

/// x and y at the samples of u, exactly, the input held between them.
Outcome solve_simulate(ProblemReader& problem, AnswerWriter& answer) {
  constexpr std::string_view where = "simulate";
  const ContinuousSystem<> system = problem.system();
  const TimeDomain domain = problem.domain();
  const MatrixXd u = problem.columns("u");
  const Eigen::Index n = system.A.rows();
  const MatrixXd x0 = problem.has("x0") ? problem.columns("x0") : MatrixXd(MatrixXd::Zero(n, 1));
  const double period = problem.has("T") ? problem.number("T") : 1.0;
  if (!problem.status()) {
    return problem.status();
  }
  if (auto checked = check_system(system, where); !checked) {
    return checked;
  }
  if (auto checked =
          check_all(check_shape(u, u.rows(), system.B.cols(), where, "u", "samples x inputs"),
                    check_shape(x0, n, 1, where, "x0", "states x 1"), check_finite(u, where, "u"),
                    check_finite(x0, where, "x0"));
      !checked) {
    return checked;
  }
  DiscretizedMatrices model{system.A, system.B};
  if (domain == TimeDomain::continuous) {
    if (!problem.has("T")) {
      return tl::unexpected(Error(ArgumentError::malformed)
                                .in(std::string(where))
                                .about("T")
                                .got("left out")
                                .expected("the time between the rows of u in seconds"));
    }
    auto sampled = discretize_zoh(system.A, system.B, Time(period));
    if (!sampled) {
      return tl::unexpected(sampled.error());
    }
    model = *std::move(sampled);
  }
  const LinearResponse response = linear_response(model, system.C, system.D, u, x0);
  if (auto finite = check_finite(response.x, where, "x"); !finite) {
    return finite;
  }
  answer.add("x", response.x);
  answer.add("y", response.y);
  return {};
}

}  // namespace flyball::study
