#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <flyball/identification/prediction_error.hpp>

#include "identification/model_simulation.hpp"

/// A model, its runs and what is free, as a problem of least squares.
namespace flyball::identification {

/// The unknowns: free parameters, then each run's free initial states.
struct Experiment {
  AnyModel model;
  std::vector<ExperimentRun> runs{};
  std::vector<FreeParameter> free{};
  std::vector<Eigen::Index> places{};                    ///< Of the free among the model's.
  std::vector<std::vector<Eigen::Index>> free_states{};  ///< Free initial ones, of each run.
  std::vector<Eigen::Index> first{};                     ///< Place of a run's first one in x.
  std::vector<double> spread{};      ///< p, standard deviation of what was measured.
  std::vector<double> output_std{};  ///< p
  IntegrationPlan plan{};

  explicit Experiment(AnyModel of) : model(std::move(of)) {}

  /// @errors As `fit_model`.
  [[nodiscard]] static Expected<Experiment> create(const AnyModel& model,
                                                   const std::vector<ExperimentRun>& runs,
                                                   const std::vector<FreeParameter>& parameters,
                                                   std::string_view where);

  [[nodiscard]] Eigen::Index unknowns() const noexcept;
  [[nodiscard]] Eigen::VectorXd start() const;
  [[nodiscard]] bool has_priors() const noexcept;
  [[nodiscard]] AnyModel model_at(const Eigen::VectorXd& x) const;
  [[nodiscard]] Eigen::VectorXd initial_of(std::size_t run, const Eigen::VectorXd& x) const;
  /// Refers to this experiment. A block a run, a row for each measured value, by time.
  [[nodiscard]] optimization::LeastSquaresProblem problem(
      const PredictionErrorOptions& options) const;
};

/// @errors ArgumentError.
[[nodiscard]] Expected<void> check_options(const AnyModel& model,
                                           const PredictionErrorOptions& options,
                                           std::string_view where);

/// A run simulated from an initial state. @errors ArgumentError::not_finite where that overflows.
[[nodiscard]] Expected<RunFit> run_fit(const AnyModel& model, const ExperimentRun& run,
                                       const Eigen::VectorXd& initial, InputHold hold,
                                       const IntegrationPlan& plan);

/// The combinations that are not determined: "raising k by 1 % and m by 1 % changes nothing that
/// was measured".
[[nodiscard]] std::vector<std::string> words_of(const Experiment& experiment,
                                                const optimization::LeastSquaresResult& result);

}  // namespace flyball::identification
