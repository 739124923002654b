#include <flyball/study/identify.hpp>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include <flyball/recording/stream_recording.hpp>
#include <flyball/study/identify_streamed.hpp>

#include "core/try.hpp"
#include "study/identify_with.hpp"

namespace flyball::study {

std::vector<Diagnostic> IdentifyResult::diagnostics() const {
  std::vector<Diagnostic> all = source.diagnostics;
  all.insert(all.end(), report.diagnostics.begin(), report.diagnostics.end());
  return all;
}

namespace {

bool assumes_unit(const recording::LoadedRecording& source) {
  return std::any_of(source.diagnostics.begin(), source.diagnostics.end(),
                     [](const Diagnostic& found) { return found.code == "unit_assumed"; });
}

/// Everything that the person has to say before this log can be answered.
Errors missing_facts(const recording::LoadedRecording& source, const Error& open_kind) {
  std::vector<QuotedError> all{{Error(open_kind).in(source.path), {}, {}}};
  if (assumes_unit(source)) {
    all.push_back({refusal(recording::RecordingError::unit_unknown, source.path, "position unit")
                       .got("not told by the log")
                       .hint("say it with --unit rotations (or rad, deg, m)"),
                   {},
                   {}});
  }
  return Errors(std::move(all)).after(source.diagnostics);
}

bool same_motion(const identification::Recording& a, const identification::Recording& b) {
  return a.unit == b.unit && std::equal(a.runs.begin(), a.runs.end(), b.runs.begin(), b.runs.end(),
                                        [](const auto& first, const auto& second) {
                                          return first.position == second.position &&
                                                 first.velocity == second.velocity;
                                        });
}

}  // namespace

IdentifyResult identify_drivetrain(recording::LoadedRecording source) {
  identification::DriveReport drive = identification::identify_drive(*source.drive);
  // Whoever wants the gains of one mechanism, to design with them, learns that there are none.
  Error none = drive.fit ? Error(refusal(recording::RecordingError::drivetrain, source.path)
                                     .got("a drivetrain's")
                                     .hint("flyball identify gives the gains of its two modes, and "
                                           "flyball tune the loops of its sides"))
                         : drive.fit.error();
  identification::FitReport report{
      .prepared = {}, .diagnostics = drive.diagnostics, .fit = tl::unexpected(std::move(none))};
  std::string unit = source.drive->unit;
  return IdentifyResult{.source = std::move(source),
                        .report = std::move(report),
                        .mechanism = {},
                        .unit = std::move(unit),
                        .drive = std::move(drive)};
}

ExpectedAll<IdentifyResult> identify_with(const recording::LogSelection& selection,
                                          const LoadFunction& load) {
  FLYBALL_TRY(auto source, load(selection));
  if (source.drive) {
    return identify_drivetrain(std::move(source));
  }
  identification::FitReport report = identification::identify_feedforward(source.recording);
  if (!report.fit &&
      report.fit.error().is(identification::IdentificationError::unknown_mechanism)) {
    return tl::unexpected(missing_facts(source, report.fit.error()));
  }
  if (const auto& chosen = report.prepared.mechanism; chosen && !source.recording.mechanism) {
    // Units may have been assumed for any kind: for this one they may be others.
    recording::LogSelection closer = selection;
    closer.mechanism = chosen;
    FLYBALL_TRY(auto again, load(closer));
    if (!same_motion(source.recording, again.recording)) {
      const Diagnostic assumed = report.diagnostics.front();
      report = identification::identify_feedforward(again.recording);
      report.diagnostics.insert(report.diagnostics.begin(), assumed);
    }
    source = std::move(again);
  }
  const auto mechanism = report.prepared.mechanism;
  const std::string unit = source.recording.unit;
  return IdentifyResult{.source = std::move(source),
                        .report = std::move(report),
                        .mechanism = mechanism,
                        .unit = unit,
                        .drive = {}};
}

namespace {

ExpectedAll<IdentifyResult> identify_alone(const IdentifyJob& job) {
  std::error_code ignored;
  const auto size = std::filesystem::file_size(job.log, ignored);
  if (!ignored && size >= recording::streamed_from) {
    FLYBALL_TRY(auto streamed, identify_streamed(job));
    if (streamed) {
      return *std::move(streamed);
    }
  }
  return identify_with(job.selection, [&](const recording::LogSelection& selection) {
    return recording::load_recording(job.log, selection);
  });
}

}  // namespace

void tell_contradictions(identification::FitReport& report, const PlantDescription& said) {
  if (report.fit) {
    const std::vector<Diagnostic> found = contradictions(*report.fit, said);
    report.diagnostics.insert(report.diagnostics.end(), found.begin(), found.end());
  }
}

ExpectedAll<IdentifyResult> identify(const IdentifyJob& job) {
  FLYBALL_TRY(auto result, identify_alone(job));
  tell_contradictions(result.report, job.said);
  return result;
}

ExpectedAll<IdentifyResult> identify(const Log& log, const recording::LogSelection& selection) {
  return identify_with(selection, [&](const recording::LogSelection& closer) {
    return recording::recording_from_log(log, closer);
  });
}

}  // namespace flyball::study
