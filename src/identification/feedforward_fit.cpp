#include <flyball/identification/feedforward_fit.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/cross_checks.hpp"
#include "identification/estimates.hpp"
#include "identification/model_terms.hpp"
#include "identification/output_error.hpp"
#include "identification/plausibility.hpp"
#include "identification/robust_fit.hpp"
#include "identification/settling.hpp"
#include "identification/start.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {
namespace {

using mechanisms::MechanismKind;

constexpr std::string_view where = "identify";
constexpr double shortest_time_constant = 0.002;  // s
constexpr double longest_time_constant = 10.0;    // s
constexpr int scale_refreshes = 4;

Expected<void> check_tests(const PreparedRecording& prepared) {
  bool any = false;
  bool ramps = false;
  bool steps = false;
  bool forward = false;
  bool backward = false;
  std::string unusable;
  for (const PreparedRun& run : prepared.runs) {
    any = any || run.moved;
    if (run.moved) {
      const bool ramp = is_quasistatic(run.run.kind);
      ramps = ramps || ramp;
      steps = steps || !ramp;
      forward = forward || run.direction > 0.0;
      backward = backward || run.direction < 0.0;
    }
  }
  if (prepared.runs.empty()) {
    return refusal(IdentificationError::no_data, where).hint("record the four tests again");
  }
  if (!any) {
    double voltage = 0.0;
    double travel = 0.0;
    for (const PreparedRun& run : prepared.runs) {
      for (const double value : run.run.voltage) {
        voltage = std::max(voltage, std::abs(value));
      }
      if (!run.run.position.empty()) {
        const auto [low, high] =
            std::minmax_element(run.run.position.begin(), run.run.position.end());
        travel = std::max(travel, *high - *low);
      }
    }
    return refusal(IdentificationError::no_motion, where)
        .hint(voltage < 0.1 ? "no voltage was applied either: the log was started but no test ran"
                            : "check that the encoder counts and that the mechanism is free")
        .with("largest voltage (V)", voltage)
        .with("largest travel (" + prepared.unit + ")", travel);
  }
  if (!ramps || !steps) {
    return refusal(IdentificationError::missing_tests, where,
                   ramps ? "dynamic tests (steps)" : "quasistatic tests (ramps)")
        .got("missing or without usable motion")
        .hint(ramps ? "ramps alone do not tell kA; record dynamic-forward and dynamic-reverse"
                    : "steps alone do not tell friction from speed; record quasistatic-forward and "
                      "quasistatic-reverse");
  }
  if (prepared.mechanism != MechanismKind::flywheel && !(forward && backward)) {
    return refusal(IdentificationError::missing_tests, where,
                   forward ? "motion in reverse" : "motion forward")
        .got("missing")
        .hint("in one direction alone friction and gravity are one number; record both directions");
  }
  return {};
}

Bounds make_bounds(const OutputErrorProblem& problem, const StartGains& start,
                   const FitOptions& options) {
  const Eigen::Index n = problem.parameters();
  constexpr double unbounded = 1e12;
  Bounds bounds{Eigen::VectorXd::Constant(n, -unbounded), Eigen::VectorXd::Constant(n, unbounded)};
  bounds.lower[parameter::static_friction] = 0.0;
  bounds.lower[parameter::velocity_gain] = 1e-3 * start.kV;
  bounds.upper[parameter::velocity_gain] = 1e3 * start.kV;
  bounds.lower[parameter::log_time_constant] = std::log(shortest_time_constant);
  bounds.upper[parameter::log_time_constant] = std::log(longest_time_constant);
  bounds.lower[parameter::headroom] = 0.1;
  bounds.lower[parameter::position_delay] = -0.04;
  bounds.upper[parameter::position_delay] = options.max_delay;
  bounds.lower[parameter::averaging_width] = 0.0;
  bounds.upper[parameter::averaging_width] = 0.3;
  bounds.lower[parameter::velocity_delay] = -0.04;
  bounds.upper[parameter::velocity_delay] = options.max_delay + 0.15;
  bounds.lower[parameter::velocity_scale] = 0.3;
  bounds.upper[parameter::velocity_scale] = 3.0;
  return bounds;
}

Eigen::VectorXd make_start(const OutputErrorProblem& problem, const StartGains& gains,
                           double time_constant) {
  const PreparedRecording& recording = problem.recording();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(problem.parameters());
  x[parameter::static_friction] = gains.kS;
  x[parameter::velocity_gain] = gains.kV;
  x[parameter::log_time_constant] = std::log(time_constant);
  x[parameter::gravity_cosine] = gains.gravity_cosine;
  x[parameter::gravity_sine] = gains.gravity_sine;
  x[parameter::headroom] = no_limit;
  x[parameter::position_delay] = recording.has_position ? 0.01 : 0.0;
  x[parameter::velocity_delay] = recording.has_velocity ? 0.03 : 0.0;
  x[parameter::averaging_width] = recording.has_velocity ? 0.03 : 0.0;
  x[parameter::velocity_scale] = recording.has_position && recording.has_velocity &&
                                         std::abs(recording.velocity_scale - 1.0) > 0.03
                                     ? recording.velocity_scale
                                     : 1.0;
  for (std::size_t i = 0; i < problem.runs().size(); ++i) {
    x[initial_velocity_of(i)] = problem.runs()[i].likely_initial_velocity;
  }
  return x;
}

/// A thinned problem decides between several time constants; the whole one is then solved with
/// scales and angles refreshed.
RobustFit fit_gains(OutputErrorProblem& problem, const StartGains& gains, const Bounds& bounds,
                    const FitOptions& options, ChannelScales& scales) {
  const std::vector<bool> free = problem.free_parameters();
  const double top = problem.recording().top_speed;
  scales = {problem.recording().has_position ? 0.02 * top * options.difference_span : 0.0,
            problem.recording().has_velocity ? 0.02 * top : 0.0};
  const std::size_t thinning = std::clamp<std::size_t>(problem.residuals() / 600, 1, 8);
  OutputErrorProblem thinned(problem.recording(), options, thinning);
  OutputErrorProblem& scout = thinned.runs().size() == problem.runs().size() ? thinned : problem;
  RobustFit best;
  int iterations = 0;
  for (const double time_constant : {0.03, 0.15, 0.7}) {
    RobustFit fit = minimize(scout, make_start(problem, gains, time_constant), free, bounds, scales,
                             std::min(15, options.max_iterations / 8), 1e-2);
    iterations += fit.iterations;
    if (best.x.size() == 0 || fit.cost < best.cost) {
      best = std::move(fit);
    }
  }
  for (int refresh = 0; refresh < scale_refreshes; ++refresh) {
    const bool last = refresh + 1 == scale_refreshes;
    problem.refresh_forces(best.x);
    scales = residual_scales(problem, best.x);
    best = minimize(problem, best.x, free, bounds, scales,
                    std::max(1, std::min(last ? 60 : 20, options.max_iterations - iterations)),
                    last ? 1e-3 : 0.1);
    iterations += best.iterations;
  }
  best.iterations = iterations;
  return best;
}

/// What the simulation says about each run, and how well.
void add_runs(OutputErrorProblem& problem, const Eigen::VectorXd& x, FeedforwardFit& fit) {
  const PreparedRecording& recording = problem.recording();
  fit.runs.resize(recording.runs.size());
  for (std::size_t i = 0; i < recording.runs.size(); ++i) {
    fit.runs[i].kind = recording.runs[i].run.kind;
    fit.runs[i].source = recording.runs[i].source;
  }
  double squared_error = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  std::vector<double> velocity_residuals;
  std::vector<double> difference_residuals;
  ResidualBlock block;
  for (std::size_t index = 0; index < problem.runs().size(); ++index) {
    const ResidualRun& run = problem.runs()[index];
    const PreparedRun& prepared = recording.runs[run.prepared];
    problem.evaluate(index, x, false, block);
    difference_residuals.insert(difference_residuals.end(), block.difference.begin(),
                                block.difference.end());
    FittedRun& fitted = fit.runs[run.prepared];
    fitted.used = true;
    std::vector<double> offsets;
    for (std::size_t row = prepared.first; row < prepared.last; ++row) {
      const double time = prepared.run.time[row];
      fitted.time.push_back(time);
      fitted.voltage.push_back(prepared.run.voltage[row]);
      fitted.velocity.push_back(recording.has_velocity ? prepared.run.velocity[row]
                                                       : prepared.smoothed_velocity[row]);
      fitted.velocity_hat.push_back(problem.velocity_shown(index, x, time));
      fitted.velocity_residual.push_back(fitted.velocity.back() - fitted.velocity_hat.back());
      if (recording.has_position) {
        fitted.position.push_back(prepared.run.position[row]);
        fitted.position_hat.push_back(problem.position_shown(index, x, time));
        offsets.push_back(fitted.position.back() - fitted.position_hat.back());
      }
      squared_error += fitted.velocity_residual.back() * fitted.velocity_residual.back();
      sum += fitted.velocity.back();
      squares += fitted.velocity.back() * fitted.velocity.back();
      count += 1.0;
    }
    velocity_residuals.insert(velocity_residuals.end(), fitted.velocity_residual.begin(),
                              fitted.velocity_residual.end());
    const double offset = median(std::move(offsets));
    for (double& position : fitted.position_hat) {
      position += offset;
    }
  }
  const double variance = squares - sum * sum / std::max(1.0, count);
  fit.r_squared = variance > 0.0 ? 1.0 - squared_error / variance : 0.0;
  fit.velocity_nrmse = variance > 0.0 ? std::sqrt(squared_error / variance) : 0.0;
  fit.velocity_noise = mad_scale(velocity_residuals);
  fit.position_noise = mad_scale(difference_residuals) / std::sqrt(2.0);
}

/// @param whole  Whether steps may still have an irregular start.
Expected<FeedforwardFit> fit_prepared(const PreparedRecording& prepared, const FitOptions& options,
                                      bool whole, std::vector<Diagnostic>& diagnostics) {
  if (!prepared.mechanism) {
    return refusal(IdentificationError::unknown_mechanism, where)
        .hint("say which: flywheel, elevator or arm");
  }
  FLYBALL_CHECK(check_tests(prepared));
  if (*prepared.mechanism == MechanismKind::arm && !prepared.has_position) {
    return refusal(IdentificationError::singular, where, "the position")
        .got("missing or constant")
        .expected("the arm's angle, which its gravity depends on");
  }
  FLYBALL_TRY(auto gains, regress_gains(prepared));
  OutputErrorProblem problem(prepared, options);
  if (problem.residuals() < 10 * static_cast<std::size_t>(problem.parameters())) {
    return refusal(IdentificationError::too_short, where)
        .hint("record longer tests")
        .with("usable values", static_cast<double>(problem.residuals()));
  }
  const Bounds bounds = make_bounds(problem, gains, options);
  ChannelScales scales;
  RobustFit best = fit_gains(problem, gains, bounds, options, scales);
  Extension extension;
  if (options.extend) {
    extension = extend_model(problem, bounds, scales, best);
  }
  if (extension.extended) {
    scales = residual_scales(problem, best.x);
    const int iterations = best.iterations;
    best = minimize(problem, best.x, problem.free_parameters(), bounds, scales, 60, 1e-3);
    best.iterations += iterations;
  }
  if (const auto later = whole ? without_irregular_starts(problem, best.x) : std::nullopt) {
    FitOptions closer = options;
    closer.settling = std::max(
        0.01, best.x[parameter::velocity_delay] + 0.5 * best.x[parameter::averaging_width]);
    std::vector<Diagnostic> found;
    auto fit = fit_prepared(later->recording, closer, false, found);
    if (fit) {
      warn(diagnostics, "backlash",
           "the speed of {} does not rise as an inertia's does, by up to {:.0f} times the noise: "
           "backlash or elasticity between the encoder and the load, or a stop that it leaves. The "
           "first {:.0f} ms were left out; a controller should not count on the load's moving "
           "before",
           later->steps == 1 ? "one step" : detail::format("{} steps", later->steps), later->excess,
           1e3 * later->longest);
      diagnostics.insert(diagnostics.end(), found.begin(), found.end());
      return fit;
    }
  }
  Covariances spread = covariances(problem, best.x, problem.free_parameters(), bounds, scales);
  spread.doubt = std::move(extension.doubt);

  FeedforwardFit fit;
  fit.mechanism = *prepared.mechanism;
  fit.unit = prepared.unit;
  fit.iterations = best.iterations;
  fit.residuals = problem.residuals();
  fit.position_delay = best.x[parameter::position_delay];
  fit.velocity_delay = best.x[parameter::velocity_delay];
  fit.averaging_width = best.x[parameter::averaging_width];
  fit.velocity_scale = best.x[parameter::velocity_scale];
  add_runs(problem, best.x, fit);
  FLYBALL_CHECK(estimate_gains(prepared, best.x, spread, bounds, fit));
  FLYBALL_CHECK(check_plausibility(prepared, fit, diagnostics));
  fit.terms = estimate_terms(problem, best, spread);
  if (auto one_step = fit_one_step(prepared)) {
    fit.one_step = *std::move(one_step);
  }
  if (!fit.kA.determined) {
    // A speed-up within one sensor value leaves no trace of its own that could bound it further.
    const double refresh =
        std::max(prepared.position_refresh_period, prepared.velocity_refresh_period);
    fit.kA.upper_bound = std::max({fit.kA.value, refresh * fit.kV.value,
                                   inertia_ceiling(problem, best, bounds, scales, spread)});
    fit.kA.interval = {0.0, fit.kA.upper_bound};
  } else {
    compare_channels(problem, best, bounds, scales, diagnostics);
  }
  compare_repeats(fit, diagnostics);
  detect_elasticity(prepared, fit, diagnostics);
  report_terms(fit, diagnostics);
  report_fit(prepared, fit, diagnostics);
  return fit;
}

}  // namespace

FitReport identify_feedforward(const Recording& recording, const FitOptions& options) {
  PreparationOptions preparation = options.preparation;
  if (options.mechanism) {
    preparation.mechanism = options.mechanism;
  }
  auto prepared = prepare(recording, preparation);
  if (!prepared) {
    return {{}, {}, tl::unexpected(std::move(prepared).error())};
  }
  FitReport report{*std::move(prepared), {}, refusal(IdentificationError::no_data)};
  report.diagnostics = report.prepared.diagnostics;
  report.fit = fit_prepared(report.prepared, options, true, report.diagnostics);
  return report;
}

Expected<FeedforwardFit> fit_feedforward(const Recording& recording, const FitOptions& options) {
  return identify_feedforward(recording, options).fit;
}

}  // namespace flyball::identification
