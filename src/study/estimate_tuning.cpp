#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/estimation/filter_model.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "study/estimate_pass.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using identification::ExperimentRun;
using identification::InputHold;

/// The states with process noise, whose deviations are looked for.
std::vector<Index> noisy_states(const VectorXd& process_noise) {
  std::vector<Index> states;
  for (Index i = 0; i < process_noise.size(); ++i) {
    if (process_noise(i) > 0.0) {
      states.push_back(i);
    }
  }
  return states;
}

/// A run as the linear model that holds along its smoothed path.
class Linearization {
 public:
  Linearization(const AnyModel& model, const ExperimentRun& run, const EstimatePass& pass,
                InputHold hold, const std::vector<Index>& noisy)
      : model_(model), run_(run), pass_(pass), hold_(hold), noisy_(noisy) {}

  [[nodiscard]] NoiseRecord record(const ModelEstimate& settings) const {
    const MatrixXd P0 = settings.initial_std.cwiseAbs2().asDiagonal();
    NoiseRecord record{settings.initial, P0, {}};
    for (Index k = 0; k < run_.outputs.cols(); ++k) {
      record.steps.push_back(step(k));
    }
    return record;
  }

 private:
  [[nodiscard]] NoiseStep step(Index k) const {
    const Index n = model_.states();
    NoiseStep step;
    step.A = MatrixXd::Identity(n, n);
    if (k > 0) {
      const VectorXd before = pass_.path.x.col(k);  // sample k - 1
      const SampleStep sample = sample_step(model_, run_, k, before, hold_);
      step.G.assign(noisy_.size(), MatrixXd::Zero(n, n));
      VectorXd x = before;
      VectorXd next = x;
      MatrixXd F(n, n);
      MatrixXd* const no_inputs = nullptr;
      for (int i = 0; i < sample.count; ++i) {
        flyball::detail::rk4_with_jacobians(model_, x, sample.u, sample.dt, next, F, no_inputs);
        x = next;
        for (std::size_t s = 0; s < noisy_.size(); ++s) {
          MatrixXd density = MatrixXd::Zero(n, n);
          density(noisy_[s], noisy_[s]) = 1.0;
          step.G[s] =
              flyball::detail::product_transposed(flyball::detail::product(F, step.G[s]), F) +
              step_noise(F, density, sample.dt);
        }
        step.A = flyball::detail::product(F, step.A);
      }
      step.input = x - flyball::detail::product(step.A, before);
    }
    measure(k, step);
    return step;
  }

  /// y - h(x) + C x about the smoothed x; what the filter hardly counted is left out.
  void measure(Index k, NoiseStep& step) const {
    const VectorXd x = pass_.path.x.col(k + 1);
    const VectorXd u = run_.inputs.col(k);
    step.C.resize(model_.outputs(), model_.states());
    MatrixXd D(model_.outputs(), model_.inputs());
    model_.output_jacobians(x, u, step.C, D);
    step.y = run_.outputs.col(k) - model_.output(x, u);
    const std::vector<Coordinate>& outputs = model_.names().outputs;
    constexpr double outlier = 0.1;
    for (Index i = 0; i < step.y.size(); ++i) {
      if (outputs[static_cast<std::size_t>(i)].is_angle && !std::isnan(step.y(i))) {
        step.y(i) = angle_difference(step.y(i), 0.0);
      }
      if (pass_.run.weight[static_cast<std::size_t>(k)] < outlier) {
        step.y(i) = std::numeric_limits<double>::quiet_NaN();
      }
    }
    step.y += flyball::detail::product(step.C, x);
  }

  const AnyModel& model_;
  const ExperimentRun& run_;
  const EstimatePass& pass_;
  InputHold hold_;
  const std::vector<Index>& noisy_;
};

/// @return The largest change of a logarithm, in its standard errors where there are any.
double take(const NoiseFit& fit, const std::vector<Index>& noisy, const ModelEstimate& given,
            ModelEstimate& settings) {
  double largest = 0.0;
  const auto put = [&](const NoiseDeviation& found, double first, double& value) {
    if (!found.is_negligible) {
      const double change = std::abs(std::log(found.value / value));
      const bool known = std::isfinite(found.relative_error) && found.relative_error > 0.0;
      largest = std::max(largest, known ? change / found.relative_error : change);
    }
    // One that vanishes would go on to do so from where it is.
    value = std::max(found.value, 1e-6 * first);
  };
  for (std::size_t s = 0; s < noisy.size(); ++s) {
    put(fit.process[s], given.process_noise(noisy[s]), settings.process_noise(noisy[s]));
  }
  for (std::size_t i = 0; i < fit.measurement.size(); ++i) {
    const auto k = static_cast<Index>(i);
    put(fit.measurement[i], given.measurement_noise(k), settings.measurement_noise(k));
  }
  return largest;
}

}  // namespace

Expected<TunedNoise> tune_noise(const AnyModel& model, const std::vector<ExperimentRun>& runs,
                                ModelEstimate& settings, InputHold hold) {
  constexpr Index most = 20;
  constexpr double settled = 0.02;  // of a standard error
  const std::vector<Index> noisy = noisy_states(settings.process_noise);
  const ModelEstimate given = settings;
  TunedNoise tuned;
  while (tuned.relinearizations < most && !tuned.settled) {
    FLYBALL_TRY(const auto passes, estimate_runs(model, runs, settings, hold, true));
    std::vector<NoiseRecord> records;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      records.push_back(Linearization(model, runs[r], passes[r], hold, noisy).record(settings));
    }
    VectorXd process(static_cast<Index>(noisy.size()));
    for (std::size_t s = 0; s < noisy.size(); ++s) {
      process(static_cast<Index>(s)) = settings.process_noise(noisy[s]);
    }
    FLYBALL_TRY(NoiseFit fit, fit_noise(records, process, settings.measurement_noise));
    if (tuned.relinearizations > 0) {
      fit.start_log_likelihood = tuned.fit.start_log_likelihood;
      fit.iterations += tuned.fit.iterations;
    }
    tuned.settled = take(fit, noisy, given, settings) <= settled;
    tuned.fit = std::move(fit);
    ++tuned.relinearizations;
  }
  return tuned;
}

}  // namespace flyball::study
