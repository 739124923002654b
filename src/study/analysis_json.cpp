#include <flyball/study/schema.hpp>

#include "io/answer_writer.hpp"
#include "io/json.hpp"
#include "solve/structure_answer.hpp"

namespace flyball::study {

namespace {

using solve::write_structure;

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
