#include <flyball/study/simulate.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqg.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/simulation/closed_loop.hpp>
#include <flyball/simulation/mechanism_plant.hpp>
#include <flyball/study/simulate_design.hpp>
#include <flyball/systems/model_step.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/model_loop_response.hpp"
#include "study/model_swing_up.hpp"
#include "study/simulation_record.hpp"
#include "study/told.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view in_simulate = "simulate";

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What is simulated, and the columns of its record, in the order of the description.
Simulation described(const ModelDescription& names, const std::string& path, const ModelRun& run,
                     bool outputs_are_states) {
  Simulation result{
      .name = names.name, .path = path, .closed_loop = run.closed_loop, .seed = run.seed};
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
  if (!outputs_are_states) {
    result.outputs = shown(names.outputs, "output_", "-", "measured_");
  }
  result.limits.assign(names.inputs.size(), std::numeric_limits<double>::infinity());
  return result;
}

/// What is given, and of the rest what holds otherwise.
VectorXd or_else(const VectorXd& given, const VectorXd& otherwise) {
  return given.size() == 0 ? otherwise : VectorXd(given.array().isNaN().select(otherwise, given));
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

/// An open loop, row by row.
struct Rows {
  std::vector<double> time{};
  MatrixXd x{}, u{}, y{};
};

Expected<Rows> rows_of(const ModelDescription& names, const ModelRun& run) {
  const double step = run.step.value_or(1e-3 * run.duration);
  const auto count = [](const std::vector<Coordinate>& list) {
    return static_cast<Index>(list.size());
  };
  FLYBALL_TRY(const Index steps,
              steps_of(run.duration, step,
                       count(names.states) + count(names.inputs) + count(names.outputs)));
  Rows rows{.x = MatrixXd(count(names.states), steps + 1),
            .u = MatrixXd(count(names.inputs), steps + 1),
            .y = MatrixXd(count(names.outputs), steps + 1)};
  for (Index k = 0; k < steps; ++k) {
    rows.time.push_back(static_cast<double>(k) * step);
  }
  rows.time.push_back(run.duration);
  return rows;
}

Expected<Simulation> recorded(Simulation result, Rows rows) {
  result.closed_loop = false;
  result.duration = rows.time.back();
  result.series = TimeSeries(std::move(rows.time));
  const auto add = [&](const std::vector<ShownSignal>& shown,
                       const MatrixXd& values) -> Expected<void> {
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const VectorXd row = values.row(static_cast<Index>(i));
      FLYBALL_CHECK(
          result.series.add(shown[i].truth, shown[i].signal.unit, {row.begin(), row.end()}));
    }
    return {};
  };
  FLYBALL_CHECK(add(result.states, rows.x));
  FLYBALL_CHECK(add(result.outputs, rows.y));
  FLYBALL_CHECK(add(result.inputs, rows.u));
  summarize(result);
  return result;
}

MechanismState mechanism_state(const ModelRun& run) {
  const VectorXd state = or_else(run.initial, VectorXd::Zero(2));
  return {state(0), state(1)};
}

/// A mechanism at a voltage over time, exact while that is constant.
Expected<Simulation> mechanism_open_loop(const Project& project) {
  const PlantDescription& plant = project.job.plant;
  const ModelRun& run = project.mechanism_run;
  FLYBALL_TRY(const auto truth, MechanismPlant::create(plant.kind, plant.gains));
  const ModelDescription names{
      .name = std::string(to_string(plant.kind)),
      .states = {{"position", plant.unit}, {"velocity", plant.unit + "/s"}},
      .inputs = {{"voltage", "V"}}};
  FLYBALL_TRY(Rows rows, rows_of(names, run));
  MechanismState state = mechanism_state(run);
  const double longest = std::max(1e-3, 1e-5 * run.duration);  // s, of one voltage
  for (Index k = 0; k < rows.x.cols(); ++k) {
    const double t = rows.time[static_cast<std::size_t>(k)];
    rows.x.col(k) << state.position, state.velocity;
    rows.u.col(k) = run.input(t);
    FLYBALL_CHECK(
        flyball::detail::check_point(names, rows.x.col(k), rows.u.col(k), in_simulate, t));
    const double step =
        k + 1 < rows.x.cols() ? rows.time[static_cast<std::size_t>(k) + 1] - t : 0.0;
    const double parts = std::ceil(step / longest - 1e-9);
    for (double i = 0.0; i < parts; ++i) {
      const double middle = t + (i + 0.5) * step / parts;
      const VectorXd voltage = run.input(middle);
      FLYBALL_CHECK(
          flyball::detail::check_point(names, rows.x.col(k), voltage, in_simulate, middle));
      state = truth.step(state, voltage(0), step / parts);
    }
  }
  return recorded(described(names, project.path, run, true), std::move(rows))
      .map([&](Simulation result) {
        result.plant = plant;
        return result;
      });
}

ExpectedAll<Simulation> mechanism_closed_loop(const Project& project) {
  const ModelRun& run = project.mechanism_run;
  FLYBALL_TRY(auto designed, design(project.job));
  if (run.duration_is_given || !run.initial.array().isNaN().all()) {
    auto tried = simulate_design(
        designed, {.measurement_noise = designed.job.estimator.measurement_std.value_or(0.0),
                   .seed = designed.job.seed,
                   .initial = mechanism_state(run),
                   .duration = run.duration_is_given ? std::optional(run.duration) : std::nullopt});
    if (!tried) {
      return refused(in_simulate, std::move(tried).error(), std::move(designed.diagnostics));
    }
    designed.response = std::move(tried->series);
  }
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
  result.plant = plant;
  result.diagnostics = std::move(designed.diagnostics);
  summarize(result);
  return result;
}

/// What [simulation] says for the other kind of loop is not lost without a word.
void tell_unused(const SimulationSection& said, Simulation& result) {
  const auto tell = [&](std::string_view key, bool is_said) {
    if (is_said) {
      warn(result.diagnostics, "not_used", "simulation.{} is of {} loop and not used in this one",
           key, result.closed_loop ? "an open" : "a closed");
    }
  };
  if (result.closed_loop) {
    tell("input", !said.input.empty());
    tell("step", said.step.has_value());
  } else {
    tell("noise", !said.noise.empty());
    tell("resolution", !said.resolution.empty());
  }
}

}  // namespace

Expected<Simulation> simulate_open_loop(const ModelJob& job) {
  const ModelRun& run = job.run;
  const AnyModel& model = job.model;
  VectorXd initial = or_else(run.initial, job.x);
  if (job.find_equilibrium && run.initial.array().isNaN().any()) {
    FLYBALL_TRY(const auto point, operating_point(job));
    initial = or_else(run.initial, point.x);
  }
  FLYBALL_TRY(Rows rows, rows_of(model.names(), run));
  FLYBALL_CHECK(model.check(initial, run.input(0.0), in_simulate, 0.0));
  constexpr double most_of_the_run = 0.02;  // so that no step jumps over a pulse of an input
  constexpr double most_numbers = 4e6;      // that the steps may keep
  const double most_steps =
      std::clamp(most_numbers / static_cast<double>(model.states()), 1e4, 1e6);
  const IntegrationOptions options{.relative_tolerance = run.accuracy,
                                   .absolute_tolerance = run.accuracy,
                                   .max_step = most_of_the_run * run.duration,
                                   .max_steps = static_cast<int>(most_steps)};
  auto solution = integrate(with_input(model, run.input), 0.0, initial, run.duration, options);
  if (!solution) {
    Error error = explained(std::move(solution).error(), model, run.input, in_simulate);
    if (error.is(IntegrationError::too_many_steps)) {
      error = std::move(error)
                  .about("the end of the simulation")
                  .got(fmt::format("not reached in {} steps", format_number(most_steps, 7)))
                  .hint("simulate for less time, or with a larger simulation.accuracy");
    }
    return tl::unexpected(std::move(error));
  }
  for (Index k = 0; k < rows.x.cols(); ++k) {
    const double t = rows.time[static_cast<std::size_t>(k)];
    rows.x.col(k) = solution->at(t);
    rows.u.col(k) = run.input(t);
    rows.y.col(k) = model.output(rows.x.col(k), rows.u.col(k));
    if (!rows.y.col(k).allFinite()) {
      FLYBALL_CHECK(model.check(rows.x.col(k), rows.u.col(k), in_simulate, t));
    }
  }
  return recorded(described(model.names(), job.path, run, job.outputs_are_states), std::move(rows));
}

Expected<Simulation> simulate_with(const ModelJob& job, const ModelRegulator& regulator,
                                   const ModelRun& run, ControlLaw law) {
  const AnyModel& model = job.model;
  if (run.duration < job.period) {
    return refusal(ArgumentError::out_of_range, in_simulate, "simulation.duration")
        .got(fmt::format("{} s", format_number(run.duration)))
        .expected(
            fmt::format("at least a period of the controller, {} s", format_number(job.period)));
  }
  FLYBALL_TRY(
      const Index periods,
      steps_of(run.duration, job.period, 3 * (model.states() + model.inputs() + model.outputs())));
  ClosedLoop loop{.period = Time(job.period),
                  .reference = or_else(job.reference, regulator.point.x).replicate(1, periods + 1),
                  .record_step = Time(job.period),
                  .seed = run.seed};
  for (std::size_t i = 0; i < run.noise.size(); ++i) {
    loop.sensors.push_back({.resolution = run.resolution[i], .noise = run.noise[i]});
  }
  for (Index i = 0; i < job.limit.size(); ++i) {
    loop.actuators.push_back({.min = -job.limit(i), .max = job.limit(i), .delay = Time(job.delay)});
  }
  FLYBALL_TRY(auto plant, ModelPlant::create(model, or_else(run.initial, regulator.point.x),
                                             {.accuracy = run.accuracy}));
  auto looped = flyball::simulate_closed_loop(plant, law, loop);
  if (!looped) {
    return tl::unexpected(std::move(looped).error().in(std::string(in_simulate)));
  }
  Simulation result = described(model.names(), job.path, run, job.outputs_are_states);
  result.closed_loop = true;
  result.period = job.period;
  result.limits.assign(job.limit.begin(), job.limit.end());
  result.series = std::move(looped->series);
  result.duration = result.series.time().back();
  result.diagnostics = regulator.diagnostics;
  summarize(result);
  return result;
}

namespace {

Expected<Simulation> closed_loop(const ModelJob& job, const ModelRegulator& regulator) {
  FLYBALL_TRY(auto law, Regulating::create(job, regulator));
  return simulate_with(job, regulator, job.run, law);
}

}  // namespace

ExpectedAll<Simulation> simulate_closed_loop(const ModelJob& job, const ModelRegulator& regulator) {
  if (auto simulation = closed_loop(job, regulator)) {
    return *std::move(simulation);
  } else {
    return refused(in_simulate, std::move(simulation).error(), regulator.diagnostics);
  }
}

ExpectedAll<Simulation> simulate(const Project& project) {
  const auto run = [&]() -> ExpectedAll<Simulation> {
    if (!project.model_job && project.mechanism_run.closed_loop) {
      return mechanism_closed_loop(project);
    }
    if (!project.model_job) {
      return mechanism_open_loop(project);
    }
    const ModelJob& job = *project.model_job;
    if (!job.run.closed_loop) {
      return simulate_open_loop(job);
    }
    FLYBALL_TRY(const auto regulator, regulate(job));
    if (job.swing_up.has_energy) {
      FLYBALL_TRY(const auto region, region_of(job, regulator));
      return swing_up(job, regulator, region).map([&](SwingUpRunResult result) {
        doubt_energy(job, regulator, result.simulation.diagnostics);
        return std::move(result.simulation);
      });
    }
    return simulate_closed_loop(job, regulator);
  };
  if (!project.model_job && project.plant_error) {
    return tl::unexpected(*project.plant_error);
  }
  FLYBALL_TRY(auto result, run());
  tell_unused(project.simulation, result);
  return result;
}

ExpectedAll<ModelDesign> design_model(const ModelJob& job) {
  FLYBALL_TRY(auto regulator, regulate(job));
  ModelDesign result{.job = job, .regulator = std::move(regulator), .simulation = {}};
  const ModelRegulator& made = result.regulator;
  ModelRun& run = result.job.run;
  const bool afar = job.swing_up.has_energy;  // then the start is the swing-up's
  if (afar || run.initial.array().isNaN().all()) {
    constexpr double share = 0.2;
    run.initial = made.point.x.array() + share * made.Q.diagonal().array().rsqrt();
    note(result.regulator.diagnostics, "assumed",
         "the {} begins a fifth of each tolerance beside the point ({})",
         afar ? "regulator's own simulation" : "simulation",
         afar ? "simulation.initial is where the swing-up begins"
              : "simulation.initial says another");
  }
  if (afar || !job.run.duration_is_given) {
    // Eight time constants of the slowest pole of the loop as it runs.
    constexpr double time_constants = 8.0;
    const double constant = std::isfinite(made.time_constant) ? made.time_constant : job.period;
    run.duration = std::clamp(time_constants * constant, 10.0 * job.period, 60.0);
  }
  result.regulator.frequency_responses = loop_responses(made, Time(job.delay));
  FLYBALL_TRY(result.simulation, simulate_closed_loop(result.job, made));
  result.job.run = job.run;
  if (wants_region(job, made)) {
    auto region = region_of(job, made);
    if (region) {
      result.region = *std::move(region);
    } else if (afar) {
      return refused(in_simulate, std::move(region).error(), made.diagnostics);
    } else {
      note(result.regulator.diagnostics, "no_region", "no region of attraction is proven: {}",
           to_string(region.error()));
    }
  }
  if (afar) {
    auto swung = swing_up(job, made, *result.region);
    if (!swung) {
      return refused(in_simulate, std::move(swung).error(), made.diagnostics);
    }
    result.swing_up = *std::move(swung);
    doubt_energy(job, made, result.regulator.diagnostics);
  }
  result.simulation.diagnostics = result.regulator.diagnostics;
  return result;
}

}  // namespace flyball::study
