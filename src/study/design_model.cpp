#include <flyball/study/design_model.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/control/latency.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/running_loop.hpp>
#include <flyball/core/argument.hpp>
#include <flyball/estimation/covariance.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/linearize.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/told.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view in_design_model = "design";

std::string values_of(const std::vector<Coordinate>& names, const Eigen::VectorXd& values) {
  std::vector<std::string> parts;
  constexpr double rounding = 1e-12;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double value = values(static_cast<Eigen::Index>(i));
    parts.push_back(fmt::format("{} = {}{}{}", names[i].name,
                                format_number(std::abs(value) < rounding ? 0.0 : value, 4),
                                names[i].unit.empty() ? "" : " ", names[i].unit));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// Bryson's tolerances, or one of each unit.
std::vector<double> tolerances(const std::vector<double>& given, Eigen::Index count) {
  return given.empty() ? std::vector<double>(static_cast<std::size_t>(count), 1.0) : given;
}

/// The delay's compensation; where a pole has no real power, that of whole periods.
Expected<Eigen::MatrixXd> delayed_gain(const ModelRegulator& regulator, Time delay) {
  const DiscreteSystem<>& plant = regulator.plant;
  auto gain = compensate_latency(regulator.K, plant.A, plant.B, plant.period, delay);
  if (!gain && gain.error().is(MatrixFunctionError::no_real_power)) {
    const Time whole(std::round(delay.si() / plant.period.si()) * plant.period.si());
    return compensate_latency(regulator.K, plant.A, plant.B, plant.period, whole);
  }
  return gain;
}

/// A filter for readings with the job's noise, or a hundredth of what the tolerances are seen as,
/// and inputs that err by a tenth of theirs.
Expected<void> add_observer(ModelRegulator& regulator, const ModelJob& job,
                            const std::vector<double>& state_tolerance,
                            const std::vector<double>& input_tolerance,
                            std::vector<Diagnostic>& noticed) {
  const DiscreteSystem<>& plant = regulator.plant;
  const Eigen::Map<const Eigen::VectorXd> states(state_tolerance.data(),
                                                 static_cast<Eigen::Index>(state_tolerance.size()));
  const Eigen::Map<const Eigen::VectorXd> inputs(input_tolerance.data(),
                                                 static_cast<Eigen::Index>(input_tolerance.size()));
  constexpr double share_of_output = 0.01;
  constexpr double share_of_input = 0.1;
  constexpr double share_of_state = 1e-3;
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(plant.C.rows(), plant.C.rows());
  std::vector<std::string> assumed;
  const std::vector<Coordinate>& outputs = job.model.names().outputs;
  for (Eigen::Index i = 0; i < R.rows(); ++i) {
    double std = job.run.noise[static_cast<std::size_t>(i)];
    if (!(std > 0.0)) {
      const double seen = plant.C.row(i).cwiseProduct(states.transpose()).norm();
      std = share_of_output * (seen > 0.0 ? seen : 1.0);
      const Coordinate& output = outputs[static_cast<std::size_t>(i)];
      assumed.push_back(
          fmt::format("{} {} for {}", format_number(std, 3), output.unit, output.name));
    }
    R(i, i) = std * std;
  }
  const Eigen::MatrixXd G = share_of_input * plant.B * inputs.asDiagonal();
  Eigen::MatrixXd Q = G * G.transpose();
  Q.diagonal() += (share_of_state * states).cwiseAbs2();
  FLYBALL_TRY(auto filter, told_of("the observer", kalman_gain(plant, Q, R),
                                   "measure more of the model in [model.outputs]"));
  regulator.observer = true;
  regulator.kalman_gain = filter.K;
  regulator.estimator_poles = filter.poles;
  if (!assumed.empty()) {
    note(noticed, "assumed",
         "the readings' noise is taken as {} a sample (simulation.noise says another)",
         fmt::join(assumed, ", "));
  }
  return {};
}

/// The poles of the loop as it runs; a warning where the delay costs more than half of its speed.
Expected<void> add_loop_poles(ModelRegulator& regulator, Time delay,
                              std::vector<Diagnostic>& noticed) {
  const DiscreteSystem<>& plant = regulator.plant;
  auto running =
      running_loop(regulator.linear, plant, regulator.K_delayed, regulator.kalman_gain, delay);
  if (!running) {
    warn(noticed, "no_poles", "the loop's poles: {}", to_string(running.error()));
    return {};
  }
  RunningLoop& loop = *running;
  regulator.loop_poles = std::move(loop.poles);
  regulator.time_constant = loop.time_constant;
  FLYBALL_TRY(const auto undelayed,
              running_loop(regulator.linear, plant, regulator.K, regulator.kalman_gain, Time(0.0)));
  constexpr double share = 0.5;
  const double prompt = std::max(undelayed.time_constant, plant.period.si());
  if (delay.si() > 0.0 && share * loop.time_constant > prompt) {
    warn(noticed, "delay_costs_speed",
         "the delay of {} costs {} of the loop's speed, more than half: its slowest time constant "
         "is {}, that of the same design without delay {}",
         text::seconds(delay.si()),
         text::percent(1.0 - undelayed.time_constant / loop.time_constant, 2),
         text::seconds(loop.time_constant), text::seconds(undelayed.time_constant));
  }
  return {};
}

}  // namespace

Expected<OperatingPoint> operating_point(const ModelJob& job) {
  FLYBALL_CHECK(job.model.check(job.x, job.u, "point"));
  OperatingPoint point{.x = job.x, .u = job.u, .derivative = {}};
  if (job.find_equilibrium) {
    auto found = find_equilibrium(job.model, job.x, job.u);
    if (!found) {
      Error error = std::move(found).error();
      if (const auto other =
              find_equilibrium(job.model, job.x, job.u, EquilibriumBy::states_and_inputs)) {
        const ModelDescription& names = job.model.names();
        error = std::move(error).hint(
            fmt::format("with other inputs one is at {} with {}: write them in point.at",
                        values_of(names.states, other->x), values_of(names.inputs, other->u)));
      }
      return tl::unexpected(std::move(error));
    }
    point.x = found->x;
    point.u = found->u;
  }
  point.derivative = job.model.derivative(point.x, point.u);
  point.is_equilibrium = is_equilibrium(job.model, point.x, point.u);
  if (!point.is_equilibrium) {
    for (const EquilibriumBy by : {EquilibriumBy::states, EquilibriumBy::states_and_inputs}) {
      if (auto found = find_equilibrium(job.model, point.x, point.u, by); found && !point.nearest) {
        point.nearest = *std::move(found);
      }
    }
  }
  return point;
}

std::string describe(const OperatingPoint& point, const ModelDescription& model) {
  if (point.is_equilibrium) {
    return "an equilibrium";
  }
  std::vector<std::string> rates;
  for (std::size_t i = 0; i < model.states.size(); ++i) {
    const double rate = point.derivative(static_cast<Eigen::Index>(i));
    if (rate != 0.0) {
      const std::string& unit = model.states[i].unit;
      rates.push_back(
          fmt::format("{} changes by {} {}", model.states[i].name, format_number(rate, 4),
                      unit.empty() ? "1/s" : unit + (unit.ends_with("/s") ? "²" : "/s")));
    }
  }
  std::string text = fmt::format("not an equilibrium: {}", fmt::join(rates, ", "));
  if (point.nearest) {
    text += fmt::format("; near it is one at {}", values_of(model.states, point.nearest->x));
    if (!model.inputs.empty()) {
      text += fmt::format(" with {}", values_of(model.inputs, point.nearest->u));
    }
  }
  return text;
}

namespace {

/// @param noticed  So far; there too when it fails.
Expected<ModelRegulator> regulator_of(const ModelJob& job, std::vector<Diagnostic>& noticed) {
  FLYBALL_CHECK(check_delay(job.delay, job.period, in_design_model));
  const AnyModel& model = job.model;
  if (model.inputs() == 0) {
    return refusal(ArgumentError::empty, in_design_model, "inputs")
        .got("empty")
        .expected("at least one, for a controller to act with");
  }
  FLYBALL_TRY(auto point, operating_point(job));
  if (!point.is_equilibrium) {
    return refusal(ArgumentError::out_of_range, in_design_model, "the point")
        .got(describe(point, model.names()))
        .hint("give that one in [point], or write find_equilibrium = true")
        .with("derivative", std::vector<double>(point.derivative.begin(), point.derivative.end()));
  }
  FLYBALL_TRY(auto linear, linearize(model, point.x, point.u));
  const Time period(job.period);
  FLYBALL_TRY(auto plant, told_of("controller.period", discretize(linear, period)));
  ModelRegulator regulator{.point = std::move(point),
                           .linear = std::move(linear),
                           .plant = std::move(plant),
                           .Q = {},
                           .R = {},
                           .K = {},
                           .K_delayed = {}};
  const std::vector<double> states = tolerances(job.state_tolerance, model.states());
  const std::vector<double> inputs = tolerances(job.input_tolerance, model.inputs());
  if (job.state_tolerance.empty() || job.input_tolerance.empty()) {
    note(noticed, "assumed",
         "no tolerance is given for {}: one of each unit is taken (set controller.tolerance)",
         !job.input_tolerance.empty()   ? "the states"
         : !job.state_tolerance.empty() ? "the inputs"
                                        : "states and inputs");
  }
  FLYBALL_TRY(regulator.Q, told_of("controller.tolerance", bryson(states)));
  FLYBALL_TRY(regulator.R, told_of("controller.tolerance", bryson(inputs)));
  FLYBALL_TRY(auto gains, lqr(regulator.plant, regulator.Q, regulator.R));
  regulator.K = gains.K;
  regulator.poles = gains.poles;
  const Time delay(job.delay);
  FLYBALL_TRY(regulator.K_delayed, told_of("controller.delay", delayed_gain(regulator, delay)));
  if (!job.outputs_are_states) {
    FLYBALL_CHECK(add_observer(regulator, job, states, inputs, noticed));
  }
  FLYBALL_CHECK(add_loop_poles(regulator, delay, noticed));
  if (model.inputs() == 1) {
    const ContinuousSystem<>& open = regulator.linear;
    auto loop = regulator.observer
                    ? observer_regulator_loop(open.A, open.B, open.C, regulator.plant,
                                              regulator.K_delayed, regulator.kalman_gain, delay)
                    : state_feedback_loop(open.A, open.B, regulator.K_delayed, period, delay);
    auto margins = loop.and_then(&stability_margins);
    if (margins) {
      regulator.margins = *std::move(margins);
    } else {
      warn(noticed, "no_margins", "margins: {}", to_string(margins.error()));
    }
  }
  return regulator;
}

}  // namespace

ExpectedAll<ModelRegulator> regulate(const ModelJob& job) {
  std::vector<Diagnostic> noticed;
  auto regulator = regulator_of(job, noticed);
  if (!regulator) {
    return refused(in_design_model, std::move(regulator).error(), std::move(noticed));
  }
  regulator->diagnostics = std::move(noticed);
  return *std::move(regulator);
}

}  // namespace flyball::study
