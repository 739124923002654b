#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <flyball/control/pid_tuning.hpp>

#include "control/single_loop.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_tune_manually = "tune_manually";

/// Above this share of the step an overshoot that comes back counts as oscillation.
constexpr double oscillating = 0.05;
/// Above this share of the input's limits from one period to the next it jitters.
constexpr double jittering = 0.05;
/// An error below this share of the step counts as none.
constexpr double exact = 0.02;

/// Mean |u_k - u_{k-1}| over the last third, as a share of the limits (or of the largest input).
double jitter_of(const PidResponse& response, const PidSettings& settings) {
  const std::size_t count = response.input.size();
  double range = 0.5 * (settings.output_max - settings.output_min);
  if (!std::isfinite(range)) {
    range = 0.0;
    for (const double u : response.input) {
      range = std::max(range, std::abs(u));
    }
  }
  double sum = 0.0;
  const std::size_t from = count - count / 3;
  for (std::size_t k = from; k < count; ++k) {
    sum += std::abs(response.input[k] - response.input[k - 1]);
  }
  return range > 0.0 ? sum / (static_cast<double>(count - from) * range) : 0.0;
}

std::string seen_in(const ResponseMetrics& metrics, double jitter) {
  std::string text;
  if (metrics.overshoot > 1e-3) {
    text = detail::format("the output goes over the reference by {:.1f} % and crosses it {} times",
                          100.0 * metrics.overshoot, metrics.crossings);
  } else if (metrics.rise_time) {
    text = "the output reaches the reference without going over it";
  } else {
    text = detail::format("the output ends {} short of the reference",
                          format_number(metrics.steady_state_error, 3));
  }
  if (metrics.settling_time) {
    text += detail::format(", settled after {} s", format_number(*metrics.settling_time, 3));
  } else {
    text += ", not settled";
  }
  if (jitter > jittering) {
    text += detail::format("; the input jitters by {:.0f} % of its range a period", 100.0 * jitter);
  }
  return text;
}

/// The procedure's state: what has been tried on which plant.
class Bench {
 public:
  Bench(const DiscreteSystem<>& plant, const TuningScenario& scenario)
      : plant_(plant), scenario_(scenario) {}

  /// Simulates and notes what was seen; what was decided is filled in by whoever decides.
  [[nodiscard]] Expected<TuningStep*> attempt(const PidGains& gains) {
    FLYBALL_TRY_IN(in_tune_manually, const auto response, simulate_pid(plant_, gains, scenario_));
    TuningStep step{gains, response.metrics, jitter_of(response, scenario_.settings)};
    step.seen = seen_in(step.metrics, step.jitter);
    steps_.push_back(std::move(step));
    return &steps_.back();
  }

  [[nodiscard]] bool oscillates(const TuningStep& step) const {
    return (step.metrics.overshoot > oscillating && step.metrics.crossings >= 2) ||
           step.jitter > jittering;
  }
  [[nodiscard]] double error_of(const TuningStep& step) const {
    return std::abs(step.metrics.steady_state_error / scenario_.reference);
  }
  [[nodiscard]] std::vector<TuningStep>& steps() { return steps_; }

 private:
  const DiscreteSystem<>& plant_;
  const TuningScenario& scenario_;
  std::vector<TuningStep> steps_;
};

/// The gain at which to start: the limits (or one unit of input) for a hundred steps' error.
double first_gain(const TuningScenario& scenario) {
  const double limit =
      std::min(std::abs(scenario.settings.output_max), std::abs(scenario.settings.output_min));
  const double size = std::isfinite(limit) && limit > 0.0 ? limit : 1.0;
  return 0.01 * size / std::abs(scenario.reference);
}

/// Step 2: Kp doubled until the output oscillates. Answers the last gain that was tried.
Expected<PidGains> raise_kp(Bench& bench, double first, double sign, bool velocity) {
  constexpr int doublings = 40;
  PidGains gains{};
  PidGains calm{};
  for (int i = 0; i < doublings; ++i) {
    gains.kp = sign * first * std::ldexp(1.0, i);
    FLYBALL_TRY(auto step, bench.attempt(gains));
    if (!bench.oscillates(*step)) {
      step->decided = "increase Kp: nothing oscillates yet";
      calm = gains;
      continue;
    }
    if (velocity || step->jitter > jittering) {
      step->decided = detail::format(
          "take Kp back to {}: {}", format_number(calm.kp, 4),
          velocity ? "a velocity controller has no Kd to damp an oscillation (6.10.7)"
                   : "the loop is at the edge of its sample rate");
      return calm;
    }
    step->decided = detail::format("keep Kp = {}: it starts to oscillate, which Kd is to damp",
                                   format_number(gains.kp, 4));
    return gains;
  }
  bench.steps().back().decided = "keep Kp: more of it changes nothing";
  return gains;
}

/// Step 3: Kd doubled for as long as it makes the response better and nothing jitters.
Expected<PidGains> raise_kd(Bench& bench, PidGains gains, double period) {
  constexpr int doublings = 24;
  PidGains best = gains;
  const auto cost_of = [](const TuningStep& step) {
    // Settled sooner is better; among those that do not settle, a smaller overshoot.
    return step.metrics.settling_time ? *step.metrics.settling_time
                                      : 1e6 * (1.0 + step.metrics.overshoot);
  };
  double least = cost_of(bench.steps().back());
  for (int i = 0; i < doublings; ++i) {
    gains.kd = gains.kp * period * std::ldexp(0.25, i);
    FLYBALL_TRY(auto step, bench.attempt(gains));
    if (step->jitter > jittering) {
      step->decided = detail::format("take Kd back to {}: it jitters", format_number(best.kd, 4));
      break;
    }
    const double cost = cost_of(*step);
    if (cost < least) {
      step->decided = "increase Kd: the oscillation is damped, and nothing jitters";
      best = gains;
      least = cost;
    } else if (step->metrics.overshoot > oscillating) {
      step->decided = "increase Kd: it still oscillates";
    } else {
      step->decided = detail::format("take Kd back to {}: more of it only slows the response",
                                     format_number(best.kd, 4));
      break;
    }
  }
  return best;
}

/// The last resort of 2.6: Ki until the remaining error goes within the duration.
Expected<PidGains> raise_ki(Bench& bench, PidGains gains, double duration) {
  constexpr int doublings = 24;
  PidGains best = gains;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < doublings; ++i) {
    gains.ki = gains.kp / duration * std::ldexp(0.5, i);
    FLYBALL_TRY(auto step, bench.attempt(gains));
    if (bench.oscillates(*step)) {
      step->decided = detail::format("take Ki back to {}: it goes too far over the reference",
                                     format_number(best.ki, 4));
      break;
    }
    const double error = bench.error_of(*step);
    if (error < least) {
      least = error;
      best = gains;
    }
    if (error <= exact && step->metrics.settling_time) {
      step->decided =
          detail::format("keep Ki = {}: the error is gone in time", format_number(gains.ki, 4));
      break;
    }
    step->decided = "increase Ki: an error remains";
  }
  return best;
}

}  // namespace

Expected<ManualTuning> tune_manually(const DiscreteSystem<>& plant, const TuningScenario& scenario,
                                     bool velocity) {
  FLYBALL_CHECK(detail::check_single_loop(plant, in_tune_manually));
  Bench bench(plant, scenario);
  FLYBALL_TRY(auto rest, bench.attempt({}));
  rest->decided = "start with all gains zero (step 1), then raise Kp (step 2)";
  // Which way the input moves the output in the end decides the sign of the gains.
  const auto push = [&]() -> double {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(plant.A.rows());
    double y = 0.0;
    const int steps = static_cast<int>(std::min(1e4, scenario.duration / plant.period.si()));
    for (int k = 0; k < steps; ++k) {
      x = (plant.A * x + plant.B.col(0)).eval();
      y = plant.C.row(0).dot(x);
    }
    return y < 0.0 ? -1.0 : 1.0;
  };
  FLYBALL_TRY(auto gains, raise_kp(bench, first_gain(scenario), push(), velocity));
  if (gains.kp == 0.0) {
    return refusal(TuningError::nothing_improves, in_tune_manually, "Kp")
        .hint("even a small one makes the loop oscillate: shorten the period or the delay")
        .with("smallest Kp tried", first_gain(scenario));
  }
  if (!velocity) {
    FLYBALL_TRY(gains, raise_kd(bench, gains, plant.period.si()));
  }
  FLYBALL_TRY(auto settled, bench.attempt(gains));
  if (bench.error_of(*settled) > exact) {
    settled->decided = "an error remains: a steady-state feedforward would be better, but raise Ki";
    FLYBALL_TRY(gains, raise_ki(bench, gains, scenario.duration));
  } else {
    settled->decided = "leave Ki at zero: no error remains";
  }
  FLYBALL_TRY(auto response, simulate_pid(plant, gains, scenario));
  if (std::abs(response.metrics.steady_state_error) >= std::abs(scenario.reference)) {
    return refusal(TuningError::nothing_improves, in_tune_manually, "the loop")
        .hint(
            "the plant needs more than its limits allow, or another controller: see whether it is "
            "controllable")
        .with("error that remains", response.metrics.steady_state_error);
  }
  return ManualTuning{gains, std::move(bench.steps()), std::move(response)};
}

}  // namespace flyball
