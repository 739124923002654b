#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <flyball/export/drive_constants.hpp>

#include "core/wording.hpp"
#include "study/answer/drive_design.hpp"

namespace flyball::study {

namespace {

using identification::DriveFit;
using Design = std::optional<ExpectedAll<DesignResult>>;

struct Mode {
  const char* key;    ///< "linear"
  const char* title;  ///< "Straight on"
  const Design& design;

  [[nodiscard]] const DesignResult* made() const {
    return design && design->has_value() ? &**design : nullptr;
  }
};

/// "straight on" of "Straight on".
std::string lowered(std::string_view title) {
  std::string text(title);
  text.front() = static_cast<char>(text.front() - 'A' + 'a');
  return text;
}

std::array<Mode, 2> modes_of(const DriveDesign& drive) {
  return {Mode{"linear", "Straight on", drive.linear}, Mode{"angular", "Turning", drive.angular}};
}

exports::DriveConstants constants_of(const TuneResult& result) {
  const DriveFit& fit = *result.identification.drive->fit;
  exports::DriveConstants of{.unit = fit.unit, .kP = result.drive->kP};
  const auto known = [](const identification::GainEstimate& gain) {
    return gain.determined ? gain.value : 0.0;
  };
  const auto mode = [&](const std::optional<identification::FeedforwardFit>& from) {
    return from ? std::optional(exports::DriveModeGains{
                      .kS = known(from->kS), .kV = from->kV.value, .kA = known(from->kA)})
                : std::nullopt;
  };
  of.linear = mode(fit.linear);
  of.angular = mode(fit.angular);
  if (fit.trackwidth && fit.trackwidth->determined) {
    of.trackwidth = fit.trackwidth->value;
  }
  for (const Mode& each : modes_of(*result.drive)) {
    of.period = each.made() != nullptr ? each.made()->job.controller.period : of.period;
  }
  return of;
}

/// What both modes' loops make of the two sides.
Section sides_section(const TuneResult& result) {
  const DriveDesign& drive = *result.drive;
  const std::string& unit = result.identification.drive->fit->unit;
  Section section{"sides", "Loops of the sides", {}};
  section.blocks.emplace_back(Paragraph{
      "One gain on the errors of both sides' velocities acts on half their sum and on half "
      "their difference alike. It is the smaller of the two modes' gains: their plants are "
      "stable, and a smaller gain leaves their margins."});
  Facts facts;
  facts.add("kP of a side", quantity(drive.kP, "V·s/" + unit));
  if (drive.K) {
    const Eigen::Matrix2d& K = *drive.K;
    facts.add("K", fmt::format("[{}, {}; {}, {}] V·s/{}, u = K (r − x) of [left, right], each mode "
                               "with its own gain",
                               text::number(K(0, 0), 5), text::number(K(0, 1), 5),
                               text::number(K(1, 0), 5), text::number(K(1, 1), 5), unit));
  }
  section.blocks.emplace_back(std::move(facts));
  return section;
}

}  // namespace

std::optional<Error> refusal_of(const DriveDesign& drive) {
  std::optional<Error> first;
  for (const Mode& mode : modes_of(drive)) {
    if (mode.made() != nullptr) {
      return std::nullopt;
    }
    if (mode.design && !first) {
      first = mode.design->error();
    }
  }
  return first;
}

std::vector<Diagnostic> diagnostics_of(const DriveDesign& drive) {
  std::vector<Diagnostic> all;
  for (const Mode& mode : modes_of(drive)) {
    if (!mode.design) {
      continue;
    }
    for (Diagnostic found :
         *mode.design ? (*mode.design)->diagnostics : mode.design->error().diagnostics()) {
      found.message = fmt::format("{}: {}", mode.title, found.message);
      all.push_back(std::move(found));
    }
  }
  return all;
}

void add_verdict(Verdict& verdict, const DriveDesign& drive) {
  for (const Mode& mode : modes_of(drive)) {
    if (const DesignResult* design = mode.made()) {
      const Verdict more = verdict_of(*design);
      verdict.line += fmt::format(" {}: {}", mode.title, more.line);
      verdict.tone = worse(verdict.tone, more.tone);
      for (const std::string& reason : more.reasons) {
        verdict.reasons.push_back(fmt::format("{}: {}", lowered(mode.title), reason));
      }
    } else if (mode.design) {
      verdict.add(Tone::bad, fmt::format("{}: no controller, {}", lowered(mode.title),
                                         to_string(mode.design->error())));
    }
  }
}

void write_drive_design(JsonWriter& json, const TuneResult& result) {
  for (const Mode& mode : modes_of(*result.drive)) {
    if (const DesignResult* design = mode.made()) {
      json.object(mode.key, [&] { write_design(json, *design); });
    }
  }
  json.add("kP", result.drive->kP);
  if (result.drive->K) {
    json.add("K", Eigen::MatrixXd(*result.drive->K));
  }
}

void add_drive_design(Answer& answer, const TuneResult& result) {
  Document& document = answer.document;
  for (const Mode& mode : modes_of(*result.drive)) {
    const DesignResult* design = mode.made();
    if (design == nullptr) {
      if (mode.design) {
        document.sections.push_back(
            {fmt::format("{}_controller", mode.key),
             fmt::format("{}: controller", mode.title),
             {Paragraph{"No controller: " + to_string(mode.design->error()) + ".", Tone::bad}}});
      }
      continue;
    }
    std::vector<Section> sections = design_sections(*design);
    sections.pop_back();  // the constants are those of both
    for (Section& section : sections) {
      section.id = fmt::format("{}_{}", mode.key, section.id);
      section.title = fmt::format("{}: {}", mode.title, lowered(section.title));
      document.sections.push_back(std::move(section));
    }
    for (Figure& figure : figures_of(*design)) {
      figure.section = fmt::format("{}_{}", mode.key, figure.section);
      figure.name = fmt::format("{}_{}", mode.key, figure.name);
      figure.title = fmt::format("{}: {}", mode.title, figure.title);
      if (!figure.plot.clock.empty()) {
        figure.plot.clock = fmt::format("{}_{}", mode.key, figure.plot.clock);  // not the other's
      }
      answer.figures.push_back(std::move(figure));
    }
    // Only of what moves straight on: a mode of the turning has no wheel.
    if (std::string_view(mode.key) == "linear") {
      for (Animation& animation : animations_of(*design)) {
        animation.section = fmt::format("{}_{}", mode.key, animation.section);
        animation.clock = fmt::format("{}_{}", mode.key, animation.clock);
        answer.animations.push_back(std::move(animation));
      }
    }
    for (AnswerFile& file : data_files(*design)) {
      constexpr std::string_view folder = "data/";
      file.name = fmt::format("{}{}_{}", folder, mode.key, file.name.substr(folder.size()));
      answer.files.push_back(std::move(file));
    }
    document.origins.add(fmt::format("{} seed", mode.key), fmt::to_string(design->job.seed));
  }
  if (refusal_of(*result.drive)) {
    return;
  }
  document.sections.push_back(sides_section(result));
  Section constants{"constants", "Constants to paste", {}};
  for (const exports::PasteText& paste : exports::paste_drive_constants(constants_of(result))) {
    constants.blocks.emplace_back(Code{paste.title, paste.text, paste.file});
    answer.files.push_back({paste.file, paste.text});
  }
  document.sections.push_back(std::move(constants));
}

}  // namespace flyball::study
