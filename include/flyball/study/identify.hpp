#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/identification/drive_fit.hpp>
#include <flyball/identification/feedforward_fit.hpp>
#include <flyball/recording/load_recording.hpp>
#include <flyball/study/design.hpp>

namespace flyball::study {

/// Identify a mechanism or a drivetrain from a log.
struct IdentifyJob {
  std::string log{};  ///< Path.
  recording::LogSelection selection;
  /// What a project file says of the mechanism, for `contradictions`; nothing without gains.
  PlantDescription said{};
};

/// A log, read and fitted. A refused fit still carries everything that can be shown of the log.
struct IdentifyResult {
  recording::LoadedRecording source;
  identification::FitReport
      report;  ///< `report.fit` is the gains or the reason why there are none.
  /// As the log, the person or the data say; nothing for a log that was refused before it was
  /// known.
  std::optional<mechanisms::MechanismKind> mechanism{};
  std::string unit{};  ///< "m" or "rad".
  /// Of a drivetrain; then `report.fit` only says why there are no gains of one mechanism.
  std::optional<identification::DriveReport> drive{};

  /// Everything found while reading, preparing and fitting, in that order.
  [[nodiscard]] std::vector<Diagnostic> diagnostics() const;
};

/// Warnings where a log's gains are not those of the project's motor, gearing and mass, each with
/// their ratio and its likely cause.
/// @param said  The project's plant; without gains nothing is compared.
[[nodiscard]] std::vector<Diagnostic> contradictions(const identification::FeedforwardFit& fit,
                                                     const PlantDescription& said);

/// Runs the job. Where neither the log nor the person say what the mechanism is, the data choose it
/// (`identification::choose_mechanism`), and the units are those of that kind. An error means that
/// the log could not be read as a recording at all; a fit that was refused is in `report.fit`. What
/// contradicts `said` is among the report's diagnostics.
/// @errors as `recording::load_recording`; IdentificationError::unknown_mechanism where the data
/// fit
///         several kinds, together with RecordingError::unit_unknown where the unit is open too.
[[nodiscard]] ExpectedAll<IdentifyResult> identify(const IdentifyJob& job);

/// The same of a log in memory. @param selection  Without `also`: another log is not read.
[[nodiscard]] ExpectedAll<IdentifyResult> identify(const Log& log,
                                                   const recording::LogSelection& selection = {});

/// The same of a drivetrain's recording in memory. @param source  With its `drive`.
[[nodiscard]] IdentifyResult identify_drivetrain(recording::LoadedRecording source);

}  // namespace flyball::study
