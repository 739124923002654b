#include <flyball/study/simulate.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include <fmt/format.h>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqg.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/simulation/closed_loop.hpp>
#include <flyball/simulation/mechanism_plant.hpp>
#include <flyball/systems/model_step.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/simulation_record.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view where = "simulate";

using Eigen::Index;
using Eigen::VectorXd;

/// The record of a model: its columns in the order of the description.
Simulation described(const ModelJob& job) {
  const ModelDescription& names = job.model.names();
  Simulation result{.name = names.name, .path = job.path};
  result.closed_loop = job.run.closed_loop;
  result.seed = job.run.seed;
  const auto shown = [](const std::vector<Coordinate>& coordinates, std::string_view truth,
                        std::string_view estimate, std::string_view reference) {
    std::vector<ShownSignal> all;
    for (const Coordinate& one : coordinates) {
      const auto named = [&](std::string_view prefix) {
        return prefix == "-" ? std::string() : std::string(prefix) + one.name;
      };
      all.push_back({one, named(truth), named(estimate), named(reference)});
    }
    return all;
  };
  result.states = shown(names.states, "", "estimated_", "reference_");
  result.inputs = shown(names.inputs, "applied_", "commanded_", "-");
  if (!job.outputs_are_states) {
    result.outputs = shown(names.outputs, "output_", "-", "measured_");
  }
  result.limits.assign(job.limit.begin(), job.limit.end());
  return result;
}

/// The regulator in the loop, about its point.
class Regulating {
 public:
  static Expected<Regulating> create(const ModelJob& job, const ModelRegulator& regulator) {
    const VectorXd& u = regulator.point.u;
    FLYBALL_TRY(auto inversion, linear_plant_inversion(regulator.plant));
    Regulating made(job, regulator, inversion);
    if (regulator.observer) {
      const DiscreteSystem<>& plant = regulator.plant;
      FLYBALL_TRY(auto lqg, Lqg<>::create(plant, regulator.K_delayed, regulator.kalman_gain,
                                          -job.limit - u, job.limit - u));
      const std::vector<Coordinate>& states = job.model.names().states;
      for (std::size_t i = 0; i < states.size(); ++i) {
        if (states[i].is_angle) {
          lqg.set_angle(static_cast<int>(i), 2.0 * std::numbers::pi);
        }
      }
      made.lqg_ = std::move(lqg);
      made.output_ = VectorXd(job.model.output(regulator.point.x, u));
    }
    return made;
  }

  LoopCommand operator()(const LoopSample& sample) {
    const OperatingPoint& point = regulator_.point;
    const VectorXd r = sample.r - point.x;
    if (lqg_) {
      VectorXd y = sample.y - output_;
      wrap_angles(y, job_.model.names().outputs);
      const VectorXd u = point.u + lqg_->step(r, r, y);
      return {u, point.x + lqg_->x_hat()};
    }
    VectorXd error = sample.r - sample.y;
    wrap_angles(error, job_.model.names().states);
    const VectorXd u = point.u + inversion_.calculate(r, r) + regulator_.K_delayed * error;
    return u;
  }

 private:
  Regulating(const ModelJob& job, const ModelRegulator& regulator,
             const LinearPlantInversion<Eigen::Dynamic, Eigen::Dynamic>& inversion)
      : job_(job), regulator_(regulator), inversion_(inversion) {}

  const ModelJob& job_;
  const ModelRegulator& regulator_;
  LinearPlantInversion<Eigen::Dynamic, Eigen::Dynamic> inversion_;
  std::optional<Lqg<>> lqg_{};
  VectorXd output_{};
};

/// An error of the integration says which state has no derivative, where that is the reason.
Refusal named(Error error, const ModelJob& job) {
  double t = 0.0;
  VectorXd x;
  for (const Evidence& evidence : error.evidence()) {
    if (evidence.name == "t" && evidence.values.size() == 1) {
      t = evidence.values.front();
    } else if (evidence.name == "x") {
      x = VectorXd::Map(evidence.values.data(), static_cast<Index>(evidence.values.size()));
    }
  }
  if (error.is(IntegrationError::not_finite) && x.size() == job.model.states()) {
    // Where it stopped the model still has numbers; a little ahead it has not.
    const VectorXd slope = job.model.derivative(x, job.run.input(t));
    double h = 0.0;
    for (int i = 0; i < 10; ++i, h = std::max(10.0 * h, 1e-9)) {
      if (auto checked = job.model.check(x + h * slope, job.run.input(t + h), where, t + h);
          !checked) {
        return Refusal(std::move(checked).error());
      }
    }
  }
  return Refusal(std::move(error).in(std::string(where)));
}

/// A mechanism at a constant voltage.
Expected<Simulation> mechanism_open_loop(const Project& project, double voltage,
                                         MechanismState state) {
  const PlantDescription& plant = project.job.plant;
  FLYBALL_TRY(const auto truth, MechanismPlant::create(plant.kind, plant.gains));
  const double duration = project.simulation.duration.value_or(2.0);
  const double step = project.simulation.step.value_or(1e-3 * duration);
  FLYBALL_TRY(const Index steps, steps_of(duration, step));
  std::vector<double> time, position, velocity;
  for (Index k = 0; k <= steps; ++k) {
    time.push_back(static_cast<double>(k) * step);
    position.push_back(state.position);
    velocity.push_back(state.velocity);
    state = truth.step(state, voltage, step);
  }
  Simulation result{.name = std::string(to_string(plant.kind)), .path = project.path};
  result.duration = duration;
  result.series = TimeSeries(time);
  const std::string unit = plant.unit;
  FLYBALL_CHECK(result.series.add("position", unit, std::move(position)));
  FLYBALL_CHECK(result.series.add("velocity", unit + "/s", std::move(velocity)));
  FLYBALL_CHECK(result.series.add("voltage", "V", std::vector<double>(time.size(), voltage)));
  result.states = {{{"position", unit}, "position", "", ""},
                   {{"velocity", unit + "/s"}, "velocity", "", ""}};
  result.inputs = {{{"voltage", "V"}, "voltage", "", ""}};
  result.limits = {std::numeric_limits<double>::infinity()};
  summarize(result);
  return result;
}

Expected<Simulation> mechanism_closed_loop(const Project& project) {
  FLYBALL_TRY(auto designed, design(project.job));
  const PlantDescription& plant = designed.job.plant;
  Simulation result{.name = std::string(to_string(plant.kind)), .path = project.path};
  result.closed_loop = true;
  result.period = designed.job.controller.period;
  result.seed = designed.job.seed;
  result.series = std::move(designed.response);
  result.duration = result.series.time().empty() ? 0.0 : result.series.time().back();
  for (const Coordinate& state :
       {Coordinate{"position", plant.unit}, Coordinate{"velocity", plant.unit + "/s"}}) {
    if (result.series.find(state.name) != nullptr) {
      result.states.push_back(
          {state, state.name, "estimated_" + state.name, "reference_" + state.name});
    }
  }
  result.inputs = {{{"voltage", "V"}, "motor_voltage", "voltage", ""}};
  result.limits = {designed.job.controller.max_voltage};
  result.diagnostics = std::move(designed.diagnostics);
  summarize(result);
  return result;
}

/// A value of [simulation] for a mechanism. @param value  Takes what it says.
Expected<void> take(const NamedTexts& said, std::string_view key,
                    std::initializer_list<std::tuple<std::string_view, Dimension, double*>> known) {
  for (const NamedText& one : said) {
    const auto found = std::find_if(known.begin(), known.end(), [&](const auto& entry) {
      return std::get<0>(entry) == one.name;
    });
    const std::string name = fmt::format("simulation.{}.{}", key, one.name);
    if (found == known.end()) {
      return refusal(ArgumentError::unknown_name, {}, name)
          .got("nothing that the mechanism has")
          .hint(key == "input" ? "its input is voltage" : "its states are position and velocity");
    }
    FLYBALL_TRY(*std::get<2>(*found), parse_quantity(one.text, std::get<1>(*found), name));
  }
  return {};
}

}  // namespace

Expected<Simulation> simulate_open_loop(const ModelJob& job) {
  const ModelRun& run = job.run;
  const AnyModel& model = job.model;
  const double step = run.step.value_or(1e-3 * run.duration);
  FLYBALL_TRY(const Index steps, steps_of(run.duration, step));
  FLYBALL_CHECK(model.check(run.initial, run.input(0.0), where, 0.0));
  constexpr double most_of_the_run = 0.02;  // so that no step jumps over a pulse of an input
  const IntegrationOptions options{.relative_tolerance = run.accuracy,
                                   .absolute_tolerance = run.accuracy,
                                   .max_step = most_of_the_run * run.duration,
                                   .max_steps = 1'000'000};
  auto solution = integrate(with_input(model, run.input), 0.0, run.initial, run.duration, options);
  if (!solution) {
    return named(std::move(solution).error(), job);
  }
  Simulation result = described(job);
  result.closed_loop = false;
  result.duration = run.duration;
  const ModelDescription& names = model.names();
  std::vector<double> time(static_cast<std::size_t>(steps) + 1);
  Eigen::MatrixXd x(model.states(), steps + 1);
  Eigen::MatrixXd u(model.inputs(), steps + 1);
  Eigen::MatrixXd y(model.outputs(), steps + 1);
  for (Index k = 0; k <= steps; ++k) {
    const double t = k == steps ? run.duration : static_cast<double>(k) * step;
    time[static_cast<std::size_t>(k)] = t;
    x.col(k) = solution->at(t);
    u.col(k) = run.input(t);
    y.col(k) = model.output(x.col(k), u.col(k));
    if (!y.col(k).allFinite()) {
      FLYBALL_CHECK(model.check(x.col(k), u.col(k), where, t));
    }
  }
  result.series = TimeSeries(std::move(time));
  const auto add = [&](std::string_view prefix, const std::vector<Coordinate>& coordinates,
                       const Eigen::MatrixXd& rows) -> Expected<void> {
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
      const Eigen::VectorXd row = rows.row(static_cast<Index>(i));
      FLYBALL_CHECK(result.series.add(std::string(prefix) + coordinates[i].name,
                                      coordinates[i].unit, {row.begin(), row.end()}));
    }
    return {};
  };
  FLYBALL_CHECK(add("", names.states, x));
  if (!job.outputs_are_states) {
    FLYBALL_CHECK(add("output_", names.outputs, y));
  }
  FLYBALL_CHECK(add("applied_", names.inputs, u));
  summarize(result);
  return result;
}

Expected<Simulation> simulate_closed_loop(const ModelJob& job, const ModelRegulator& regulator) {
  const ModelRun& run = job.run;
  const AnyModel& model = job.model;
  FLYBALL_TRY(const Index periods, steps_of(run.duration, job.period));
  VectorXd reference = job.reference;
  for (Index i = 0; i < reference.size(); ++i) {
    reference(i) = std::isnan(reference(i)) ? regulator.point.x(i) : reference(i);
  }
  ClosedLoop loop{.period = Time(job.period),
                  .reference = reference.replicate(1, periods + 1),
                  .record_step = Time(job.period),
                  .seed = run.seed};
  for (std::size_t i = 0; i < run.noise.size(); ++i) {
    loop.sensors.push_back({.resolution = run.resolution[i], .noise = run.noise[i]});
  }
  for (Index i = 0; i < job.limit.size(); ++i) {
    loop.actuators.push_back({.min = -job.limit(i), .max = job.limit(i), .delay = Time(job.delay)});
  }
  FLYBALL_TRY(auto plant,
              ModelPlant::create(model, run.initial_is_given ? run.initial : regulator.point.x,
                                 {.accuracy = run.accuracy}));
  FLYBALL_TRY(auto law, Regulating::create(job, regulator));
  auto looped = flyball::simulate_closed_loop(plant, law, loop);
  if (!looped) {
    return named(std::move(looped).error(), job);
  }
  Simulation result = described(job);
  result.closed_loop = true;
  result.period = job.period;
  result.duration = run.duration;
  result.series = std::move(looped->series);
  result.diagnostics = regulator.diagnostics;
  summarize(result);
  return result;
}

ExpectedAll<Simulation> simulate(const Project& project) {
  if (project.model_job) {
    const ModelJob& job = *project.model_job;
    if (!job.run.closed_loop) {
      return simulate_open_loop(job);
    }
    FLYBALL_TRY(const auto regulator, regulate(job));
    return simulate_closed_loop(job, regulator);
  }
  if (project.plant_error) {
    return tl::unexpected(*project.plant_error);
  }
  const SimulationSection& said = project.simulation;
  if (said.input.empty()) {
    return mechanism_closed_loop(project);
  }
  double voltage = 0.0;
  MechanismState state;
  const bool turns = project.job.plant.unit == "rad";
  const Dimension position = turns ? Dimension::angle : Dimension::length;
  const Dimension velocity = turns ? Dimension::angular_velocity : Dimension::velocity;
  FLYBALL_CHECK(take(said.input, "input", {{"voltage", Dimension::voltage, &voltage}}));
  FLYBALL_CHECK(
      take(said.initial, "initial",
           {{"position", position, &state.position}, {"velocity", velocity, &state.velocity}}));
  return mechanism_open_loop(project, voltage, state);
}

Expected<ModelDesign> design_model(const ModelJob& job) {
  FLYBALL_TRY(auto regulator, regulate(job));
  ModelDesign result{.job = job, .regulator = std::move(regulator), .simulation = {}};
  const ModelRegulator& made = result.regulator;
  ModelRun& run = result.job.run;
  if (!run.initial_is_given) {
    constexpr double share = 0.2;
    run.initial = made.point.x;
    for (Index i = 0; i < run.initial.size(); ++i) {
      run.initial(i) += share / std::sqrt(made.Q(i, i));
    }
    run.initial_is_given = true;
    note(result.regulator.diagnostics, "assumed",
         "the simulation begins a fifth of each tolerance beside the point (simulation.initial "
         "says another)");
  }
  if (!job.run.duration_is_given) {
    // Eight time constants of the slowest pole.
    constexpr double time_constants = 8.0;
    const double slowest = made.poles.cwiseAbs().maxCoeff();
    const double constant = slowest < 1.0 ? -job.period / std::log(slowest) : job.period;
    run.duration = std::clamp(time_constants * constant, 10.0 * job.period, 60.0);
  }
  FLYBALL_TRY(result.simulation, simulate_closed_loop(result.job, made));
  return result;
}

}  // namespace flyball::study
