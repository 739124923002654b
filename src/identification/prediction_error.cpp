#include <flyball/identification/prediction_error.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <flyball/identification/identification_error.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/experiment.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using optimization::Bound;
using optimization::LeastSquaresError;
using optimization::LeastSquaresResult;

constexpr std::string_view in_fit_model = "fit_model";

/// Whether outputs' standard deviations are estimated: not given, and not the only one of a loss
/// that does not need it.
bool estimates_std(const PredictionErrorOptions& options) {
  return options.output_std.empty();
}

/// The residuals of each output, of all runs.
std::vector<std::vector<double>> by_output(const std::vector<MatrixXd>& errors, Index outputs) {
  std::vector<std::vector<double>> all(static_cast<std::size_t>(outputs));
  for (const MatrixXd& run : errors) {
    for (Index p = 0; p < outputs; ++p) {
      for (const double error : run.row(p)) {
        if (std::isfinite(error)) {
          all[static_cast<std::size_t>(p)].push_back(error);
        }
      }
    }
  }
  return all;
}

/// The standard deviation of each output's errors; where they vanish, a ten millionth of what is
/// measured, so that simulations need no more digits than that.
std::vector<double> std_of(const std::vector<MatrixXd>& errors, const Experiment& experiment,
                           bool robust) {
  std::vector<double> made;
  const auto all = by_output(errors, experiment.model.outputs());
  for (std::size_t p = 0; p < all.size(); ++p) {
    double squares = 0.0;
    for (const double error : all[p]) {
      squares += error * error;
    }
    const double rms =
        std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, all[p].size())));
    made.push_back(
        std::max({robust ? mad_scale(all[p]) : rms, 1e-7 * experiment.spread[p], 1e-300}));
  }
  return made;
}

/// The rounds of a fit: steps of the integration and standard deviations follow the minimum.
class Fitting {
 public:
  Fitting(Experiment experiment, const PredictionErrorOptions& options)
      : experiment_(std::move(experiment)), options_(options) {
    experiment_.output_std = options.output_std;
    if (estimates_std(options)) {
      for (const double spread : experiment_.spread) {
        experiment_.output_std.push_back(spread > 0.0 ? 0.1 * spread : 1.0);
      }
    }
  }

  Expected<PredictionErrorFit> run() {
    FLYBALL_CHECK(plan(experiment_.start()));
    FLYBALL_CHECK(minimize(options_.starts));
    constexpr int most_rounds = 12;
    for (int round = 0; round < most_rounds; ++round) {
      const std::vector<double> before = experiment_.output_std;
      if (estimates_std(options_)) {
        experiment_.output_std =
            std_of(errors(), experiment_, options_.loss.kind != optimization::Loss::squared);
      }
      const IntegrationPlan used = experiment_.plan;
      FLYBALL_CHECK(plan(result_.x));
      double change = 0.0;
      for (std::size_t p = 0; p < before.size(); ++p) {
        change = std::max(change, std::abs(std::log(experiment_.output_std[p] / before[p])));
      }
      // One output's own standard deviation does not move the minimum of squares.
      const bool moves = before.size() > 1 || options_.loss.kind != optimization::Loss::squared ||
                         experiment_.has_priors();
      const bool same_plan =
          used.implicit == experiment_.plan.implicit && experiment_.plan.step >= used.step;
      if (same_plan) {
        experiment_.plan = used;
      }
      if (same_plan && (!moves || change < 0.01)) {
        break;
      }
      FLYBALL_CHECK(minimize(1));
    }
    FLYBALL_CHECK(minimize(1));  // with the numbers that are told
    return describe();
  }

 private:
  [[nodiscard]] std::vector<MatrixXd> errors() const {
    std::vector<MatrixXd> all;
    const AnyModel model = experiment_.model_at(result_.x);
    for (std::size_t r = 0; r < experiment_.runs.size(); ++r) {
      const auto simulated =
          simulate_run(model, experiment_.runs[r], experiment_.initial_of(r, result_.x),
                       options_.hold, experiment_.plan);
      all.push_back(simulated ? output_errors(model, experiment_.runs[r], simulated->y)
                              : MatrixXd());
    }
    return all;
  }

  Expected<void> plan(const VectorXd& x) {
    const AnyModel model = experiment_.model_at(x);
    std::vector<VectorXd> initial;
    for (std::size_t r = 0; r < experiment_.runs.size(); ++r) {
      initial.push_back(experiment_.initial_of(r, x));
    }
    const VectorXd tolerance =
        options_.integration_error *
        Eigen::Map<const VectorXd>(experiment_.output_std.data(),
                                   static_cast<Index>(experiment_.output_std.size()));
    const auto found = plan_integration(model, experiment_.runs, initial, options_.hold, tolerance);
    if (!found) {
      return refusal(LeastSquaresError::no_start, in_fit_model,
                     "the simulation from the start values")
          .got("not finite")
          .hint(
              "start the parameters elsewhere, bound them to where the model is stable, or keep "
              "square roots and quotients finite with max(x, 0)")
          .with("start", std::vector<double>(x.begin(), x.end()));
    }
    experiment_.plan = *found;
    return {};
  }

  Expected<void> minimize(int starts) {
    problem_ = experiment_.problem(options_);
    if (result_.x.size() != 0) {
      problem_.start = result_.x;
    }
    if (starts > 1) {
      optimization::LeastSquaresOptions each = options_.fit;
      constexpr int most = 60;  // to tell which start leads where; the best goes on to its end
      each.max_iterations = std::min(each.max_iterations, most);
      FLYBALL_TRY(auto several,
                  solve_from_several_starts(
                      problem_, {.starts = starts, .seed = options_.seed, .each = each}));
      result_ = std::move(several.best);
      iterations_ += result_.iterations;
      fit_start_costs_ = std::move(several.costs);
      agreeing_ = several.agreeing;
      return {};
    }
    FLYBALL_TRY(result_, solve_least_squares(problem_, options_.fit));
    iterations_ += result_.iterations;
    return {};
  }

  Expected<PredictionErrorFit> describe() {
    PredictionErrorFit fit(experiment_.model_at(result_.x));
    fit.output_std = experiment_.output_std;
    fit.integration = experiment_.plan;
    fit.minimum = result_;
    fit.minimum.iterations = iterations_;
    fit.start_costs = fit_start_costs_;
    fit.agreeing_starts = agreeing_;
    for (std::size_t r = 0; r < experiment_.runs.size(); ++r) {
      FLYBALL_TRY(RunFit run,
                  run_fit(fit.model, experiment_.runs[r], experiment_.initial_of(r, result_.x),
                          options_.hold, experiment_.plan));
      fit.runs.push_back(std::move(run));
    }
    look_at_residuals(fit);
    FLYBALL_CHECK(add_parameters(fit));
    fit.undetermined = words_of(experiment_, result_);
    count(fit);
    return fit;
  }

  void look_at_residuals(PredictionErrorFit& fit) const {
    for (Index p = 0; p < experiment_.model.outputs(); ++p) {
      std::vector<std::vector<double>> runs;
      for (const RunFit& run : fit.runs) {
        const VectorXd row = run.residuals.row(p);
        runs.emplace_back(row.begin(), row.end());
      }
      fit.whiteness.push_back(whiteness_of(runs));
      if (const Whiteness& found = fit.whiteness.back(); !found.is_white()) {
        fit.correlated_samples =
            std::max(fit.correlated_samples,
                     2 * static_cast<Index>(std::max<std::size_t>(1, found.correlated_lags)));
      }
    }
  }

  Expected<void> add_parameters(PredictionErrorFit& fit) const {
    const ModelDescription names = experiment_.model.description();
    const auto& free = experiment_.free;
    // σ is in the scale of the residuals, which estimated ones have 1 but for degrees of freedom.
    optimization::CovarianceOptions covariance{.scale_is_known = !estimates_std(options_)};
    double freedom = infinity;
    if (fit.correlated_samples > 1) {
      const Index rows = fit.correlated_samples * experiment_.model.outputs();
      covariance.batch = std::max<Index>(1, std::min(rows, result_.residuals / 10));
      freedom = static_cast<double>(result_.residuals / covariance.batch - 1);
    } else if (options_.loss.kind != optimization::Loss::squared) {
      covariance.batch = 1;
    }
    FLYBALL_TRY(const auto found, covariance_of(problem_, result_, covariance));
    freedom = std::max(1.0, covariance.scale_is_known ? freedom : std::min(freedom, found.freedom));
    const double t = student_quantile(0.5 + 0.5 * options_.confidence, freedom);
    for (std::size_t j = 0; j < free.size(); ++j) {
      const auto place = static_cast<Index>(j);
      const Parameter& named = names.parameters[static_cast<std::size_t>(experiment_.places[j])];
      FittedParameter one{.name = named.name,
                          .unit = named.unit,
                          .value = result_.x(place),
                          .standard_error = found.standard_errors(place),
                          .bound = result_.bounds[j]};
      one.low = one.value - t * one.standard_error;
      one.high = one.value + t * one.standard_error;
      if (options_.profile && one.bound != Bound::fixed) {
        FLYBALL_TRY(const auto profile, profile_interval(problem_, result_, place,
                                                         {.confidence = options_.confidence,
                                                          .covariance = covariance,
                                                          .fit = options_.fit}));
        one.low = profile.low;
        one.high = profile.high;
        one.low_is_open = profile.low_is_open;
        one.high_is_open = profile.high_is_open;
      } else if (one.bound == Bound::lower || one.bound == Bound::upper) {
        // A bound is not an estimate: nothing is said of the other side.
        one.low_is_open = one.bound == Bound::lower;
        one.high_is_open = one.bound == Bound::upper;
        one.standard_error = infinity;
        one.low = one.low_is_open ? one.value : -infinity;
        one.high = one.high_is_open ? one.value : infinity;
      } else if (!std::isfinite(one.standard_error)) {
        one.low_is_open = one.high_is_open = true;
      }
      fit.parameters.push_back(std::move(one));
    }
    return {};
  }

  /// Akaike's and Schwarz's criteria, of normal errors.
  void count(PredictionErrorFit& fit) const {
    fit.measurements = result_.residuals;
    fit.estimated = result_.rank;
    double likelihood = 0.0;  // -2 log L
    const auto all = by_output(errors(), experiment_.model.outputs());
    for (std::size_t p = 0; p < all.size(); ++p) {
      const double sigma = experiment_.output_std[p];
      for (const double error : all[p]) {
        likelihood += error * error / (sigma * sigma);
      }
      likelihood +=
          static_cast<double>(all[p].size()) * std::log(2.0 * std::numbers::pi * sigma * sigma);
    }
    const double k = static_cast<double>(fit.estimated) +
                     (estimates_std(options_) ? static_cast<double>(all.size()) : 0.0);
    fit.aic = likelihood + 2.0 * k;
    fit.bic = likelihood + k * std::log(static_cast<double>(std::max<Index>(1, fit.measurements)));
  }

  Experiment experiment_;
  const PredictionErrorOptions& options_;
  optimization::LeastSquaresProblem problem_{};
  LeastSquaresResult result_{};
  std::vector<double> fit_start_costs_{};
  int agreeing_ = 1;
  int iterations_ = 0;  ///< Of all rounds.
};

}  // namespace

Expected<PredictionErrorFit> fit_model(const AnyModel& model,
                                       const std::vector<ExperimentRun>& runs,
                                       const std::vector<FreeParameter>& parameters,
                                       const PredictionErrorOptions& options) {
  FLYBALL_CHECK(check_options(model, options, in_fit_model));
  FLYBALL_TRY(Experiment experiment, Experiment::create(model, runs, parameters, in_fit_model));
  if (experiment.unknowns() == 0) {
    return refusal(ArgumentError::empty, in_fit_model, "the list of free parameters")
        .got("empty")
        .expected("a parameter of the model, or a free initial state");
  }
  return Fitting(std::move(experiment), options).run();
}

Expected<RunFit> validate(const PredictionErrorFit& fit, const ExperimentRun& run,
                          const PredictionErrorOptions& options) {
  FLYBALL_CHECK(check_options(fit.model, options, "validate"));
  FLYBALL_TRY(Experiment experiment, Experiment::create(fit.model, {run}, {}, "validate"));
  experiment.output_std = fit.output_std;
  experiment.plan = fit.integration;
  VectorXd x(0);
  if (experiment.unknowns() > 0) {
    FLYBALL_TRY(const auto result, solve_least_squares(experiment.problem(options), options.fit));
    x = result.x;
  }
  return run_fit(fit.model, run, experiment.initial_of(0, x), options.hold, fit.integration);
}

Expected<std::vector<RunFit>> cross_validate(const PredictionErrorFit& fit,
                                             const std::vector<ExperimentRun>& runs,
                                             const std::vector<FreeParameter>& parameters,
                                             const PredictionErrorOptions& options) {
  if (runs.size() < 2) {
    return refusal(ArgumentError::out_of_range, "cross_validate", "the number of runs")
        .got(detail::format("{}", runs.size()))
        .expected("2 at least, so that one can be left out");
  }
  PredictionErrorOptions once = options;
  once.starts = 1;
  once.profile = false;
  std::vector<RunFit> all;
  for (std::size_t out = 0; out < runs.size(); ++out) {
    std::vector<ExperimentRun> others = runs;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(out));
    FLYBALL_TRY(const auto without, fit_model(fit.model, others, parameters, once));
    FLYBALL_TRY(RunFit predicted, validate(without, runs[out], once));
    all.push_back(std::move(predicted));
  }
  return all;
}

}  // namespace flyball::identification
