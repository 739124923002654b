#include <utility>

#include <fmt/format.h>

#include "study/answer/drive_design.hpp"
#include "study/answer/parts.hpp"
#include "study/per_unit.hpp"

namespace flyball::study {

namespace {

const DesignResult* design_in(const TuneResult& result) {
  return result.design && result.design->has_value() ? &**result.design : nullptr;
}

std::optional<Error> refusal_of(const TuneResult& result) {
  if (result.drive) {
    return refusal_of(*result.drive);
  }
  if (result.identification.drive && !result.identification.drive->fit) {
    return result.identification.drive->fit.error();
  }
  if (!result.identification.report.fit) {
    return result.identification.report.fit.error();
  }
  return result.design && !*result.design ? std::optional(result.design->error()) : std::nullopt;
}

/// Of the log and of the design, made or refused.
std::vector<Diagnostic> diagnostics_of(const TuneResult& result) {
  std::vector<Diagnostic> all = result.identification.diagnostics();
  if (result.design) {
    append(all,
           *result.design ? (*result.design)->diagnostics : result.design->error().diagnostics());
  }
  if (result.drive) {
    append(all, diagnostics_of(*result.drive));
  }
  return all;
}

Verdict verdict_of(const TuneResult& result) {
  Verdict verdict = verdict_of(result.identification);
  if (result.drive) {
    add_verdict(verdict, *result.drive);
  } else if (const DesignResult* design = design_in(result)) {
    const Verdict more = verdict_of(*design);
    verdict.line += " " + more.line;
    verdict.tone = worse(verdict.tone, more.tone);
    append(verdict.reasons, more.reasons);
  } else if (result.design) {
    verdict.line += " No controller can be designed from them.";
    verdict.add(Tone::bad, to_string(result.design->error()));
  }
  return verdict;
}

/// Into the project of a loop that may be in p.u., which a comment leaves as it reads.
void mark_per_unit(Answer& answer) {
  std::string comment = "# " + std::string(per_unit_comment) + "\n";
  for (std::size_t at = comment.find('\n'); at + 1 < comment.size();
       at = comment.find('\n', at + 1)) {
    comment.insert(at + 1, "# ");
  }
  for (auto& file : answer.files) {
    if (file.name == "gains.toml") {
      file.contents.insert(0, comment);
    }
  }
}

}  // namespace

std::string to_json(const TuneResult& result) {
  const DesignResult* design = design_in(result);
  JsonWriter json;
  json.object([&] {
    json.add("schema", "flyball.tune/2");
    if (const auto refusal = refusal_of(result)) {
      json.add("error", *refusal);
    }
    json.key("identification");
    write_identification(json, result.identification);
    if (design != nullptr) {
      json.object("design", [&] { write_design(json, *design); });
    } else if (result.drive && !refusal_of(result)) {
      json.object("drive", [&] { write_drive_design(json, result); });
    } else {
      json.add("diagnostics", diagnostics_of(result));
    }
  });
  return std::move(json).text();
}

Answer answer_of(const TuneResult& result) {
  Answer answer = answer_of(result.identification);
  answer.schema = "flyball.tune/2";
  answer.json = to_json(result);
  answer.refusal = refusal_of(result);
  Document& document = answer.document;
  document.verdict = verdict_of(result);
  document.sections.resize(2);  // of the log; what is to do and was noticed follows from both
  if (result.drive) {
    add_drive_design(answer, result);
  } else if (const DesignResult* design = design_in(result)) {
    append(document.sections, design_sections(*design));
    document.origins.add("seed", fmt::to_string(design->job.seed));
    append(answer.figures, figures_of(*design));
    answer.animations = animations_of(*design);
    const auto& fit = result.identification.report.fit;
    answer.files.clear();
    add_design_files(answer, *design, fit ? &*fit : nullptr);
    if (is_per_unit(result.identification)) {
      mark_per_unit(answer);
    }
    append(answer.files, data_files(result.identification));
  } else if (result.design) {
    document.sections.push_back(
        {"controller",
         "Controller",
         {Paragraph{"No controller: " + to_string(result.design->error()) + ".", Tone::bad}}});
  }
  document.sections.push_back(
      next_steps(result.identification, design_in(result), result.design && !*result.design));
  document.sections.push_back(diagnostics_section(diagnostics_of(result)));
  return answer;
}

}  // namespace flyball::study
