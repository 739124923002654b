#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/estimation/noise_fit.hpp>
#include <flyball/identification/residual_tests.hpp>
#include <flyball/io/log.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study {

/// A run of a log with its estimates, each a column per sample.
struct EstimatedRun {
  std::string name{};
  std::vector<double> time{};      ///< N, s.
  Eigen::MatrixXd inputs{};        ///< m x N
  Eigen::MatrixXd measured{};      ///< p x N; NaN: not measured.
  Eigen::MatrixXd filtered{};      ///< n x N, of what was measured until then.
  Eigen::MatrixXd filtered_std{};  ///< n x N
  Eigen::MatrixXd smoothed{};      ///< n x N, of the whole run; empty without a smoother.
  Eigen::MatrixXd smoothed_std{};  ///< n x N
  Eigen::MatrixXd innovations{};   ///< p x N, in standard deviations, independent of each other.
  std::vector<double> nis{};       ///< N; NaN where nothing was measured.
  std::vector<Eigen::Index> entries{};  ///< N, how many readings the NIS has.
  std::vector<double> weight{};  ///< N, what the readings counted for: 1 fully, 0 not at all.
};

/// Whether the innovations are as large as the filter takes them for: their squared sizes against
/// the χ² distribution that they have if the model and its noises are right.
struct InnovationTest {
  Eigen::Index readings = 0;
  double mean = 0.0;    ///< Σ NIS over the number of readings; 1 is expected.
  double low = 0.0;     ///< Of the mean, where 95 % of right filters are,
  double high = 0.0;    ///< and its other end.
  double within = 0.0;  ///< Share of the samples whose NIS is below its own 95 % quantile.
  [[nodiscard]] bool passed() const noexcept { return mean >= low && mean <= high; }
};

/// A log's states by a model, and what the residuals say of it.
struct Estimation {
  /// Of a model, the rest to be filled in.
  explicit Estimation(AnyModel of) : model(std::move(of)) {}

  AnyModel model;
  std::string log{};         ///< Path.
  std::string project{};     ///< Path.
  ModelEstimate settings{};  ///< With the noises that were used.
  std::vector<EstimatedRun> runs{};
  double log_likelihood = 0.0;
  InnovationTest nis{};
  std::vector<identification::Whiteness> whiteness{};  ///< One an output, over all runs.
  std::optional<NoiseFit> tuned{};
  Eigen::Index relinearizations = 0;  ///< Of the fit, along a smoothed path each.
  std::vector<Diagnostic> diagnostics{};
};

/// Runs the Kalman filter of [estimate] and its Rauch-Tung-Striebel smoother over a log.
///
/// A sample is where any channel has one; readings that are not there are left out, and where the
/// time of all jumps a new run begins from the initial state. Between two samples the model is
/// stepped by RK4, in as many steps as it is fast, the process noise integrated with it.
/// @param project  With a model. @errors ArgumentError::unknown_name for channels that are not
///                 there, wrong_unit, empty for an output without a noise; those of `fit_noise`.
[[nodiscard]] ExpectedAll<Estimation> estimate(const Log& log, const Project& project);

/// States with their 2 σ bands over time, the tests of the innovations, the noises that were found;
/// the estimates as CSV and WPILOG. Schema "flyball.estimate/1".
[[nodiscard]] Answer answer_of(const Estimation& result);

}  // namespace flyball::study
