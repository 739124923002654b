#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/classical/frequency_response.hpp>
#include <flyball/control/running_loop.hpp>
#include <flyball/math/dense/linear_algebra.hpp>

#include "control/sampled_loop.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/design_steps.hpp"

// What a designed loop does when it runs, and what its delay costs.
namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

// What the loop is shown on: the model; without kA a mechanism with the upper bound.
Expected<ContinuousSystem<>> shown_plant(const LinearModel& model, const DesignJob& job) {
  FLYBALL_TRY(auto plants, possible_plants(model, job.plant));
  return std::move(plants.back().system);
}

Time delay_of(const DesignJob& job) {
  return Time(job.controller.delay.value_or(0.0));
}

// What a step of the first reference adds to the input: the first column of K + B⁺ (I - A).
Eigen::MatrixXd step_input(const LinearModel& model, const Eigen::MatrixXd& K,
                           const Eigen::MatrixXd& inversion) {
  const Eigen::Index n = model.discrete.A.rows();
  const Eigen::MatrixXd I_A = Eigen::MatrixXd::Identity(n, n) - model.discrete.A;
  return (K + inversion * I_A).leftCols(1);
}

// By which of a loop's times a delay's cost is told.
struct Slowness {
  double before = 0.0;  // s, without delay
  double now = 0.0;
  bool by_step = false;  // Of the rise of a step, not of the slowest eigenvalue.

  [[nodiscard]] double of(const LoopBehavior& behavior) const {
    return by_step ? behavior.rise_time.value_or(std::numeric_limits<double>::infinity())
                   : behavior.time_constant;
  }
};

// Whether other designs are looked for: each period of delay is a state, and a search takes its
// time.
constexpr double most_periods = 40.0;
bool is_searched(const DesignJob& job) {
  return delay_of(job).si() <= most_periods * job.controller.period;
}

// What predicting over the delay would give, and how it is switched on; empty where it is not
// faster than that with comfortable margins.
Expected<std::string> with_prediction(const LoopDesign& loop, const LinearModel& model,
                                      const DesignJob& job, bool chosen, const Slowness& slowness,
                                      double clearly) {
  if (loop.predicts || !is_searched(job)) {
    return std::string();
  }
  DesignJob predicted = job;
  predicted.controller.predict_delay = true;
  std::vector<double> tolerances = loop.tolerances;
  std::string_view besides;
  std::optional<LoopDesign> other;
  if (!chosen) {
    if (auto same = design_loop(model, predicted, tolerances); same && is_comfortable(*same)) {
      other = *std::move(same);
    }
  }
  if (!other) {
    besides = chosen ? "" : " and leave controller.state_tolerance out";
    FLYBALL_TRY(other, search_tolerances(model, predicted, tolerances));
  }
  FLYBALL_TRY(const auto behavior, behavior_of(*other, model, predicted));
  if (!(slowness.of(behavior) < clearly)) {
    return std::string();
  }
  return fmt::format(
      "set controller.predict_delay = true (--predict-delay){}, and a regulator that knows the "
      "inputs on their way gives {} with {}, a gain margin of {} and a phase margin of {}°, and "
      "bears a delay that is off by 25 %",
      besides, text::seconds(slowness.of(behavior)), tolerances_text(model, tolerances),
      format_number(other->margins.gain_margin_up, 3),
      format_number(other->margins.phase_margin, 3));
}

// Whether the loop's gain makes a difference anywhere below Nyquist.
Expected<bool> has_feedback(const PredictingRegulator& regulator, const LinearModel& model,
                            const DesignJob& job) {
  const auto& [believed, K, K_e] = regulator;
  FLYBALL_TRY(const auto opened,
              observer_regulator_loop(model.A, model.B, model.C, believed, K, K_e, delay_of(job)));
  // A loop gain below a hundredth changes no error by more than a hundredth.
  constexpr double no_gain = 0.01;
  const double nyquist = std::numbers::pi / job.controller.period;
  for (double decade = -6.0; decade <= 0.0; decade += 0.125) {
    FLYBALL_TRY(const auto gain, loop_response(opened, nyquist * std::pow(10.0, decade)));
    if (std::abs(gain) >= no_gain) {
      return true;
    }
  }
  return false;
}

}  // namespace

Expected<LoopBehavior> behavior_of(const LoopDesign& loop, const LinearModel& model,
                                   const DesignJob& job) {
  FLYBALL_TRY(const auto truth, shown_plant(model, job));
  const auto& [believed, K, K_e] = loop.regulator;
  FLYBALL_TRY(auto running, running_loop(truth, believed, K, K_e, delay_of(job)));
  LoopBehavior behavior{.poles = running.poles, .time_constant = running.time_constant};
  if (K.isZero(0.0) && !controls_velocity(job.plant.kind)) {
    // A position without feedback stays where it is, though its eigenvalue may round below one.
    behavior.time_constant = std::numeric_limits<double>::infinity();
  }
  if (!std::isfinite(behavior.time_constant)) {
    return behavior;
  }
  FLYBALL_TRY(const auto step, step_of(running, step_input(model, loop.K_delayed, loop.inversion)));
  behavior.rise_time = step.metrics.rise_time_10_90;
  behavior.settling_time = step.metrics.settling_time;
  behavior.overshoot = step.metrics.overshoot;
  if (std::abs(step.final_value) > 0.0) {
    behavior.step_time = step.time;
    behavior.step = step.values;
    for (double& value : behavior.step) {
      value /= step.final_value;
    }
  }
  return behavior;
}

Expected<std::vector<FrequencyPoint>> frequency_response(const LoopDesign& loop,
                                                         const LinearModel& model,
                                                         const DesignJob& job) {
  const auto& [believed, K, K_e] = loop.regulator;
  FLYBALL_TRY(const auto opened,
              observer_regulator_loop(model.A, model.B, model.C, believed, K, K_e, delay_of(job)));
  FLYBALL_TRY(const auto sampled, flyball::detail::SampledLoop::create(opened));
  FLYBALL_TRY(const auto open, sampled.open(Time(job.controller.period)));
  const double nyquist = std::numbers::pi / job.controller.period;
  FLYBALL_TRY(
      const auto data,
      classical::bode(open, classical::FrequencyGridOptions{
                                .low = 1e-3 * nyquist, .high = nyquist, .most_points = 600}));
  std::vector<FrequencyPoint> response;
  for (Eigen::Index k = 0; k < data.frequency.size(); ++k) {
    response.push_back({data.frequency(k), data.curves.front().gain(k),
                        data.curves.front().phase(k) * std::numbers::pi / 180.0});
  }
  return response;
}

Expected<void> tell_cost_of_delay(const LoopDesign& loop, const LoopBehavior& runs, bool feedback,
                                  const LinearModel& model, const DesignJob& job, bool chosen,
                                  std::vector<Diagnostic>& diagnostics) {
  if (delay_of(job).si() == 0.0) {
    return {};
  }
  LoopDesign undelayed = loop;
  undelayed.regulator = {model.discrete, loop.K, loop.kalman_gain};
  undelayed.K_delayed = loop.K;
  DesignJob prompt = job;
  prompt.controller.delay = 0.0;
  if (!feedback) {
    FLYBALL_TRY(const bool lost, has_feedback(undelayed.regulator, model, prompt));
    if (!lost) {
      return {};
    }
  }
  FLYBALL_TRY(const LoopBehavior before, behavior_of(undelayed, model, prompt));
  // Half the speed; nothing faster than a period can be told apart at the samples. An observer's
  // slow eigenvalue hides what a step shows.
  constexpr double share = 0.5;
  const double T = job.controller.period;
  const auto is_slow = [&](double now, double then) { return now > std::max(then, T) / share; };
  Slowness slowness{before.time_constant, runs.time_constant, false};
  if (feedback && !is_slow(slowness.now, slowness.before)) {
    if (!runs.rise_time || !before.rise_time || !is_slow(*runs.rise_time, *before.rise_time)) {
      return {};
    }
    slowness = {*before.rise_time, *runs.rise_time, true};
  }
  std::vector<std::string> faster;
  const double clearly = share * slowness.now;
  if (!chosen && is_searched(job)) {
    std::vector<double> tolerances;
    if (const auto other = search_tolerances(model, job, tolerances)) {
      FLYBALL_TRY(const auto behavior, behavior_of(*other, model, job));
      if (slowness.of(behavior) < clearly) {
        faster.push_back(
            fmt::format("leave controller.state_tolerance out, and the looser {} that "
                        "are chosen give {}",
                        tolerances_text(model, tolerances), text::seconds(slowness.of(behavior))));
      }
    }
  }
  if (auto offer = with_prediction(loop, model, job, chosen, slowness, clearly);
      offer && !offer->empty()) {
    faster.push_back(*std::move(offer));
  }
  if (!is_searched(job)) {
    faster.push_back(fmt::format(
        "looser tolerances and a prediction over the delay are tried up to {} periods: set "
        "controller.period to {} or more",
        format_number(most_periods, 2),
        text::seconds(std::ceil(1e3 * delay_of(job).si() / most_periods) * 1e-3)));
  }
  const std::string offers =
      fmt::format("{}{}", faster.empty() ? "" : "; ", fmt::join(faster, "; "));
  const std::string delay = text::seconds(delay_of(job).si());
  if (!feedback) {
    warn(diagnostics, "delay_costs_speed",
         "the delay of {} costs all of the feedback: the same design without delay has a slowest "
         "time constant of {}{}",
         delay, text::seconds(slowness.before), offers);
    return {};
  }
  warn(diagnostics, "delay_costs_speed",
       "the delay of {} costs {} of the loop's speed, more than half: {} {}, that of the same "
       "design "
       "without delay {}{}",
       delay, text::percent(1.0 - slowness.before / slowness.now, 2),
       slowness.by_step ? "a small step rises within" : "its slowest time constant is",
       text::seconds(slowness.now), text::seconds(slowness.before), offers);
  return {};
}

Expected<std::string> why_no_feedback(const LoopDesign& loop, const LinearModel& model,
                                      const DesignJob& job) {
  FLYBALL_TRY(const bool acts, has_feedback(loop.regulator, model, job));
  if (acts) {
    return std::string();
  }
  const PlantDescription& plant = job.plant;
  const double delay = delay_of(job).si();
  if (delay > 0.0 && !loop.predicts) {
    DesignJob prompt = job;
    prompt.controller.delay = 0.0;
    FLYBALL_TRY(const bool without_delay,
                has_feedback({model.discrete, loop.K, loop.kalman_gain}, model, prompt));
    if (without_delay) {
      return fmt::format(
          "compensating a delay of {} leaves nothing of the gain that the same "
          "tolerances ask for without delay",
          text::seconds(delay));
    }
  }
  const bool speed = controls_velocity(plant.kind);
  if (!plant.kA_determined && speed) {
    return fmt::format(
        "kA is not known, so the {} is taken to follow its voltage within a period: "
        "an error that is measured has passed before a voltage can act on it",
        to_string(plant.kind));
  }
  const double constant = plant.gains.kA / plant.gains.kV;
  const double late = job.controller.period + delay;
  if (speed && constant < late) {
    return fmt::format(
        "the {} answers a voltage with a time constant of {}, and a measurement acts "
        "{} late (period and delay): an error has passed by then",
        to_string(plant.kind), text::seconds(constant), text::seconds(late));
  }
  return fmt::format("the tolerances ask for none: {} beside {} V of input",
                     tolerances_text(model, loop.tolerances),
                     format_number(job.controller.input_tolerance, 4));
}

}  // namespace flyball::study
