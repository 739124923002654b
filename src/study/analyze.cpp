#include <flyball/study/analyze.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/systems/discretize.hpp>
#include <flyball/systems/interconnection.hpp>

#include "study/problem_json.hpp"

namespace flyball::study {

namespace {

using Eigen::MatrixXd;
using Json = nlohmann::json;

constexpr std::string_view fields[] = {"A", "B", "C", "D", "domain", "T", "states"};

/// Until the slowest mode has settled, and fine enough for the fastest; a growing mode is shown for
/// a few of its time constants.
struct Horizon {
  double end = 1.0;
  double step = 0.01;
};

Horizon horizon_of(const ModalAnalysis& analysis) {
  double slowest = 0.0;
  double fastest = 0.0;
  double growth = std::numeric_limits<double>::infinity();  // s, of the mode that grows fastest
  for (const Mode& mode : analysis.modes) {
    const double tau = std::abs(mode.time_constant);
    if (std::isfinite(tau) && tau > 0.0) {
      slowest = std::max(slowest, tau);
      growth = mode.stability == Stability::unstable ? std::min(growth, tau) : growth;
    }
    if (std::isfinite(mode.natural_frequency)) {
      fastest = std::max(fastest, mode.natural_frequency);
    }
  }
  Horizon horizon;
  if (slowest > 0.0) {
    horizon.end = 6.0 * slowest;
  } else if (fastest > 0.0) {
    horizon.end = 40.0 / fastest;  // about six turns of an undamped oscillation
  }
  horizon.end = std::min(horizon.end, 5.0 * growth);
  horizon.step = horizon.end / 600.0;
  return horizon;
}

Expected<std::vector<StepResponse>> step_responses(const ModelFile& model,
                                                   const ModalAnalysis& modes) {
  const Horizon horizon = horizon_of(modes);
  DiscretizedMatrices sampled{model.system.A, model.system.B};
  double step = model.period.si();
  if (model.domain == TimeDomain::continuous) {
    step = horizon.step;
    auto discrete = discretize_zoh(model.system.A, model.system.B, Time(step));
    if (!discrete) {
      return tl::unexpected(discrete.error());
    }
    sampled = *std::move(discrete);
  }
  const auto samples =
      static_cast<Eigen::Index>(std::clamp(std::ceil(horizon.end / step), 10.0, 2000.0) + 1.0);
  std::vector<StepResponse> responses;
  for (Eigen::Index input = 0; input < model.system.B.cols(); ++input) {
    StepResponse response;
    response.time =
        Eigen::VectorXd::LinSpaced(samples, 0.0, step * static_cast<double>(samples - 1));
    response.y.resize(samples, model.system.C.rows());
    Eigen::VectorXd x = Eigen::VectorXd::Zero(model.system.A.rows());
    for (Eigen::Index k = 0; k < samples; ++k) {
      response.y.row(k) = (model.system.C * x + model.system.D.col(input)).transpose();
      x = (sampled.A * x + sampled.B.col(input)).eval();
    }
    responses.push_back(std::move(response));
  }
  return responses;
}

}  // namespace

Expected<ModelFile> parse_model(std::string_view text, const std::string& name) {
  const auto malformed = [&](std::string got, std::string expected) {
    return tl::unexpected(Error(ArgumentError::malformed)
                              .in("analyze")
                              .about(name)
                              .got(std::move(got))
                              .expected(std::move(expected)));
  };
  const Json object = Json::parse(text, nullptr, false);
  if (object.is_discarded() || !object.is_object()) {
    return malformed("not a JSON object",
                     "a model such as {\"A\": [[0, 1], [0, -2]], \"B\": [[0], [1]]}");
  }
  for (const auto& [key, value] : object.items()) {
    if (std::find(std::begin(fields), std::end(fields), key) == std::end(fields)) {
      return malformed("a field \"" + key.substr(0, 40) + "\"",
                       "the fields A, B, C, D, domain, T and states");
    }
  }
  ProblemReader reader(object, "analyze");
  if (!reader.has("A") || !reader.has("B")) {
    return malformed("without A or B", "a model with both");
  }
  ModelFile model;
  model.system.A = reader.matrix("A");
  model.system.B = reader.matrix("B");
  model.system.C = reader.matrix_or_identity("C", model.system.A.rows());
  model.system.D = reader.matrix_or_zero("D", model.system.C.rows(), model.system.B.cols());
  if (reader.has("domain")) {
    const std::string domain = reader.text("domain");
    if (domain != "continuous" && domain != "discrete") {
      return malformed("the domain \"" + domain.substr(0, 40) + "\"",
                       "\"continuous\" or \"discrete\"");
    }
    model.domain = domain == "discrete" ? TimeDomain::discrete : TimeDomain::continuous;
  }
  if (reader.has("T")) {
    model.period = Time(reader.number("T"));
  } else if (model.domain == TimeDomain::discrete) {
    return malformed("a discrete model without T", "its sample period T in seconds");
  }
  if (reader.has("states")) {
    const Json& names = object.at("states");
    if (!names.is_array() || names.size() != static_cast<std::size_t>(model.system.A.rows()) ||
        !std::all_of(names.begin(), names.end(), [](const Json& n) { return n.is_string(); })) {
      return malformed("states that are not a name for each row of A",
                       "a list such as [\"position\", \"velocity\"]");
    }
    model.states = names.get<std::vector<std::string>>();
  }
  if (!reader.status()) {
    return tl::unexpected(reader.status().error());
  }
  if (auto checked = check_all(check_system(model.system, "analyze"),
                               check_positive(model.period.si(), "analyze", "T", "s"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  return model;
}

Expected<ModelAnalysis> analyze(const ModelFile& model) {
  const ContinuousSystem<>& system = model.system;
  auto modes = analyze_modes(system.A, model.domain, model.period);
  if (!modes) {
    return tl::unexpected(modes.error());
  }
  auto controllability = analyze_controllability(system.A, system.B, model.domain);
  if (!controllability) {
    return tl::unexpected(controllability.error());
  }
  auto observability = analyze_observability(system.A, system.C, model.domain);
  if (!observability) {
    return tl::unexpected(observability.error());
  }
  auto steps = step_responses(model, *modes);
  if (!steps) {
    return tl::unexpected(steps.error());
  }
  ModelAnalysis analysis{model,
                         *std::move(modes),
                         *std::move(controllability),
                         *std::move(observability),
                         std::nullopt,
                         std::nullopt,
                         std::nullopt,
                         *std::move(steps)};
  const DiscreteSystem<> discrete{system.A, system.B, system.C, system.D, model.period};
  const bool continuous = model.domain == TimeDomain::continuous;
  const auto dc = continuous ? transfer_at(system, 0.0) : transfer_at(discrete, 1.0);
  if (dc) {
    analysis.dc_gain = dc->real();
  }
  if (analysis.modes.stability == Stability::stable) {
    const auto h2 = continuous ? h2_norm(system) : h2_norm(discrete);
    if (h2) {
      analysis.h2_norm = *h2;
    }
    const auto peak = continuous ? h_infinity_norm(system) : h_infinity_norm(discrete);
    if (peak) {
      analysis.h_infinity_norm = *peak;
    }
  }
  return analysis;
}

}  // namespace flyball::study
