#pragma once

#include <optional>
#include <vector>

#include <flyball/identification/prediction_error.hpp>

/// Simulations of a run, with the exact derivatives of what was computed.
namespace flyball::identification {

/// What a simulation is differentiated by.
struct SensitivityBy {
  std::vector<Eigen::Index> parameters{};  ///< Places among the model's.
  std::vector<Eigen::Index> states{};      ///< Initial ones.
  [[nodiscard]] Eigen::Index size() const noexcept {
    return static_cast<Eigen::Index>(parameters.size() + states.size());
  }
};

/// The outputs at the run's samples.
struct SimulatedRun {
  Eigen::MatrixXd y{};            ///< p x N
  Eigen::MatrixXd sensitivity{};  ///< p N x by.size(), by sample, where asked for.
};

/// Integrates a run. Nothing where the simulation leaves finite numbers.
/// @param by  Or null: without sensitivities.
[[nodiscard]] std::optional<SimulatedRun> simulate_run(const AnyModel& model,
                                                       const ExperimentRun& run,
                                                       const Eigen::VectorXd& initial,
                                                       InputHold hold, const IntegrationPlan& plan,
                                                       const SensitivityBy* by = nullptr);

/// The longest step, of a half, a quarter, … of the sampling interval, whose outputs differ by less
/// than `tolerance` (p, in the outputs' units) from those of half of it; the best that there is if
/// none does. @param initial  One a run. Nothing where no plan gives finite numbers.
[[nodiscard]] std::optional<IntegrationPlan> plan_integration(
    const AnyModel& model, const std::vector<ExperimentRun>& runs,
    const std::vector<Eigen::VectorXd>& initial, InputHold hold, const Eigen::VectorXd& tolerance);

/// ŷ - y, angles the shorter way round, NaN where nothing was measured.
[[nodiscard]] Eigen::MatrixXd output_errors(const AnyModel& model, const ExperimentRun& run,
                                            const Eigen::MatrixXd& simulated);

}  // namespace flyball::identification
