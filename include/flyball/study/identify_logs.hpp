#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/identification/repeatability.hpp>
#include <flyball/study/identify.hpp>

namespace flyball::study {

/// Identify one mechanism or drivetrain from several logs of it.
struct IdentifyLogsJob {
  std::vector<std::string> logs{};    ///< Paths; two or more.
  recording::LogSelection selection;  ///< Of each of them.
  PlantDescription said{};            ///< As of IdentifyJob; the joint fit is held against it.
};

/// One of the logs by itself.
struct LogOutcome {
  std::string path{};
  std::size_t rows = 0;
  std::vector<Diagnostic> diagnostics{};
  /// Its gains (without its runs), or why there are none.
  ExpectedAll<identification::FeedforwardFit> fit;
  std::optional<identification::DriveFit> drive{};  ///< In its place, of a drivetrain.

  [[nodiscard]] bool has_gains() const { return fit.has_value() || drive.has_value(); }
};

/// The logs one by one, what they say of each gain, and the fit of all runs together.
struct IdentifyLogsResult {
  std::vector<LogOutcome> logs{};
  std::vector<std::size_t> used{};  ///< Those with gains, by their index: what is compared.
  std::vector<identification::GainComparison> gains{};  ///< Their `logs` count in `used`.
  IdentifyResult joint;  ///< Its intervals are widened by the scatter among the logs.

  /// Whether each gain's scatter is what the logs' own errors explain.
  [[nodiscard]] bool repeats() const;
};

/// Runs the job. A log that cannot be read, or that has no gains, is told and left out.
/// @errors those of `identify` where fewer than two logs have gains, one for each that has none;
/// ArgumentError::wrong_unit for logs of different mechanisms; ArgumentError::wrong_shape for less
/// than two logs.
/// Cost: twice that of `identify` of each log.
[[nodiscard]] ExpectedAll<IdentifyLogsResult> identify_logs(const IdentifyLogsJob& job);

/// The joint fit as `identify` would answer it, a table of gains by log, and which differ. Schema
/// "flyball.identify_logs/1".
[[nodiscard]] Answer answer_of(const IdentifyLogsResult& result);
[[nodiscard]] std::string to_json(const IdentifyLogsResult& result);

}  // namespace flyball::study
