#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <flyball/control/pid_tuning.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/response.hpp>

#include "control/single_loop.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace detail {

Expected<void> check_single_loop(const DiscreteSystem<>& plant, std::string_view where) {
  FLYBALL_CHECK(check_system(plant, where));
  return Checks(where)
      .shape(plant.B, plant.A.rows(), 1, "B", "one input")
      .shape(plant.C, 1, plant.A.rows(), "C", "one output");
}

Expected<int> steps_of(double duration, double period, std::string_view where) {
  constexpr double most = 1e7;
  const double steps = std::round(duration / period);
  if (!(steps >= 2.0 && steps <= most)) {
    return refusal(ArgumentError::out_of_range, where, "duration")
        .got(format_number(duration) + " s")
        .expected("from 2 to 10 000 000 periods of " + format_number(period) + " s");
  }
  return static_cast<int>(steps);
}

}  // namespace detail

ErrorInfo error_info(TuningError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_oscillation", "the relay does not make the plant oscillate", ErrorKind::no_answer},
      {"no_reaction", "the output does not answer the step, or does not settle",
       ErrorKind::no_answer},
      {"nothing_improves", "no proportional gain brings the output to the reference",
       ErrorKind::no_answer},
  };
  return detail::info_of(code, "tuning", rows);
}

Expected<PidResponse> simulate_pid(const DiscreteSystem<>& plant, const PidGains& gains,
                                   const TuningScenario& scenario) {
  constexpr std::string_view where = "simulate_pid";
  FLYBALL_CHECK(detail::check_single_loop(plant, where));
  FLYBALL_CHECK(Checks(where)
                    .positive(std::abs(scenario.reference), "reference")
                    .positive(scenario.duration, "duration", "s")
                    .finite(scenario.disturbance, "disturbance")
                    .not_negative(scenario.noise, "noise"));
  const double T = plant.period.si();
  FLYBALL_TRY(const auto steps, detail::steps_of(scenario.duration, T, where));
  PidSettings settings = scenario.settings;
  settings.gains = gains;
  settings.period = T;
  FLYBALL_TRY(auto controller, Pid::create(settings));
  // A loop that runs away is judged by what it did until there.
  const double far = 1e6 * std::abs(scenario.reference);
  Random random(1);
  PidResponse response;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(plant.A.rows());
  double u = 0.0;
  for (int k = 0; k <= steps; ++k) {
    const double y = plant.C.row(0).dot(x) + plant.D(0, 0) * u;
    const double measured = scenario.noise > 0.0 ? random.normal(y, scenario.noise) : y;
    u = controller.calculate(measured, scenario.reference);
    response.times.push_back(k * T);
    response.output.push_back(std::clamp(y, -far, far));
    response.input.push_back(u);
    x = (plant.A * x + plant.B.col(0) * (u + scenario.disturbance)).eval();
    x = x.cwiseMax(-1e150).cwiseMin(1e150);
  }
  FLYBALL_TRY(auto metrics, response_metrics(response.times, response.output, scenario.reference));
  response.metrics = metrics;
  return response;
}

Expected<UltimatePoint> relay_experiment(const DiscreteSystem<>& plant, double height,
                                         double hysteresis, double bias, double duration) {
  constexpr std::string_view where = "relay_experiment";
  FLYBALL_CHECK(detail::check_single_loop(plant, where));
  FLYBALL_CHECK(Checks(where)
                    .positive(height, "height")
                    .not_negative(hysteresis, "hysteresis")
                    .finite(bias, "bias")
                    .positive(duration, "duration", "s"));
  const double T = plant.period.si();
  FLYBALL_TRY(const auto steps, detail::steps_of(duration, T, where));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(plant.A.rows());
  int side = 1;
  std::vector<double> upward;  // Times at which the relay switched on.
  std::vector<double> highest, lowest;
  double high = 0.0;
  double low = 0.0;
  int switches = 0;
  double before = 0.0;
  for (int k = 0; k <= steps && x.allFinite(); ++k) {
    const double u_before = bias + side * height;
    const double y = plant.C.row(0).dot(x) + plant.D(0, 0) * u_before;
    high = std::max(high, y);
    low = std::min(low, y);
    const double level = side > 0 ? hysteresis : -hysteresis;
    if ((side > 0 && y > level) || (side < 0 && y < level)) {
      side = -side;
      ++switches;
      if (side > 0) {
        // The output crosses between two samples; the period is not to be rounded to them.
        const double part = y != before ? (level - before) / (y - before) : 1.0;
        upward.push_back((k - 1 + std::clamp(part, 0.0, 1.0)) * T);
        highest.push_back(high);
        lowest.push_back(low);
        high = low = y;
      }
    }
    before = y;
    x = (plant.A * x + plant.B.col(0) * (bias + side * height)).eval();
  }
  const auto no_cycle = [&](std::string hint) {
    return refusal(TuningError::no_oscillation, where, "the plant")
        .hint(std::move(hint))
        .with("switches seen", switches);
  };
  constexpr std::size_t needed = 5;
  if (upward.size() < needed) {
    return no_cycle("give it more time, a higher relay, or the bias that holds it");
  }
  // The last cycles: the first ones are still on their way.
  const std::size_t last = upward.size() - 1;
  const std::size_t cycles = std::min<std::size_t>(last / 2, 10);
  UltimatePoint point;
  point.period = (upward[last] - upward[last - cycles]) / static_cast<double>(cycles);
  double sum = 0.0;
  for (std::size_t i = last - cycles + 1; i <= last; ++i) {
    sum += 0.5 * (highest[i] - lowest[i]);
  }
  point.amplitude = sum / static_cast<double>(cycles);
  const double effective = std::sqrt(point.amplitude * point.amplitude - hysteresis * hysteresis);
  if (!(effective > 0.0) || point.period < 4.0 * T) {
    return no_cycle("it only chatters at the sample rate: its lag is below the period");
  }
  point.gain = 4.0 * height / (std::numbers::pi * effective);
  return point;
}

Expected<ReactionCurve> reaction_curve(std::span<const double> times,
                                       std::span<const double> values, double input_step) {
  constexpr std::string_view where = "reaction_curve";
  constexpr std::size_t fewest = 10;
  if (times.size() != values.size() || times.size() < fewest) {
    return refusal(ArgumentError::wrong_shape, where, "values")
        .got(detail::format("{} for {} times", values.size(), times.size()))
        .expected("as many as times, at least 10");
  }
  for (std::size_t k = 0; k < times.size(); ++k) {
    FLYBALL_CHECK(Checks(where).finite(times[k], "times").finite(values[k], "values"));
    if (k > 0 && !(times[k] > times[k - 1])) {
      return refusal(ArgumentError::out_of_range, where, detail::format("times[{}]", k))
          .got(detail::format("{} after {}", times[k], times[k - 1]))
          .expected("later than the one before");
    }
  }
  FLYBALL_CHECK(check_positive(std::abs(input_step), where, "input_step"));
  const double start = values.front();
  const double end = values.back();
  const double change = end - start;
  const auto tail = values.subspan(values.size() - values.size() / 5);
  const auto [low, high] = std::minmax_element(tail.begin(), tail.end());
  if (!(std::abs(change) > 10.0 * (*high - *low))) {
    return refusal(TuningError::no_reaction, where, "the output")
        .hint(
            "wait until it has settled; a plant that integrates never does: tune it with a relay "
            "or by its poles")
        .with("change", change)
        .with("change in the last fifth", *high - *low);
  }
  const auto reached = [&](double level) {
    for (std::size_t k = 1; k < values.size(); ++k) {
      const double before = (values[k - 1] - start) / change;
      const double now = (values[k] - start) / change;
      if (now >= level) {
        const double part = now > before ? (level - before) / (now - before) : 1.0;
        return times[k - 1] + part * (times[k] - times[k - 1]) - times.front();
      }
    }
    return times.back() - times.front();
  };
  const double t_28 = reached(1.0 - std::exp(-1.0 / 3.0));
  const double t_63 = reached(1.0 - std::exp(-1.0));
  ReactionCurve curve;
  curve.gain = change / input_step;
  curve.time_constant = 1.5 * (t_63 - t_28);
  curve.delay = std::max(0.0, t_63 - curve.time_constant);
  return curve;
}

Expected<ReactionCurve> reaction_curve(const DiscreteSystem<>& plant, double input_step,
                                       double duration) {
  constexpr std::string_view where = "reaction_curve";
  FLYBALL_CHECK(detail::check_single_loop(plant, where));
  const double T = plant.period.si();
  FLYBALL_TRY(const auto steps, detail::steps_of(duration, T, where));
  FLYBALL_TRY(auto step, forced_response(plant, Eigen::VectorXd::Constant(steps + 1, input_step),
                                         Eigen::VectorXd::Zero(plant.A.rows())));
  step.y(0, 0) = 0.0;  // Before the step.
  const auto count = static_cast<std::size_t>(steps) + 1;
  return reaction_curve(std::span(step.time.data(), count), std::span(step.y.data(), count),
                        input_step);
}

}  // namespace flyball
