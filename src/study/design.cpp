#include <flyball/study/design.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/latency.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/math/matrix_function.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/velocity_servo.hpp>
#include <flyball/study/simulate.hpp>
#include <flyball/systems/discretize.hpp>

#include "study/design_steps.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

constexpr std::string_view where = "design";

Expected<void> check_job(const DesignJob& job) {
  const mechanisms::FeedforwardGains& gains = job.plant.gains;
  const ControllerOptions& controller = job.controller;
  if (auto checked = check_all(
          check_positive(gains.kV, where, "kV"), check_not_negative(gains.kS, where, "kS", "V"),
          check_finite(gains.kG, where, "kG"),
          check_finite(gains.angle_offset, where, "angle_offset"),
          check_positive(controller.period, where, "period", "s"),
          check_positive(controller.input_tolerance, where, "input_tolerance", "V"),
          check_positive(controller.max_voltage, where, "max_voltage", "V"),
          check_not_negative(controller.delay.value_or(0.0), where, "delay", "s"),
          check_not_negative(job.sensor.resolution, where, "resolution", job.plant.unit),
          check_positive(job.battery.open_circuit_voltage, where, "open_circuit_voltage", "V"),
          check_not_negative(job.battery.resistance, where, "battery resistance", "Ohm"));
      !checked) {
    return checked;
  }
  return job.plant.kA_determined ? check_positive(gains.kA, where, "kA") : Expected<void>{};
}

template <class Mechanism>
void take(LinearModel& model, const Mechanism& mechanism) {
  model.A = mechanism.A;
  model.B = mechanism.B;
  model.C = mechanism.C;
}

double top_speed(const PlantDescription& plant) {
  return plant.nominal_voltage / plant.gains.kV;
}

// Process noise per sample: the model's voltage is believed to within half a volt.
Eigen::MatrixXd process_covariance(const LinearModel& model, const DesignJob& job) {
  if (!job.estimator.model_std.empty()) {
    const Eigen::Map<const Eigen::VectorXd> std(
        job.estimator.model_std.data(), static_cast<Eigen::Index>(job.estimator.model_std.size()));
    return std.array().square().matrix().asDiagonal();
  }
  constexpr double voltage_std = 0.5;
  const Eigen::MatrixXd Bv = model.discrete.B * voltage_std;
  return Bv * Bv.transpose();
}

double measurement_std(const DesignJob& job) {
  if (job.estimator.measurement_std) {
    return *job.estimator.measurement_std;
  }
  // A quantised reading errs uniformly over one step: q/√12.
  const double quantisation = job.sensor.resolution / std::sqrt(12.0);
  const double floor = job.plant.kind == MechanismKind::flywheel ? 0.005 * top_speed(job.plant)
                       : job.plant.unit == "m"                   ? 5e-4
                                                                 : 1e-3;
  return std::max(quantisation, floor);
}

void fill_defaults(DesignJob& job, std::vector<Diagnostic>& diagnostics) {
  if (!job.controller.delay) {
    job.controller.delay = 0.0;
    diagnostics.push_back({"assumed", Severity::info,
                           "no delay was given: the loop is designed for none (set "
                           "controller.delay if the sensor is late)"});
  }
  if (!job.estimator.measurement_std) {
    job.estimator.measurement_std = measurement_std(job);
    diagnostics.push_back(
        {"assumed", Severity::info,
         fmt::format("the sensor's noise is taken as {} {}{} a sample",
                     format_number(*job.estimator.measurement_std, 3), job.plant.unit,
                     job.plant.kind == MechanismKind::flywheel ? "/s" : "")});
  }
}

// Of tolerances from tight to loose, takes those that leave comfortable margins and the stiffest
// loop. The tightest comfortable ones need not be it: the compensation of a long delay (B.12) turns
// an aggressive gain into nearly none.
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
    return tl::unexpected(
        Error(DesignError::margins_lost)
            .in(std::string(where))
            .about("the loop")
            .got(fmt::format("without margins at any tolerance with a delay of {} ms",
                             format_number(1e3 * job.controller.delay.value_or(0.0), 3)))
            .hint("shorten the delay or the period"));
  }
  std::vector<std::string> words;
  for (std::size_t k = 0; k < best_tolerances.size(); ++k) {
    words.push_back(
        fmt::format("{} for {}", format_number(best_tolerances[k], 3), model.states[k]));
  }
  diagnostics.push_back(
      {"assumed", Severity::info,
       fmt::format(
           "no tolerances were given: with {} the loop is the stiffest that keeps a gain margin of "
           "2, a phase margin of 45° and ±20 % of inertia and gain",
           fmt::join(words, ", "))});
  job.controller.state_tolerance = std::move(best_tolerances);
  return *std::move(best);
}

void add_margin_warnings(const LoopDesign& loop, const DesignJob& job,
                         std::vector<Diagnostic>& diagnostics) {
  if (!loop.margins.stable || is_comfortable(loop)) {
    return;
  }
  diagnostics.push_back(
      {"thin_margins", Severity::warning,
       fmt::format("the tolerances leave a gain margin of {}, a phase margin of {}° and {} over "
                   "±20 % of inertia and gain with {} ms of delay; looser tolerances are safer",
                   format_number(loop.margins.gain_margin_up, 3),
                   format_number(loop.margins.phase_margin, 3),
                   loop.robustness.all_stable ? "stability" : "no stability",
                   format_number(1e3 * job.controller.delay.value_or(0.0), 3))});
}

void simulate_response(DesignResult& result) {
  auto simulated = simulate(result, {.measurement_noise = *result.job.estimator.measurement_std,
                                     .seed = result.job.seed});
  if (!simulated) {
    result.diagnostics.push_back({"not_simulated", Severity::error, to_string(simulated.error())});
    return;
  }
  result.response = std::move(simulated->series);
  result.tracking_error_rms = simulated->rms_error;
  result.tracking_error_max = simulated->max_error;
}

}  // namespace

ErrorInfo error_info(DesignError code) {
  constexpr std::string_view family = "design";
  switch (code) {
    case DesignError::gravity_too_strong:
      return {family, "gravity_too_strong", "the motor cannot hold the mechanism",
              ErrorKind::no_answer};
    case DesignError::no_motion_possible:
      return {family, "no_motion_possible", "the motor cannot move the mechanism",
              ErrorKind::no_answer};
    case DesignError::margins_lost:
      return {family, "margins_lost", "the loop cannot be made robust", ErrorKind::no_answer};
  }
  return {family, "unknown", "unknown error", ErrorKind::defect};
}

Expected<LinearModel> linear_model(const PlantDescription& plant, double period) {
  LinearModel model;
  const std::string position = fmt::format("position ({})", plant.unit);
  const std::string velocity = fmt::format("velocity ({}/s)", plant.unit);
  const bool flywheel = plant.kind == MechanismKind::flywheel;
  const auto zero = Eigen::MatrixXd::Zero(1, 1);
  if (!plant.kA_determined) {
    model.states = {flywheel ? velocity : position};
    model.C = Eigen::MatrixXd::Identity(1, 1);
    if (flywheel) {
      // The velocity u/kV is reached within a period: x_{k+1} = u_k/kV. Its continuous model for
      // the margins is as fast as the period can show.
      const double kA = 0.1 * plant.gains.kV * period;
      model.A = Eigen::MatrixXd::Constant(1, 1, -plant.gains.kV / kA);
      model.B = Eigen::MatrixXd::Constant(1, 1, 1.0 / kA);
      model.discrete = {zero, Eigen::MatrixXd::Constant(1, 1, 1.0 / plant.gains.kV), model.C, zero,
                        Time(period)};
      return model;
    }
    // Theorem 14.3.2, its velocity written as the volts kV v.
    const auto servo = mechanisms::velocity_servo();
    model.A = servo.A;
    model.B = servo.B / plant.gains.kV;
    model.discrete = {Eigen::MatrixXd::Identity(1, 1), model.B * period, model.C, zero,
                      Time(period)};
    return model;
  }
  if (flywheel) {
    auto built = mechanisms::flywheel(plant.gains);
    if (!built) {
      return tl::unexpected(std::move(built).error());
    }
    take(model, *built);
    model.states = {velocity};
  } else {
    auto built = plant.kind == MechanismKind::elevator ? mechanisms::elevator(plant.gains)
                                                       : mechanisms::arm(plant.gains);
    if (!built) {
      return tl::unexpected(std::move(built).error());
    }
    take(model, *built);
    model.states = {position, velocity};
  }
  auto discrete = discretize_zoh(model.A, model.B, Time(period));
  if (!discrete) {
    return tl::unexpected(std::move(discrete).error());
  }
  model.discrete = {discrete->A, discrete->B, model.C, zero, Time(period)};
  return model;
}

std::vector<double> default_tolerances(const PlantDescription& plant, std::size_t states) {
  const double speed = top_speed(plant);
  std::vector<double> tolerances;
  if (plant.kind == MechanismKind::flywheel) {
    tolerances = {0.01 * speed};
  } else {
    const double position = plant.unit == "m" ? 0.005 : std::numbers::pi / 360.0;
    tolerances = {position, 0.1 * speed};
  }
  tolerances.resize(states);
  return tolerances;
}

Expected<LoopDesign> design_loop(const LinearModel& model, const DesignJob& job,
                                 const std::vector<double>& tolerances) {
  const ControllerOptions& controller = job.controller;
  const DiscreteSystem<>& plant = model.discrete;
  const Time delay(controller.delay.value_or(0.0));
  if (static_cast<Eigen::Index>(tolerances.size()) != plant.A.rows()) {
    return tl::unexpected(
        Error(ArgumentError::wrong_shape)
            .in(std::string(where))
            .about("state_tolerance")
            .got(fmt::format("{} values long", tolerances.size()))
            .expected(fmt::format("one value a state: {}", fmt::join(model.states, ", "))));
  }
  LoopDesign loop;
  auto Q = bryson(tolerances);
  auto R = bryson({controller.input_tolerance});
  if (!Q || !R) {
    return tl::unexpected(!Q ? Q.error() : R.error());
  }
  loop.Q = *Q;
  loop.R = *R;
  auto regulator = lqr(plant, *Q, *R);
  if (!regulator) {
    return tl::unexpected(std::move(regulator).error());
  }
  loop.K = regulator->K;
  loop.poles = regulator->poles;

  auto delayed = compensate_latency(loop.K, plant.A, plant.B, plant.period, delay);
  if (!delayed && delayed.error().is(MatrixFunctionError::no_real_power)) {
    // A closed-loop pole on the negative real axis has no real fractional power.
    loop.whole_periods = true;
    const Time whole(std::round(delay.si() / plant.period.si()) * plant.period.si());
    delayed = compensate_latency(loop.K, plant.A, plant.B, plant.period, whole);
  }
  if (!delayed) {
    return tl::unexpected(std::move(delayed).error());
  }
  loop.K_delayed = *delayed;

  const double sigma = measurement_std(job);
  auto observer = kalman_gain(plant, process_covariance(model, job), standard_deviations({sigma}));
  if (!observer) {
    return tl::unexpected(std::move(observer).error());
  }
  loop.kalman_gain = observer->K;
  loop.estimator_poles = observer->poles;

  const auto inversion = pseudoinverse(plant.B);
  if (!inversion) {
    return tl::unexpected(inversion.error());
  }
  loop.inversion = inversion->X;

  auto opened = observer_regulator_loop(model.A, model.B, model.C, plant, loop.K_delayed,
                                        loop.kalman_gain, delay);
  if (!opened) {
    return tl::unexpected(std::move(opened).error());
  }
  auto margins = stability_margins(*opened);
  if (!margins) {
    return tl::unexpected(std::move(margins).error());
  }
  loop.margins = *std::move(margins);
  auto grid =
      robustness_grid(model.A, model.B, model.C, plant, loop.K_delayed, loop.kalman_gain, delay);
  if (!grid) {
    return tl::unexpected(std::move(grid).error());
  }
  loop.robustness = *std::move(grid);
  return loop;
}

bool is_comfortable(const LoopDesign& loop) {
  const StabilityMargins& margins = loop.margins;
  return margins.stable && margins.gain_margin_up >= 2.0 && margins.phase_margin >= 45.0 &&
         margins.disk_margin >= 0.5 && loop.robustness.all_stable;
}

Expected<DesignResult> design(const DesignJob& requested) {
  if (auto checked = check_job(requested); !checked) {
    return tl::unexpected(checked.error());
  }
  DesignResult result;
  result.job = requested;
  DesignJob& job = result.job;
  fill_defaults(job, result.diagnostics);

  auto motion = motion_limits(job);
  if (!motion) {
    return tl::unexpected(std::move(motion).error());
  }
  result.motion = *motion;

  auto model = linear_model(job.plant, job.controller.period);
  if (!model) {
    return tl::unexpected(std::move(model).error());
  }
  result.velocity_servo = !job.plant.kA_determined;
  if (result.velocity_servo) {
    result.diagnostics.push_back(
        {"kA_not_determined", Severity::info,
         job.plant.kind == MechanismKind::flywheel
             ? "kA is not known: the flywheel is taken to follow its voltage within a period, and "
               "feedforward alone drives it"
             : "kA is not known: the velocity is taken as the input (Theorem 14.3.2)"});
  }
  const bool chosen = job.controller.state_tolerance.empty();
  // A person's tolerances are per position and velocity; a plant without kA has one state of them.
  if (!chosen && result.velocity_servo && job.controller.state_tolerance.size() == 2) {
    job.controller.state_tolerance.resize(1);
  }
  auto loop = chosen ? search_tolerances(*model, job, result.diagnostics)
                     : design_loop(*model, job, job.controller.state_tolerance);
  if (!loop) {
    return tl::unexpected(std::move(loop).error());
  }
  if (!loop->margins.stable) {
    return tl::unexpected(
        Error(DesignError::margins_lost)
            .in(std::string(where))
            .about("the loop")
            .got(fmt::format("unstable with its delay of {} ms",
                             format_number(1e3 * job.controller.delay.value_or(0.0), 3)))
            .hint("loosen controller.state_tolerance, or leave it out to have it chosen")
            .with("spectral_radius", loop->margins.spectral_radius));
  }
  if (!chosen) {
    add_margin_warnings(*loop, job, result.diagnostics);
  }
  if (loop->whole_periods) {
    result.diagnostics.push_back(
        {"delay_rounded", Severity::warning,
         "the delay was compensated in whole periods: the closed loop has a negative real pole, of "
         "which no real fraction of a period exists"});
  }

  result.states = model->states;
  result.A_continuous = model->A;
  result.B_continuous = model->B;
  result.A = model->discrete.A;
  result.B = model->discrete.B;
  result.C = model->discrete.C;
  result.Q = loop->Q;
  result.R = loop->R;
  result.K = loop->K;
  result.K_delayed = loop->K_delayed;
  result.poles = loop->poles;
  result.kalman_gain = loop->kalman_gain;
  result.estimator_poles = loop->estimator_poles;
  result.inversion = loop->inversion;

  const StabilityMargins& margins = loop->margins;
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
  for (const RobustnessCase& point : loop->robustness.cases) {
    result.robustness.push_back({.inertia_factor = point.inertia,
                                 .gain_factor = point.gain,
                                 .stable = point.stable,
                                 .spectral_radius = point.spectral_radius,
                                 .overshoot = point.overshoot});
  }
  result.robust = loop->robustness.all_stable;
  result.worst_overshoot = loop->robustness.worst_overshoot;

  result.paste = paste_gains(job.plant, result.K_delayed);
  simulate_response(result);
  return result;
}

}  // namespace flyball::study
