#include <flyball/study/design.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/study/project.hpp>
#include <flyball/study/simulate_design.hpp>

#include "core/diagnose.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "study/design_steps.hpp"
#include "study/field.hpp"
#include "study/told.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

constexpr std::string_view where = "design";

void fill_defaults(DesignJob& job, std::vector<Diagnostic>& diagnostics) {
  if (!job.controller.delay) {
    job.controller.delay = 0.0;
    note(diagnostics, "assumed",
         "no delay was given: the loop is designed for none (set controller.delay if the sensor is "
         "late)");
  }
  if (!job.estimator.measurement_std) {
    job.estimator.measurement_std = measurement_std(job);
    note(diagnostics, "assumed", "the sensor's noise is taken as {} {}{} a sample",
         format_number(*job.estimator.measurement_std, 3), job.plant.unit,
         job.plant.kind == MechanismKind::flywheel ? "/s" : "");
  }
}

// Of tolerances from tight to loose, takes those that leave comfortable margins and the stiffest
// loop. The tightest comfortable ones may not be the best: the compensation of a long delay (B.12)
// turns an aggressive gain into nearly none.
Expected<LoopDesign> search_tolerances(const LinearModel& model, DesignJob& job,
                                       std::vector<Diagnostic>& diagnostics) {
  const std::vector<double> start =
      default_tolerances(job.plant, static_cast<std::size_t>(model.A.rows()));
  constexpr int steps = 40;
  constexpr double step = 1.25;
  std::optional<LoopDesign> best;
  std::vector<double> best_tolerances;
  std::optional<Error> last;
  double factor = 1.0;
  for (int i = 0; i < steps; ++i, factor *= step) {
    std::vector<double> tolerances = start;
    for (double& tolerance : tolerances) {
      tolerance *= factor;
    }
    auto loop = design_loop(model, job, tolerances);
    if (!loop) {
      last = std::move(loop).error();
      continue;
    }
    if (is_comfortable(*loop) && (!best || loop->K_delayed(0, 0) > best->K_delayed(0, 0))) {
      best = *std::move(loop);
      best_tolerances = std::move(tolerances);
    }
  }
  if (!best && last) {
    return tl::unexpected(*std::move(last));
  }
  if (!best) {
    return refusal(DesignError::margins_lost, where, "the loop")
        .got(fmt::format("without margins at any tolerance with a delay of {} ms",
                         format_number(1e3 * job.controller.delay.value_or(0.0), 3)))
        .hint("shorten the delay or the period");
  }
  std::vector<std::string> words;
  for (std::size_t k = 0; k < best_tolerances.size(); ++k) {
    words.push_back(
        fmt::format("{} for {}", format_number(best_tolerances[k], 3), label(model.states[k])));
  }
  note(diagnostics, "assumed",
       "no tolerances were given: with {} the loop is the stiffest that keeps a gain margin of 2, "
       "a phase margin of 45° and ±20 % of inertia and gain",
       fmt::join(words, ", "));
  job.controller.state_tolerance = std::move(best_tolerances);
  return *std::move(best);
}

void add_margin_warnings(const LoopDesign& loop, const DesignJob& job,
                         std::vector<Diagnostic>& diagnostics) {
  if (!loop.margins.stable || is_comfortable(loop)) {
    return;
  }
  warn(diagnostics, "thin_margins",
       "the tolerances leave a gain margin of {}, a phase margin of {}° and {} over ±20 % of "
       "inertia and gain with {} ms of delay; looser tolerances are safer",
       format_number(loop.margins.gain_margin_up, 3), format_number(loop.margins.phase_margin, 3),
       loop.robustness.all_stable ? "stability" : "no stability",
       format_number(1e3 * job.controller.delay.value_or(0.0), 3));
}

Expected<void> simulate_response(DesignResult& result) {
  FLYBALL_TRY(auto simulated,
              simulate_design(result, {.measurement_noise = *result.job.estimator.measurement_std,
                                       .seed = result.job.seed}));
  result.response = std::move(simulated.series);
  result.tracking_error_rms = simulated.rms_error;
  result.tracking_error_max = simulated.max_error;
  return {};
}

/// @param result  What is there when it fails tells what was noticed.
Expected<void> design_into(DesignResult& result, const DesignJob& requested) {
  FLYBALL_CHECK(check_ranges(project_of(requested), where));
  result.job = requested;
  DesignJob& job = result.job;
  fill_defaults(job, result.diagnostics);
  FLYBALL_CHECK(check_delay(*job.controller.delay, job.controller.period, where));

  FLYBALL_TRY(auto motion, fastest_motion(job));
  result.motion = motion;

  FLYBALL_TRY(auto model, linear_model(job.plant, job.controller.period));
  result.velocity_servo = !job.plant.kA_determined;
  if (result.velocity_servo) {
    result.diagnostics.push_back(unknown_kA(job.plant.kind));
  }
  const bool chosen = job.controller.state_tolerance.empty();
  // A person's tolerances are per position and velocity; a plant without kA has one state of them.
  if (!chosen && result.velocity_servo && job.controller.state_tolerance.size() == 2) {
    job.controller.state_tolerance.resize(1);
  }
  FLYBALL_TRY(const LoopDesign loop, chosen
                                         ? search_tolerances(model, job, result.diagnostics)
                                         : design_loop(model, job, job.controller.state_tolerance));
  if (!loop.margins.stable) {
    return refusal(DesignError::margins_lost, where, "the loop")
        .got(fmt::format("unstable with its delay of {} ms",
                         format_number(1e3 * job.controller.delay.value_or(0.0), 3)))
        .hint("loosen controller.state_tolerance, or leave it out to have it chosen")
        .with("spectral_radius", loop.margins.spectral_radius);
  }
  if (!chosen) {
    add_margin_warnings(loop, job, result.diagnostics);
  }
  if (loop.whole_periods) {
    warn(result.diagnostics, "delay_rounded",
         "the delay was compensated in whole periods: the closed loop has a negative real pole, of "
         "which no real fraction of a period exists");
  }

  result.states = model.states;
  result.A_continuous = model.A;
  result.B_continuous = model.B;
  result.A = model.discrete.A;
  result.B = model.discrete.B;
  result.C = model.discrete.C;
  result.Q = loop.Q;
  result.R = loop.R;
  result.K = loop.K;
  result.K_delayed = loop.K_delayed;
  result.poles = loop.poles;
  result.kalman_gain = loop.kalman_gain;
  result.estimator_poles = loop.estimator_poles;
  result.inversion = loop.inversion;

  const StabilityMargins& margins = loop.margins;
  double crossover = 0.0;
  for (const Crossover& crossing : margins.gain_crossovers) {
    crossover = std::max(crossover, crossing.frequency);
  }
  result.margins = {.gain_margin = margins.gain_margin_up,
                    .gain_reduction = margins.gain_margin_down,
                    .phase_margin = margins.phase_margin * std::numbers::pi / 180.0,
                    .delay_margin = margins.delay_margin,
                    .disk_margin = margins.disk_margin,
                    .crossover = crossover};
  for (const RobustnessCase& point : loop.robustness.cases) {
    result.robustness.push_back({.inertia_factor = point.inertia,
                                 .gain_factor = point.gain,
                                 .stable = point.stable,
                                 .spectral_radius = point.spectral_radius,
                                 .overshoot = point.overshoot});
  }
  result.robust = loop.robustness.all_stable;
  result.worst_overshoot = loop.robustness.worst_overshoot;

  if (!job.plant.motor && job.battery.resistance != BatteryOptions{}.resistance) {
    warn(result.diagnostics, "not_used",
         "battery.resistance is not used: without a motor no current is known (set "
         "mechanism.motor)");
  }
  result.paste = paste_gains(job.plant, result.K_delayed);
  FLYBALL_CHECK(simulate_response(result));
  return {};
}

}  // namespace

ErrorInfo error_info(DesignError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"gravity_too_strong", "the motor cannot hold the mechanism", ErrorKind::no_answer},
      {"no_motion_possible", "the motor cannot move the mechanism", ErrorKind::no_answer},
      {"margins_lost", "the loop cannot be made robust", ErrorKind::no_answer},
  };
  return flyball::detail::info_of(code, "design", rows);
}

ExpectedAll<DesignResult> design(const DesignJob& job) {
  DesignResult result;
  if (auto done = design_into(result, job); !done) {
    return refused(where, std::move(done).error(), std::move(result.diagnostics));
  }
  return result;
}

}  // namespace flyball::study
