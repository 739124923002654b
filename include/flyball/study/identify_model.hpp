#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/identification/prediction_error.hpp>
#include <flyball/io/log.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study {

/// A model fitted to a log.
struct ModelIdentification {
  /// Of a fit, the rest to be filled in.
  explicit ModelIdentification(identification::PredictionErrorFit of) : fit(std::move(of)) {}

  identification::PredictionErrorFit fit;
  std::string log{};      ///< Path.
  std::string project{};  ///< Path.
  std::string name{};     ///< Of the model.
  double confidence = 0.95;
  std::vector<identification::ExperimentRun> runs{};  ///< What was fitted.
  /// What was kept aside, and how the fit predicts it.
  std::vector<identification::ExperimentRun> validation_runs{};
  std::vector<identification::RunFit> validation{};
  std::vector<Diagnostic> diagnostics{};
};

/// The log that a model's [fit] takes: as `read_log`, of a table without time with its period.
/// @errors As `read_log`.
[[nodiscard]] Expected<Log> read_model_log(const std::string& path, const Project& project);

/// Fits what [fit] leaves free of a project's model to a log, and predicts what it keeps aside.
///
/// Samples are those of the first output's channel; other channels are read at its times. Where
/// the time jumps, a new run begins.
/// @param project  With a model. @errors ArgumentError::unknown_name for channels that are not
///                 there, wrong_unit; those of `fit_model`.
[[nodiscard]] ExpectedAll<ModelIdentification> identify_model(const Log& log,
                                                              const Project& project);

/// Parameters with their intervals, how each run is met, what the residuals say, what is not
/// determined; measured and simulated over time. Schema "flyball.identify_model/1".
[[nodiscard]] Answer answer_of(const ModelIdentification& result);

}  // namespace flyball::study
