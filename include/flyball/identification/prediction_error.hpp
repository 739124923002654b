#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <flyball/identification/residual_tests.hpp>
#include <flyball/optimization/least_squares_statistics.hpp>
#include <flyball/systems/any_model.hpp>

/// Parameters of any model from recordings of its inputs and outputs, by what a simulation from
/// the inputs alone gets wrong (output error).
namespace flyball::identification {

/// What an input does between its samples.
enum class InputHold {
  held,    ///< It keeps its value: a command of a digital controller.
  linear,  ///< It goes straight to the next one: a measured signal.
  cubic,   ///< It passes smoothly through them (Catmull and Rom): a band-limited signal.
};

/// A state at a run's first sample.
struct InitialState {
  double value = 0.0;  ///< SI; where it is not fixed, where the search starts.
  bool is_free = false;
  double std = std::numeric_limits<double>::infinity();  ///< Of a free one: how far `value` errs.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// A recording, in the model's units.
struct ExperimentRun {
  std::string name{};
  std::vector<double> time{};           ///< N, s, ascending.
  Eigen::MatrixXd inputs{};             ///< m x N, finite.
  Eigen::MatrixXd outputs{};            ///< p x N; NaN: not measured.
  std::vector<InitialState> initial{};  ///< n; empty: zero, fixed.
};

/// A parameter that is looked for; the model's own value is where the search starts.
struct FreeParameter {
  std::string name{};  ///< Of the model's.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double mean = 0.0;  ///< What is known of it beforehand: mean ± std.
  double std = std::numeric_limits<double>::infinity();
};

/// How a model is fitted.
struct PredictionErrorOptions {
  InputHold hold = InputHold::held;
  /// Its scale is in units of an output's standard deviation.
  optimization::RobustLoss loss{optimization::Loss::squared, 1.5};
  /// p, the standard deviation of an output's errors; empty: estimated.
  std::vector<double> output_std{};
  double confidence = 0.95;
  bool profile = false;  ///< Intervals from profiles of the likelihood.
  int starts = 1;        ///< More: a Latin hypercube over finite bounds.
  unsigned long long seed = 1;
  /// The integration's error, as a share of the standard deviation of an output's errors.
  double integration_error = 0.02;
  optimization::LeastSquaresOptions fit{.tolerance = 1e-6, .rank_tolerance = 1e-7};
};

/// How a model is integrated between samples: steps of equal length.
struct IntegrationPlan {
  bool implicit = false;  ///< SDIRK of order 2, L-stable; otherwise Runge-Kutta of order 4.
  double step = 0.0;      ///< s, the longest.
};

/// What a fit says of a parameter.
struct FittedParameter {
  std::string name{};
  std::string unit{};
  double value = 0.0;
  double standard_error = 0.0;  ///< Infinite: not determined.
  double low = 0.0;             ///< The interval of the options' confidence.
  double high = 0.0;
  bool low_is_open = false;  ///< The interval ends at a bound, or nowhere.
  bool high_is_open = false;
  optimization::Bound bound = optimization::Bound::none;
};

/// How one output of a run is met.
struct OutputFit {
  double rmse = 0.0;   ///< Root mean square error, in the output's unit.
  double nrmse = 0.0;  ///< The same over the standard deviation of what was measured.
  double fit = 0.0;    ///< 1 - nrmse
};

/// A run beside its simulation.
struct RunFit {
  std::string name{};
  Eigen::VectorXd initial{};    ///< n
  Eigen::MatrixXd simulated{};  ///< p x N
  Eigen::MatrixXd residuals{};  ///< p x N, measured - simulated; NaN: not measured.
  std::vector<OutputFit> outputs{};
};

/// A fitted model.
struct PredictionErrorFit {
  /// Of a model that has the parameters found.
  explicit PredictionErrorFit(AnyModel fitted) : model(std::move(fitted)) {}

  AnyModel model;  ///< With the parameters found.
  std::vector<FittedParameter> parameters{};
  std::vector<RunFit> runs{};
  std::vector<double> output_std{};    ///< p
  std::vector<Whiteness> whiteness{};  ///< One an output, over all runs.
  /// Combinations of parameters that the recordings do not determine, in words.
  std::vector<std::string> undetermined{};
  /// Samples that were taken for depending on each other, 1 where the residuals are white.
  Eigen::Index correlated_samples = 1;
  double aic = 0.0;  ///< Akaike's criterion, -2 log L + 2 k
  double bic = 0.0;  ///< -2 log L + k log N
  Eigen::Index measurements = 0;
  Eigen::Index estimated = 0;  ///< Parameters and initial states.
  IntegrationPlan integration{};
  optimization::LeastSquaresResult minimum{};
  std::vector<double> start_costs{};  ///< Of several starts, ascending.
  int agreeing_starts = 1;
};

/// The parameters that a model's simulations of the runs agree best with what was measured, by
/// Σ ρ((ŷ - y)/σ) with exact sensitivities; the σ of outputs are those of maximum likelihood.
///
/// Steps are chosen such that the integration errs by a small share of σ, explicit ones where these
/// do, implicit ones where the model is stiff; formulas with min, max and if are integrated like
/// others. A parameter set whose simulation overflows is not entered. Intervals are Student's, from
/// batches of residuals where these are not white.
/// @errors ArgumentError for names, shapes, times and entries; IdentificationError::no_data;
///         LeastSquaresError::no_start where the model at its start values leaves finite numbers.
/// Cost: an iteration is a simulation of each run with its sensitivities; allocates.
/// Source: Ljung, "System Identification" (1999), 7 and 10; Söderström, Stoica (1989), 7.
[[nodiscard]] Expected<PredictionErrorFit> fit_model(const AnyModel& model,
                                                     const std::vector<ExperimentRun>& runs,
                                                     const std::vector<FreeParameter>& parameters,
                                                     const PredictionErrorOptions& options = {});

/// A run that the fit has not seen. Free initial states are found, the parameters stay.
/// @errors As `fit_model`.
[[nodiscard]] Expected<RunFit> validate(const PredictionErrorFit& fit, const ExperimentRun& run,
                                        const PredictionErrorOptions& options = {});

/// Each run as predicted by the fit to the others. @param runs  Two at least. @errors As
/// `fit_model`.
[[nodiscard]] Expected<std::vector<RunFit>> cross_validate(
    const PredictionErrorFit& fit, const std::vector<ExperimentRun>& runs,
    const std::vector<FreeParameter>& parameters, const PredictionErrorOptions& options = {});

/// Whether a larger model is worth its parameters.
struct ModelComparison {
  double aic_gain = 0.0;  ///< By how much the larger one's criterion is lower.
  double bic_gain = 0.0;
  double f = 0.0;        ///< Fisher's ratio of what the added parameters gain,
  double p_value = 1.0;  ///< and how often chance alone would give as much.
};
/// @param smaller  A special case of `larger`, fitted to the same runs.
[[nodiscard]] ModelComparison compare(const PredictionErrorFit& smaller,
                                      const PredictionErrorFit& larger);

}  // namespace flyball::identification
