#pragma once

#include <vector>

#include <flyball/estimation/smoother.hpp>
#include <flyball/study/estimate.hpp>

/// The parts of `estimate`.
namespace flyball::study {

/// What a filter and a smoother made of one run.
struct EstimatePass {
  EstimatedRun run;
  SmoothedPath path{};                 ///< Its column k + 1 is sample k; empty without a smoother.
  Eigen::MatrixXd P_end{};             ///< n x n, of the filter's last estimate,
  Eigen::MatrixXd P_end_unmeasured{};  ///< and what it were without a measurement.
  double log_likelihood = 0.0;
  std::size_t not_moved = 0;  ///< Predictions that left the numbers that there are.
  std::size_t limited = 0;    ///< Samples at which a state had left its limits.
  bool is_stiff = false;      ///< The model is faster than the most steps that are made.
};

/// @param smooth  Whether the path is smoothed.
/// @errors Those of the filter's maker and of `smooth`.
[[nodiscard]] Expected<EstimatePass> estimate_run(const AnyModel& model,
                                                  const identification::ExperimentRun& run,
                                                  const ModelEstimate& settings,
                                                  identification::InputHold hold, bool smooth);

/// The same of several.
[[nodiscard]] Expected<std::vector<EstimatePass>> estimate_runs(
    const AnyModel& model, const std::vector<identification::ExperimentRun>& runs,
    const ModelEstimate& settings, identification::InputHold hold, bool smooth);

/// A step of the model between two samples.
struct SampleStep {
  Eigen::VectorXd u;
  double dt = 0.0;  ///< s, of each
  int count = 1;    ///< of these steps.
};
/// From sample k - 1 to k. @param x  n, where the model is, which says how fast it is there.
[[nodiscard]] SampleStep sample_step(const AnyModel& model,
                                     const identification::ExperimentRun& run, Eigen::Index k,
                                     const Eigen::VectorXd& x, identification::InputHold hold);

/// The noises that make the runs most likely, the model linearised along smoothed paths until they
/// stay; the settings become those that were found.
struct TunedNoise {
  NoiseFit fit;
  Eigen::Index relinearizations = 0;
  bool settled = false;  ///< Another linearisation changes nothing.
};
/// @errors Those of `estimate_run` and `fit_noise`.
[[nodiscard]] Expected<TunedNoise> tune_noise(
    const AnyModel& model, const std::vector<identification::ExperimentRun>& runs,
    ModelEstimate& settings, identification::InputHold hold);

}  // namespace flyball::study
