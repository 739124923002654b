#include <flyball/identification/feedforward_fit.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/identification/mechanism_choice.hpp>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/channels.hpp"
#include "identification/cross_checks.hpp"
#include "identification/estimates.hpp"
#include "identification/gain_fit.hpp"
#include "identification/long_runs.hpp"
#include "identification/model_terms.hpp"
#include "identification/output_error.hpp"
#include "identification/plausibility.hpp"
#include "identification/record_noise.hpp"
#include "identification/robust_fit.hpp"
#include "identification/settling.hpp"
#include "identification/statistics.hpp"
#include "identification/test_coverage.hpp"

namespace flyball::identification {
namespace {

using mechanisms::MechanismKind;

constexpr std::string_view in_identify = "identify";

std::string named(MechanismKind kind) {
  return std::string(has_gravity(kind) ? "an " : "a ") + std::string(to_string(kind));
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
    problem.evaluate(index, x, block);
    difference_residuals.insert(difference_residuals.end(), block.difference.begin(),
                                block.difference.end());
    FittedRun& fitted = fit.runs[run.prepared];
    fitted.used = true;
    std::vector<double> offsets;
    const std::vector<std::size_t>& fresh =
        recording.has_velocity ? prepared.fresh_velocity : prepared.fresh_position;
    for (std::size_t row = prepared.first; row < prepared.last; ++row) {
      const double time = prepared.run.time[row];
      fitted.time.push_back(time);
      fitted.voltage.push_back(prepared.run.voltage[row]);
      fitted.velocity.push_back(recording.has_velocity ? prepared.run.velocity[row]
                                                       : prepared.smoothed_velocity[row]);
      if (recording.has_velocity) {
        fitted.velocity_hat.push_back(problem.velocity_shown(index, x, time));
      } else {
        // As the measured one is derived: over the same time, as far as rows reach.
        const double from = std::max(time - smoothing_half_width, prepared.run.time.front());
        const double to = std::min(time + smoothing_half_width, prepared.run.time.back());
        fitted.velocity_hat.push_back(
            (problem.position_shown(index, x, to) - problem.position_shown(index, x, from)) /
            std::max(1e-3, to - from));
      }
      fitted.velocity_residual.push_back(fitted.velocity.back() - fitted.velocity_hat.back());
      if (recording.has_position) {
        fitted.position.push_back(prepared.run.position[row]);
        fitted.position_hat.push_back(problem.position_shown(index, x, time));
        offsets.push_back(fitted.position.back() - fitted.position_hat.back());
      }
      if (!std::binary_search(fresh.begin(), fresh.end(), row)) {
        continue;
      }
      fitted.fresh.push_back(row - prepared.first);
      velocity_residuals.push_back(fitted.velocity_residual.back());
      squared_error += fitted.velocity_residual.back() * fitted.velocity_residual.back();
      sum += fitted.velocity.back();
      squares += fitted.velocity.back() * fitted.velocity.back();
      count += 1.0;
    }
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
  FLYBALL_TRY(const TestCoverage coverage, cover_tests(prepared));
  if (*prepared.mechanism == MechanismKind::arm && !prepared.has_position) {
    return refusal(IdentificationError::singular, in_identify, "the position")
        .got("missing or constant")
        .expected("the arm's angle, which its gravity depends on");
  }
  FLYBALL_TRY(auto gains, regress_gains(prepared));
  OutputErrorProblem problem(prepared, options);
  if (problem.residuals() < 10 * static_cast<std::size_t>(problem.parameters())) {
    return refusal(IdentificationError::too_short, in_identify)
        .hint("record longer tests")
        .with("usable values", static_cast<double>(problem.residuals()));
  }
  const Bounds bounds = make_bounds(problem, gains, options);
  ChannelScales scales;
  RobustFit best = fit_gains(problem, gains, bounds, options, scales);
  Extension extension;
  if (options.extend) {
    const RobustFit plain = best;
    extension = extend_model(problem, bounds, scales, best, true);
    // Where backlash leaves the starts as odd as they were, it is not what is odd about them.
    if (whole && problem.is_extended(parameter::take_up) &&
        without_irregular_starts(problem, best.x)) {
      problem.take_terms_out();
      problem.refresh_forces(plain.x);
      best = plain;
      extension = extend_model(problem, bounds, scales, best, false);
    }
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
  Bounds known = bounds;
  const bool frictionless = problem.free_parameters()[parameter::static_friction] &&
                            best.x[parameter::static_friction] <= 0.0;
  if (coverage.one_way() || frictionless) {
    // Friction that a bound held would lend its certainty to what trades with it.
    known.lower[parameter::static_friction] = -1.0;
  }
  const RecordNoise noise = estimate_record_noise(problem, best.x, scales);
  Covariances spread =
      covariances(problem, best.x, problem.free_parameters(), known, scales, &noise);
  spread.doubts = std::move(extension.doubts);

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
  if (frictionless) {
    fit.kS.upper_bound = std::max(1e-3, friction_ceiling(problem, best, bounds, scales, spread));
    fit.kS.interval = {0.0, fit.kS.upper_bound};
  }
  estimate_what_tests_leave(coverage, problem, best.x, spread, fit);
  FLYBALL_CHECK(check_plausibility(prepared, fit, diagnostics));
  fit.terms = estimate_terms(problem, best, spread);
  if (auto one_step = fit_one_step(prepared)) {
    fit.one_step = *std::move(one_step);
  }
  if (!fit.kA.determined && coverage.steps) {
    // A speed-up within one sensor value leaves no trace of its own that could bound it further.
    const double refresh =
        std::max(prepared.position_refresh_period, prepared.velocity_refresh_period);
    fit.kA.upper_bound = std::max({fit.kA.value, refresh * fit.kV.value,
                                   inertia_ceiling(problem, best, bounds, scales, spread)});
    fit.kA.interval = {0.0, fit.kA.upper_bound};
  } else if (coverage.steps) {
    compare_channels(problem, best, bounds, scales, diagnostics);
  }
  compare_repeats(fit, diagnostics);
  detect_elasticity(prepared, fit, diagnostics);
  report_terms(fit, diagnostics);
  report_open_terms(extension, fit, diagnostics);
  report_fit(prepared, fit, diagnostics);
  return fit;
}

/// Puts the kind that the data tell into a recording that leaves it open.
Expected<void> propose_mechanism(PreparedRecording& prepared, const FitOptions& options,
                                 std::vector<Diagnostic>& diagnostics) {
  FLYBALL_TRY(const MechanismChoice choice, choose_mechanism(prepared, options));
  const bool angles = prepared.unit == "rad";
  if (choice.fitting.size() == 1) {
    prepared.mechanism = choice.fitting.front();
    std::vector<Diagnostic> first;
    warn(first, "mechanism_assumed",
         "the log does not say what its mechanism is, and it is taken for {}: {} (say it with "
         "--mechanism)",
         named(*prepared.mechanism), choice.evidence);
    diagnostics.insert(diagnostics.begin(), first.front());
    return {};
  }
  std::string kinds;
  std::string options_text;
  for (std::size_t i = 0; i < choice.fitting.size(); ++i) {
    const MechanismKind kind = choice.fitting[i];
    const bool drum = kind == MechanismKind::elevator && angles;
    const std::string_view between = i == 0 ? "" : i + 1 == choice.fitting.size() ? " or " : ", ";
    kinds += detail::format("{}{}{}", i == 0 ? "" : " and ", named(kind),
                            drum ? " in angles of its drum" : "");
    options_text +=
        detail::format("{}--mechanism {}{}", between, to_string(kind),
                       drum ? " with the metres a rotation (or radian) in --scale" : "");
  }
  Error error = refusal(IdentificationError::unknown_mechanism, in_identify)
                    .got("data that fit " + kinds + ": " + choice.evidence)
                    .hint("say which, with " + options_text);
  for (const KindEvidence& compared : choice.compared) {
    error = std::move(error).with(
        detail::format("simulated velocity misses as {} (%)", named(compared.kind)),
        100.0 * compared.nrmse);
  }
  return tl::unexpected(std::move(error));
}

/// What was said of the mechanism, against the data: only where something makes it doubtful, as
/// it costs three fits.
void doubt_mechanism(const PreparedRecording& prepared, const FitOptions& options,
                     const Expected<FeedforwardFit>& fit, std::vector<Diagnostic>& diagnostics) {
  const MechanismKind said = *prepared.mechanism;
  const bool unexplained = !fit && (fit.error().is(IdentificationError::unphysical_gains) ||
                                    fit.error().is(IdentificationError::singular));
  const bool beyond_gains = fit && (!fit->terms.empty() || fit->velocity_nrmse > 0.1);
  if (said == MechanismKind::elevator || (!unexplained && !beyond_gains)) {
    return;
  }
  const auto choice = choose_mechanism(prepared, options);
  // Without gravity one model is that of every kind.
  const auto model = [](MechanismKind kind) {
    return has_gravity(kind) ? kind : MechanismKind::flywheel;
  };
  if (!choice || std::any_of(choice->fitting.begin(), choice->fitting.end(),
                             [&](MechanismKind kind) { return model(kind) == model(said); })) {
    return;
  }
  const auto winner =
      std::find_if(choice->compared.begin(), choice->compared.end(),
                   [&](const KindEvidence& k) { return k.kind == model(choice->fitting.front()); });
  // A travel alone contradicts nothing, nor does a force that friction of one direction may be.
  const bool steady = winner->kind == MechanismKind::elevator;
  constexpr double clear = 24.0;
  if (winner->kind == MechanismKind::flywheel ||
      (winner->evidence >= clear && !(steady && fit && winner->gravity <= fit->kS.value))) {
    std::vector<Diagnostic> first;
    warn(first, "mechanism_contradicted",
         "the data are those of {}, not of {} as was said: {} (say what it is with --mechanism)",
         named(choice->fitting.front()), named(said), choice->evidence);
    diagnostics.insert(diagnostics.begin(), first.front());
  }
}

}  // namespace

FitReport identify_feedforward(const Recording& recording, const FitOptions& options) {
  PreparationOptions preparation = options.preparation;
  if (options.mechanism) {
    preparation.mechanism = options.mechanism;
  }
  std::vector<Diagnostic> of_length;
  const auto coarse = at_coarser_rows(recording, of_length);
  auto prepared = prepare(coarse ? *coarse : recording, preparation);
  if (!prepared) {
    return {{}, {}, tl::unexpected(std::move(prepared).error())};
  }
  FitReport report{*std::move(prepared), {}, refusal(IdentificationError::no_data)};
  report.diagnostics = report.prepared.diagnostics;
  auto part = representative_part(report.prepared, of_length);
  report.diagnostics.insert(report.diagnostics.end(), of_length.begin(), of_length.end());
  PreparedRecording& fitted = part ? *part : report.prepared;
  const bool said = fitted.mechanism.has_value();
  if (!said) {
    if (auto proposed = propose_mechanism(fitted, options, report.diagnostics); !proposed) {
      report.fit = tl::unexpected(std::move(proposed).error());
      return report;
    }
    report.prepared.mechanism = fitted.mechanism;
  }
  report.fit = fit_prepared(fitted, options, true, report.diagnostics);
  if (said) {
    doubt_mechanism(fitted, options, report.fit, report.diagnostics);
  }
  if (report.fit) {
    join_stretches(*report.fit);
  }
  return report;
}

Expected<FeedforwardFit> fit_feedforward(const Recording& recording, const FitOptions& options) {
  return identify_feedforward(recording, options).fit;
}

}  // namespace flyball::identification
