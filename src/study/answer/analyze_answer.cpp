#include <utility>

#include "solve/structure_answer.hpp"
#include "study/answer/model_parts.hpp"

namespace flyball::study {

namespace {

using solve::write_structure;

void write_sampled(const SampledAnalysis& sampled, const ModelFile& model, JsonWriter& answer) {
  answer.object("sampled", [&] {
    answer.add("T", model.period->si());
    answer.add("A", sampled.system.A);
    answer.add("B", sampled.system.B);
    answer.add("nyquist_frequency", sampled.sampling.nyquist_frequency);
    answer.add("samples_per_radian", sampled.sampling.samples_per_radian);
    answer.add("aliases", sampled.sampling.aliases);
    answer.add("loses_controllability", sampled.sampling.loses_controllability);
    write_structure(sampled, labels(model.states), answer);
  });
}

}  // namespace

std::string to_json(const ModelAnalysis& analysis) {
  const ModelFile& model = analysis.model;
  JsonWriter answer;
  answer.open('{');
  answer.add("schema", "flyball.analyze/2");
  answer.add("domain", model.domain == TimeDomain::continuous ? "continuous" : "discrete");
  if (model.period) {
    answer.add("T", model.period->si());
  }
  answer.add("states", model.states);
  answer.add("inputs", model.inputs);
  answer.add("outputs", model.outputs);
  answer.add("A", model.system.A);
  answer.add("B", model.system.B);
  answer.add("C", model.system.C);
  answer.add("D", model.system.D);
  write_structure(analysis, labels(model.states), answer);
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
  if (model.point) {
    write_point(answer, *model.point);
  }
  answer.add("diagnostics", model.notes);
  answer.close('}');
  return std::move(answer).text();
}

Answer answer_of(const ModelAnalysis& result) {
  return {.schema = "flyball.analyze/2",
          .json = to_json(result),
          .document = document_of(result),
          .figures = figures_of(result),
          .files = data_files(result)};
}

}  // namespace flyball::study
