#include <flyball/study/design.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/study/project.hpp>
#include <flyball/study/simulate_design.hpp>

#include "core/diagnose.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/design_steps.hpp"
#include "study/field.hpp"
#include "study/told.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

constexpr std::string_view in_design = "design";

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
         controls_velocity(job.plant.kind) ? "/s" : "");
  }
}

// What the grid varies, in words.
std::string varied(const DesignJob& job) {
  const PlantDescription& plant = job.plant;
  const std::string_view delay = predicts_delay(job) ? ", and ±25 % of the delay" : "";
  if (plant.kA_determined) {
    return fmt::format("±20 % of inertia and gain{}", delay);
  }
  return plant.kA_upper_bound > 0.0
             ? fmt::format("±20 % of gain with a kA from 0 to {} V·s²/{}{}",
                           format_number(plant.kA_upper_bound, 3), plant.unit, delay)
             : fmt::format("±20 % of gain without inertia{}", delay);
}

void tell_tolerances(const LoopDesign& loop, const LinearModel& model, const DesignJob& job,
                     std::vector<Diagnostic>& diagnostics) {
  note(diagnostics, "assumed",
       "no tolerances were given: with {} the loop is the stiffest that keeps a gain margin of 2, "
       "a phase margin of 45° and {}",
       tolerances_text(model, loop.tolerances), varied(job));
}

void add_margin_warnings(const LoopDesign& loop, const DesignJob& job,
                         std::vector<Diagnostic>& diagnostics) {
  if (is_comfortable(loop)) {
    return;
  }
  warn(diagnostics, "thin_margins",
       "the tolerances leave a gain margin of {}, a phase margin of {}° and {} over {} with {} "
       "of delay; looser tolerances are safer",
       format_number(loop.margins.gain_margin_up, 3), format_number(loop.margins.phase_margin, 3),
       !loop.robust    ? "no stability"
       : loop.predicts ? fmt::format("stability with an overshoot of up to {}",
                                     text::percent(loop.worst_overshoot, 2))
                       : "stability",
       varied(job), text::seconds(job.controller.delay.value_or(0.0)));
}

LoopMargins margins_of(const LoopDesign& loop, bool feedback) {
  if (!feedback) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    return {none, none, none, none, none, none};
  }
  const StabilityMargins& margins = loop.margins;
  double crossover = 0.0;
  for (const Crossover& crossing : margins.gain_crossovers) {
    crossover = std::max(crossover, crossing.frequency);
  }
  return {.gain_margin = margins.gain_margin_up,
          .gain_reduction = margins.gain_margin_down,
          .phase_margin = margins.phase_margin * std::numbers::pi / 180.0,
          .delay_margin = margins.delay_margin,
          .disk_margin = margins.disk_margin,
          .crossover = crossover};
}

// A delay that can be predicted over: each period of it is a state of the loop whose eigenvalues
// are told, and of the regulator's model.
Expected<void> check_prediction(const DesignJob& job) {
  constexpr double most_periods = 50.0;
  const double T = job.controller.period;
  if (!predicts_delay(job) || *job.controller.delay <= most_periods * T) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, in_design, "controller.delay")
      .got(fmt::format("{} with controller.predict_delay", text::seconds(*job.controller.delay)))
      .expected(fmt::format("at most {} periods, {}, to be predicted over",
                            format_number(most_periods), text::seconds(most_periods * T)))
      .hint("leave controller.predict_delay out, or lengthen the period");
}

// The gain for controllers that cannot predict: of the stiffest comfortable loop that does not.
Eigen::MatrixXd gain_to_paste(const LoopDesign& loop, const LinearModel& model,
                              const DesignJob& job, std::vector<Diagnostic>& diagnostics) {
  if (!loop.predicts) {
    return loop.K_delayed;
  }
  DesignJob plain = job;
  plain.controller.predict_delay = false;
  std::vector<double> tolerances;
  const auto other = search_tolerances(model, plain, tolerances);
  note(diagnostics, "paste_without_prediction",
       "other tools' controllers cannot predict over the delay: their constants {}",
       other ? fmt::format("are those of a loop with the delay compensated in its gain and "
                           "tolerances of {}",
                           tolerances_text(model, tolerances))
             : std::string("have no feedback, since no gain without a prediction has margins"));
  return other ? other->K_delayed : Eigen::MatrixXd::Zero(loop.K.rows(), loop.K.cols());
}

// A gain that makes no difference is none: rounding does not decide what is said of it. `K` stays,
// as the tolerances' without delay.
void leave_out_feedback(LoopDesign& loop) {
  loop.K_delayed.setZero();
  loop.regulator.K.setZero();
  loop.robustness.clear();
  loop.robust = true;
  loop.worst_overshoot = 0.0;
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
  FLYBALL_CHECK(check_ranges(project_of(requested), in_design));
  result.job = requested;
  DesignJob& job = result.job;
  result.diagnostics = job.plant.doubts;
  fill_defaults(job, result.diagnostics);
  FLYBALL_CHECK(check_delay(*job.controller.delay, job.controller.period, in_design));
  FLYBALL_CHECK(check_prediction(job));

  FLYBALL_TRY(auto motion, fastest_motion(job));
  result.motion = motion;

  FLYBALL_TRY(auto model, linear_model(job.plant, job.controller.period));
  result.velocity_servo = !job.plant.kA_determined;
  if (result.velocity_servo) {
    result.diagnostics.push_back(unknown_kA(job.plant));
    if (!(job.plant.kA_upper_bound > 0.0)) {
      warn(result.diagnostics, "kA_not_bounded",
           "nothing is known of kA, not even an upper bound: the loop was checked for a mechanism "
           "without inertia alone, and a heavy one may overshoot or be unstable (set gains.kA or "
           "gains.kA_upper_bound)");
    }
  }
  const bool chosen = job.controller.state_tolerance.empty();
  // A person's tolerances are per position and velocity; a plant without kA has one state of them.
  if (!chosen && result.velocity_servo && job.controller.state_tolerance.size() == 2) {
    job.controller.state_tolerance.resize(1);
  }
  FLYBALL_TRY(LoopDesign loop, chosen
                                   ? search_tolerances(model, job, job.controller.state_tolerance)
                                   : design_loop(model, job, job.controller.state_tolerance));
  FLYBALL_TRY(result.no_feedback, why_no_feedback(loop, model, job));
  result.feedback = result.no_feedback.empty();
  if (!loop.stable && result.feedback) {
    return refusal(DesignError::margins_lost, in_design, "the loop")
        .got(fmt::format("unstable with its delay of {}",
                         text::seconds(job.controller.delay.value_or(0.0))))
        .hint("loosen controller.state_tolerance, or leave it out to have it chosen")
        .with("spectral_radius", loop.margins.spectral_radius);
  }
  if (!result.feedback) {
    leave_out_feedback(loop);
  }
  FLYBALL_TRY(result.loop, behavior_of(loop, model, job));
  if (!result.feedback) {
    warn(result.diagnostics, "no_feedback",
         "there is no feedback, feedforward alone drives the {}: {}; an error of the model stays "
         "as one of the {}",
         job.plant.name.empty() ? to_string(job.plant.kind) : job.plant.name, result.no_feedback,
         controls_velocity(job.plant.kind) ? "speed" : "position");
  } else if (chosen) {
    tell_tolerances(loop, model, job, result.diagnostics);
  } else {
    add_margin_warnings(loop, job, result.diagnostics);
  }
  if (result.feedback) {
    FLYBALL_TRY(result.proofs, proofs_of(loop, job));
    FLYBALL_TRY(result.frequency_response, frequency_response(loop, model, job));
  }
  FLYBALL_CHECK(tell_cost_of_delay(loop, result.loop, result.feedback, model, job, chosen,
                                   result.diagnostics));
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
  result.predicts = loop.predicts;
  result.poles = loop.poles;
  result.kalman_gain = loop.kalman_gain;
  result.estimator_poles = loop.estimator_poles;
  result.inversion = loop.inversion;

  result.margins = margins_of(loop, result.feedback);
  result.robustness = loop.robustness;
  result.robust = loop.robust;
  result.worst_overshoot = loop.worst_overshoot;

  if (!job.plant.motor && job.battery.resistance != BatteryOptions{}.resistance) {
    warn(result.diagnostics, "not_used",
         "battery.resistance is not used: without a motor no current is known (set "
         "mechanism.motor)");
  }
  if (job.controller.predict_delay.value_or(false) && !loop.predicts) {
    warn(result.diagnostics, "not_used",
         "controller.predict_delay is not used: there is no delay (set controller.delay)");
  }
  result.paste = paste_gains(job.plant, gain_to_paste(loop, model, job, result.diagnostics));
  if (result.feedback) {
    result.paste_on_board = on_board_gains(job);
  }
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
    return refused(in_design, std::move(done).error(), std::move(result.diagnostics));
  }
  return result;
}

}  // namespace flyball::study
