#include <flyball/study/schema.hpp>

#include "study/analysis_json.hpp"
#include "study/json.hpp"

namespace flyball::study {

namespace {

void write_reach(const ReachAnalysis& analysis, const std::string& prefix, std::string_view hidden,
                 AnswerWriter& answer) {
  std::vector<std::complex<double>> hidden_modes;
  Eigen::VectorXd distances(static_cast<Eigen::Index>(analysis.modes.size()));
  Eigen::VectorXcd modes(distances.size());
  for (Eigen::Index k = 0; k < distances.size(); ++k) {
    const ModeReach& mode = analysis.modes[static_cast<std::size_t>(k)];
    distances(k) = mode.distance;
    modes(k) = mode.eigenvalue;
    if (!mode.reached) {
      hidden_modes.push_back(mode.eigenvalue);
    }
  }
  answer.add(hidden, Eigen::VectorXcd(Eigen::Map<const Eigen::VectorXcd>(
                         hidden_modes.data(), static_cast<Eigen::Index>(hidden_modes.size()))));
  answer.add(prefix + "_rank", static_cast<double>(analysis.rank));
  answer.add(prefix + "_condition", analysis.matrix_condition);
  answer.add(prefix + "_modes", modes);
  answer.add_list(prefix + "_distances", distances);
}

void write_names(std::string_view field, const std::vector<std::string>& names,
                 AnswerWriter& answer) {
  answer.add_json(field, dump(names));
}

void write_sampled(const SampledAnalysis& sampled, const ModelFile& model, AnswerWriter& answer) {
  AnswerWriter inner;
  inner.begin(nullptr);
  inner.add("T", model.period->si());
  inner.add("A", sampled.system.A);
  inner.add("B", sampled.system.B);
  inner.add("nyquist_frequency", sampled.sampling.nyquist_frequency);
  inner.add("samples_per_radian", sampled.sampling.samples_per_radian);
  inner.add("aliases", sampled.sampling.aliases);
  inner.add("loses_controllability", sampled.sampling.loses_controllability);
  write_structure(sampled, model.states, inner);
  answer.add_json("sampled", inner.end());
}

}  // namespace

void write_structure(const StructureAnalysis& structure, std::span<const std::string> states,
                     AnswerWriter& answer) {
  answer.add("controllable", structure.controllability.controllable);
  answer.add("observable", structure.observability.observable);
  answer.add("stabilizable", structure.controllability.stabilizable);
  answer.add("detectable", structure.observability.detectable);
  answer.add_text("stability", to_string(structure.modes.stability));
  const std::vector<Mode>& modes = structure.modes.modes;
  Eigen::VectorXcd poles(static_cast<Eigen::Index>(modes.size()));
  Eigen::VectorXd damping(poles.size());
  Eigen::VectorXd frequency(poles.size());
  for (Eigen::Index k = 0; k < poles.size(); ++k) {
    const Mode& mode = modes[static_cast<std::size_t>(k)];
    poles(k) = mode.pole;
    damping(k) = mode.damping_ratio;
    frequency(k) = mode.natural_frequency;
  }
  answer.add("poles", poles);
  answer.add_list("damping_ratios", damping);
  answer.add_list("natural_frequencies", frequency);
  write_reach(structure.controllability, "controllability", "uncontrollable_modes", answer);
  write_reach(structure.observability, "observability", "unobservable_modes", answer);
  answer.add_text("words", describe(structure.controllability, states) + "\n" +
                               describe(structure.observability, states));
}

std::string to_json(const ModelAnalysis& analysis) {
  const ModelFile& model = analysis.model;
  AnswerWriter answer;
  answer.begin(nullptr);
  answer.add_text("schema", "flyball.analyze/1");
  answer.add_text("domain", model.domain == TimeDomain::continuous ? "continuous" : "discrete");
  if (model.period) {
    answer.add("T", model.period->si());
  }
  write_names("states", model.states, answer);
  write_names("inputs", model.inputs, answer);
  write_names("outputs", model.outputs, answer);
  answer.add("A", model.system.A);
  answer.add("B", model.system.B);
  answer.add("C", model.system.C);
  answer.add("D", model.system.D);
  write_structure(analysis, model.states, answer);
  if (analysis.dc_gain) {
    answer.add("dc_gain", *analysis.dc_gain);
  }
  if (analysis.h2_norm) {
    answer.add("h2_norm", *analysis.h2_norm);
  }
  if (analysis.h_infinity_norm) {
    answer.add("h_infinity_norm", analysis.h_infinity_norm->norm);
    answer.add("h_infinity_frequency", analysis.h_infinity_norm->frequency);
  }
  if (analysis.sampled) {
    write_sampled(*analysis.sampled, model, answer);
  }
  answer.add_json("diagnostics", dump(json_of(model.notes)));
  return answer.end();
}

}  // namespace flyball::study
