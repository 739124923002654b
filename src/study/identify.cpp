#include <flyball/study/identify.hpp>

#include <utility>

#include "core/try.hpp"

namespace flyball::study {

std::vector<Diagnostic> IdentifyResult::diagnostics() const {
  std::vector<Diagnostic> all = source.diagnostics;
  all.insert(all.end(), report.diagnostics.begin(), report.diagnostics.end());
  return all;
}

namespace {

IdentifyResult identify_drivetrain(const IdentifyJob& job, recording::LoadedRecording source) {
  identification::DriveReport drive = identification::identify_drive(*source.drive);
  // Whoever wants the gains of one mechanism, to design with them, learns that there are none.
  Error none = drive.fit ? Error(refusal(recording::RecordingError::drivetrain, job.log)
                                     .got("a drivetrain's")
                                     .hint("flyball identify gives the gains of its two modes; a "
                                           "controller is designed for one mechanism"))
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

}  // namespace

ExpectedAll<IdentifyResult> identify(const IdentifyJob& job) {
  FLYBALL_TRY(auto source, load_recording(job.log, job.selection));
  if (source.drive) {
    return identify_drivetrain(job, std::move(source));
  }
  const mechanisms::MechanismKind mechanism = *source.recording.mechanism;
  const std::string unit = source.recording.unit;
  identification::FitReport report = identification::identify_feedforward(source.recording);
  return IdentifyResult{.source = std::move(source),
                        .report = std::move(report),
                        .mechanism = mechanism,
                        .unit = unit,
                        .drive = {}};
}

}  // namespace flyball::study
