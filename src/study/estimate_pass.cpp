#include <algorithm>
#include <cmath>
#include <optional>

#include <flyball/estimation/state_limits.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>

#include "core/constants.hpp"
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

/// RK4's error stays below 1e-5 of a state's change where |λ| dt is below it.
constexpr double longest_step = 0.25;
constexpr int most_substeps = 1000;

/// A state's estimates given the limits of the states: the Gaussian with the moments of the cut
/// one. What the filter carries on is not cut: a limit that is told at each sample is the same
/// knowledge every time.
void cut_off(Eigen::Ref<VectorXd> x, Eigen::Ref<VectorXd> deviations, const MatrixXd& P,
             const ModelEstimate& settings) {
  auto estimate = Estimate<VectorXd>::create(VectorXd(x), Covariance(P));
  if (!estimate) {
    return;  // a state that is known without error
  }
  for (Index i = 0; i < x.size(); ++i) {
    if (std::isfinite(settings.lower(i)) || std::isfinite(settings.upper(i))) {
      limit_state(*estimate, i, settings.lower(i), settings.upper(i));
    }
  }
  x = estimate->x_hat();
  deviations = estimate->P().diagonal().cwiseMax(0.0).cwiseSqrt();
}

MatrixXd squares(const VectorXd& deviations) {
  return deviations.cwiseAbs2().asDiagonal();
}

/// One filter over one run.
template <class Filter>
class Pass {
 public:
  Pass(Filter filter, const ExperimentRun& run, const ModelEstimate& settings, InputHold hold)
      : filter_(std::move(filter)),
        run_(run),
        settings_(settings),
        hold_(hold),
        density_(squares(settings.process_noise)),
        is_limited_(settings.lower.array().isFinite().any() ||
                    settings.upper.array().isFinite().any()) {}

  Expected<EstimatePass> run(bool smooth) {
    const auto count = static_cast<Index>(run_.time.size());
    const Index n = filter_.x_hat().size();
    const Index p = run_.outputs.rows();
    std::optional<OutlierGuard> guard;
    if (settings_.outliers) {
      // A filter that leaves out what tells it that it is wrong doubts itself after a while.
      constexpr int in_a_row = 10;
      FLYBALL_TRY(guard, OutlierGuard::create(
                             {.treatment = *settings_.outliers, .recover_after = in_a_row}));
    }
    EstimatePass pass;
    EstimatedRun& made = pass.run;
    made.name = run_.name;
    made.time = run_.time;
    made.inputs = run_.inputs;
    made.measured = run_.outputs;
    made.filtered.resize(n, count);
    made.filtered_std.resize(n, count);
    made.innovations = MatrixXd::Constant(p, count, nan);
    made.nis.assign(run_.time.size(), nan);
    made.entries.assign(run_.time.size(), 0);
    made.weight.assign(run_.time.size(), nan);
    const VectorXd x0 = filter_.x_hat();
    const MatrixXd P0 = filter_.P();
    pass.P_end_unmeasured = P0;
    std::vector<FilterStep<>> steps;
    steps.reserve(run_.time.size());
    for (Index k = 0; k < count; ++k) {
      FLYBALL_TRY(FilterStep<> step, advance(k, pass));
      pass.P_end_unmeasured = flyball::detail::product_transposed(
                                  flyball::detail::product(step.F, pass.P_end_unmeasured), step.F) +
                              step.Q;
      correct(k, guard ? &*guard : nullptr, pass);
      pass.limited += is_limited_ && bring_inside() ? 1 : 0;
      step.x = filter_.x_hat();
      step.P = filter_.P();
      made.filtered.col(k) = step.x;
      made.filtered_std.col(k) = step.P.diagonal().cwiseMax(0.0).cwiseSqrt();
      if (is_limited_) {
        cut_off(made.filtered.col(k), made.filtered_std.col(k), step.P, settings_);
      }
      steps.push_back(std::move(step));
    }
    pass.P_end = filter_.P();
    if (smooth) {
      FLYBALL_TRY(pass.path, flyball::smooth(x0, P0, steps));
      made.smoothed = pass.path.x.rightCols(count);
      made.smoothed_std.resize(n, count);
      for (Index k = 0; k < count; ++k) {
        made.smoothed_std.col(k) =
            pass.path.P[static_cast<std::size_t>(k + 1)].diagonal().cwiseMax(0.0).cwiseSqrt();
        if (is_limited_) {
          cut_off(made.smoothed.col(k), made.smoothed_std.col(k),
                  pass.path.P[static_cast<std::size_t>(k + 1)], settings_);
        }
      }
    }
    return pass;
  }

 private:
  /// The likeliest estimate within the limits. @return Whether it was not there already.
  bool bring_inside() {
    auto estimate = filter_.estimate();
    bool moved = false;
    for (Index i = 0; i < settings_.lower.size(); ++i) {
      const double x = estimate.x_hat()(i);
      if (x < settings_.lower(i) || x > settings_.upper(i)) {
        const VectorXd row = VectorXd::Unit(settings_.lower.size(), i);
        moved = project(estimate, x, row, settings_.lower(i), settings_.upper(i)) || moved;
      }
    }
    if (moved) {
      filter_.restore(estimate);
    }
    return moved;
  }

  /// To the time of a sample.
  Expected<FilterStep<>> advance(Index k, EstimatePass& pass) {
    const Index n = filter_.x_hat().size();
    FilterStep<> step;
    step.F = MatrixXd::Identity(n, n);
    step.Q = MatrixXd::Zero(n, n);
    if (k > 0) {
      const SampleStep sample = sample_step(filter_.model(), run_, k, filter_.x_hat(), hold_);
      pass.is_stiff = pass.is_stiff || sample.count == most_substeps;
      const MatrixXd P = filter_.P();
      for (int i = 0; i < sample.count; ++i) {
        pass.not_moved += filter_.predict(sample.u, sample.dt) ? 0 : 1;
        const MatrixXd& F = filter_.F();
        step.Q = flyball::detail::product_transposed(flyball::detail::product(F, step.Q), F) +
                 step_noise(F, density_, sample.dt);
        step.F = flyball::detail::product(F, step.F);
      }
      if (settings_.is_unscented) {
        // What the straight line through the points leaves counts as noise.
        FLYBALL_TRY(step, statistical_linearization(flyball::detail::product_transposed(P, step.F),
                                                    P, filter_.P()));
      }
    }
    step.x_prior = filter_.x_hat();
    return step;
  }

  void correct(Index k, OutlierGuard* guard, EstimatePass& pass) {
    const VectorXd y = run_.outputs.col(k);
    const VectorXd u = run_.inputs.col(k);
    const auto c = filter_.correct(y, u, {.guard = guard, .missing_entries = true});
    const bool is_judged = c.accepted() || c.status == UpdateStatus::rejected;
    if (c.entries == 0 || !is_judged) {
      return;
    }
    const auto at = static_cast<std::size_t>(k);
    pass.run.nis[at] = c.nis;
    pass.run.entries[at] = c.entries;
    pass.run.weight[at] = c.weight;
    const VectorXd normalized = c.normalized();
    for (Index i = 0; i < y.size(); ++i) {
      pass.run.innovations(i, k) = std::isnan(y(i)) ? nan : normalized(i);
    }
    if (c.accepted()) {
      pass.log_likelihood += c.log_likelihood();
    }
  }

  Filter filter_;
  const ExperimentRun& run_;
  const ModelEstimate& settings_;
  InputHold hold_;
  MatrixXd density_;
  bool is_limited_;
};

template <class Filter>
Expected<EstimatePass> pass_of(const AnyModel& model, const ExperimentRun& run,
                               const ModelEstimate& settings, InputHold hold, bool smooth) {
  FLYBALL_TRY(Filter filter,
              Filter::create(model, ProcessDensity{squares(settings.process_noise)},
                             squares(settings.measurement_noise),
                             {settings.initial, squares(settings.initial_std)}, Time(1.0)));
  return Pass<Filter>(std::move(filter), run, settings, hold).run(smooth);
}

}  // namespace

SampleStep sample_step(const AnyModel& model, const ExperimentRun& run, Index k, const VectorXd& x,
                       InputHold hold) {
  const double apart =
      run.time[static_cast<std::size_t>(k)] - run.time[static_cast<std::size_t>(k - 1)];
  SampleStep step;
  step.u = hold == InputHold::held ? VectorXd(run.inputs.col(k - 1))
                                   : VectorXd(0.5 * (run.inputs.col(k - 1) + run.inputs.col(k)));
  MatrixXd A(x.size(), x.size());
  MatrixXd B(x.size(), step.u.size());
  model.jacobians(x, step.u, A, B);
  const double fastest = flyball::detail::eigenvalues_of(A).cwiseAbs().maxCoeff();
  const double wanted = std::ceil(apart * fastest / longest_step);
  step.count = wanted > 1.0 ? static_cast<int>(std::min<double>(wanted, most_substeps)) : 1;
  step.dt = apart / step.count;
  return step;
}

Expected<EstimatePass> estimate_run(const AnyModel& model, const ExperimentRun& run,
                                    const ModelEstimate& settings, InputHold hold, bool smooth) {
  return settings.is_unscented
             ? pass_of<UnscentedKalmanFilter<AnyModel>>(model, run, settings, hold, smooth)
             : pass_of<ExtendedKalmanFilter<AnyModel>>(model, run, settings, hold, smooth);
}

Expected<std::vector<EstimatePass>> estimate_runs(const AnyModel& model,
                                                  const std::vector<ExperimentRun>& runs,
                                                  const ModelEstimate& settings, InputHold hold,
                                                  bool smooth) {
  std::vector<EstimatePass> passes;
  for (const ExperimentRun& run : runs) {
    FLYBALL_TRY(EstimatePass pass, estimate_run(model, run, settings, hold, smooth));
    passes.push_back(std::move(pass));
  }
  return passes;
}

}  // namespace flyball::study
