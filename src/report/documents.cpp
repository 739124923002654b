#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <flyball/export/constants.hpp>
#include <flyball/study/design_exports.hpp>

#include "report/format.hpp"
#include "report/sections.hpp"

namespace flyball::report {

namespace {

constexpr double poor_fit = 0.9;            ///< R² below which the overlay deserves a look.
constexpr double thin_gain_margin = 1.7;    ///< Below the classical rules of thumb 2 and 30°.
constexpr double thin_phase_margin = 30.0;  ///< deg
constexpr double large_overshoot = 0.25;

/// The sentences of warnings and errors, so that nobody has to look for them.
std::size_t warnings_in(const std::vector<Diagnostic>& diagnostics) {
  return static_cast<std::size_t>(
      std::count_if(diagnostics.begin(), diagnostics.end(),
                    [](const Diagnostic& d) { return d.severity != Severity::info; }));
}

Tone worse(Tone a, Tone b) {
  const auto rank = [](Tone tone) { return tone == Tone::bad ? 2 : tone == Tone::caution ? 1 : 0; };
  return rank(a) >= rank(b) ? a : b;
}

void caution(Verdict& verdict, std::string reason) {
  verdict.tone = worse(verdict.tone, Tone::caution);
  verdict.reasons.push_back(std::move(reason));
}

/// kA's reason, if the log does not determine it.
std::string kA_reason(const study::IdentifyResult& result) {
  return result.report.fit && !result.report.fit->kA.determined ? result.report.fit->kA.reason : "";
}

void add_design_sections(Document& document, const study::DesignResult& result,
                         const std::string& reason) {
  document.sections.push_back(plant_section(result));
  document.sections.push_back(controller_section(result));
  document.sections.push_back(robustness_section(result));
  document.sections.push_back(motion_section(result));
  document.sections.push_back(constants_section(result, reason));
}

}  // namespace

std::string title_of(const std::string& kind, const std::string& subject, const std::string& path) {
  std::string title = capitalized(kind);
  if (!subject.empty()) {
    title += fmt::format(" “{}”", subject);
  }
  const std::size_t slash = path.find_last_of('/');
  const std::string file = slash == std::string::npos ? path : path.substr(slash + 1);
  return file.empty() ? title : title + " from " + file;
}

Section constants_section(const study::DesignResult& result, const std::string& reason) {
  Section section{"constants", "Constants to paste", {}};
  for (const auto& paste : exports::paste_constants(study::constants_of(result, reason))) {
    section.blocks.emplace_back(Code{paste.title, paste.text, paste.file});
  }
  return section;
}

Section diagnostics_section(std::vector<Diagnostic> diagnostics) {
  std::stable_sort(
      diagnostics.begin(), diagnostics.end(),
      [](const Diagnostic& a, const Diagnostic& b) { return a.severity > b.severity; });
  Findings findings;
  for (Diagnostic& diagnostic : diagnostics) {
    const bool known = std::any_of(
        findings.diagnostics.begin(), findings.diagnostics.end(), [&](const Diagnostic& other) {
          return other.code == diagnostic.code && other.message == diagnostic.message;
        });
    if (!known) {
      findings.diagnostics.push_back(std::move(diagnostic));
    }
  }
  Section section{"diagnostics", "What was noticed", {}};
  if (findings.diagnostics.empty()) {
    section.blocks.emplace_back(Paragraph{"Nothing out of the ordinary.", Tone::good});
  } else {
    section.blocks.emplace_back(std::move(findings));
  }
  return section;
}

Verdict verdict_of(const study::IdentifyResult& result) {
  if (!result.report.fit) {
    return {
        Tone::bad, "No gains can be taken from this log.", {to_string(result.report.fit.error())}};
  }
  const identification::FeedforwardFit& fit = *result.report.fit;
  Verdict verdict;
  const auto undetermined = [&](const char* name, const identification::GainEstimate& gain) {
    if (!gain.determined) {
      caution(verdict, fmt::format("the log does not determine {}", name));
    }
  };
  undetermined("kS", fit.kS);
  undetermined("kV", fit.kV);
  undetermined("kA; the design does without it", fit.kA);
  if (fit.kG) {
    undetermined("kG", *fit.kG);
  }
  if (fit.r_squared < poor_fit) {
    caution(verdict, fmt::format("the simulated velocity explains only {} of the measured one: "
                                 "compare them before you trust the gains",
                                 percent(std::max(0.0, fit.r_squared))));
  }
  if (const std::size_t warnings = warnings_in(result.diagnostics()); warnings > 0) {
    caution(verdict, fmt::format("{} about the data, listed below", count(warnings, "warning")));
  }
  verdict.line = verdict.tone == Tone::good
                     ? fmt::format(
                           "The gains can be used: the model explains {} of the measured "
                           "velocity.",
                           percent(fit.r_squared))
                     : "The gains can be used with care.";
  return verdict;
}

Verdict verdict_of(const study::DesignResult& result) {
  Verdict verdict;
  const study::LoopMargins& margins = result.margins;
  if (!result.robust) {
    verdict.tone = Tone::bad;
    verdict.reasons.emplace_back(
        "a mechanism that differs by 20 % from its model makes the loop unstable");
  }
  if (margins.gain_margin < thin_gain_margin) {
    caution(verdict, fmt::format("the gain margin is only {} ×", number(margins.gain_margin, 3)));
  }
  const double phase = margins.phase_margin * 180.0 / std::numbers::pi;
  if (phase < thin_phase_margin) {
    caution(verdict, fmt::format("the phase margin is only {}°", number(phase, 3)));
  }
  if (result.robust && result.worst_overshoot > large_overshoot) {
    caution(verdict, fmt::format("a small step overshoots by up to {} in the grid of errors",
                                 percent(result.worst_overshoot, 2)));
  }
  if (const std::size_t warnings = warnings_in(result.diagnostics); warnings > 0) {
    caution(verdict, fmt::format("{} of the design, listed below", count(warnings, "warning")));
  }
  verdict.line = verdict.tone == Tone::good ? "The loop is stable and robust."
                 : verdict.tone == Tone::bad
                     ? "Do not run this controller as it is."
                     : "The loop is stable; mind what follows before you run it.";
  return verdict;
}

Verdict verdict_of(const study::TuneResult& result) {
  const Verdict fit = verdict_of(result.identification);
  if (!result.design) {
    return fit;
  }
  Verdict verdict;
  if (!*result.design) {
    verdict.tone = Tone::bad;
    verdict.line = fit.line + " No controller can be designed from them.";
    verdict.reasons.push_back(to_string(result.design->error()));
  } else {
    const Verdict design = verdict_of(**result.design);
    verdict.tone = worse(fit.tone, design.tone);
    verdict.line = fit.line + " " + design.line;
    verdict.reasons = design.reasons;
  }
  verdict.reasons.insert(verdict.reasons.begin(), fit.reasons.begin(), fit.reasons.end());
  return verdict;
}

Document document_of(const study::IdentifyResult& result) {
  Document document;
  document.title = title_of(kind_of(result), result.source.subject, result.source.path);
  document.verdict = verdict_of(result);
  document.sections = {data_section(result), gains_section(result),
                       diagnostics_section(result.diagnostics())};
  return document;
}

Document document_of(const study::DesignResult& result) {
  Document document;
  document.title = capitalized(result.job.plant.kind) + " controller";
  document.verdict = verdict_of(result);
  add_design_sections(document, result, "");
  document.sections.push_back(diagnostics_section(result.diagnostics));
  return document;
}

Document document_of(const study::TuneResult& result) {
  const study::IdentifyResult& identification = result.identification;
  Document document = document_of(identification);
  document.verdict = verdict_of(result);
  std::vector<Diagnostic> diagnostics = identification.diagnostics();
  document.sections.pop_back();
  if (result.design && *result.design) {
    const study::DesignResult& design = **result.design;
    add_design_sections(document, design, kA_reason(identification));
    diagnostics.insert(diagnostics.end(), design.diagnostics.begin(), design.diagnostics.end());
  } else if (result.design) {
    document.sections.push_back(
        {"controller",
         "Controller",
         {Paragraph{"No controller: " + to_string(result.design->error()) + ".", Tone::bad}}});
  }
  document.sections.push_back(diagnostics_section(std::move(diagnostics)));
  return document;
}

}  // namespace flyball::report
