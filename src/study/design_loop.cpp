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
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/mechanisms/velocity_servo.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "study/design_steps.hpp"
#include "study/told.hpp"

// The plant, and the loop that a choice of tolerances gives.
namespace flyball::study {

using mechanisms::MechanismKind;

namespace {

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

}  // namespace

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

Expected<LinearModel> linear_model(const PlantDescription& plant, double period) {
  LinearModel model;
  const Coordinate position{"position", plant.unit};
  const Coordinate velocity{"velocity", plant.unit + "/s"};
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
    FLYBALL_TRY(auto built, mechanisms::flywheel(plant.gains));
    take(model, built);
    model.states = {velocity};
  } else {
    FLYBALL_TRY(auto built, plant.kind == MechanismKind::elevator
                                ? mechanisms::elevator(plant.gains)
                                : mechanisms::arm(plant.gains));
    take(model, built);
    model.states = {position, velocity};
  }
  FLYBALL_TRY(auto discrete,
              told_of("controller.period", discretize_zoh(model.A, model.B, Time(period))));
  model.discrete = {discrete.A, discrete.B, model.C, zero, Time(period)};
  return model;
}

Diagnostic unknown_kA(MechanismKind kind) {
  return {"kA_not_determined", Severity::info,
          kind == MechanismKind::flywheel
              ? "kA is not known: the flywheel is taken to follow its voltage within a period, and "
                "feedforward alone drives it"
              : "kA is not known: the velocity is taken as the input (Theorem 14.3.2)"};
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
    return refusal(ArgumentError::wrong_shape, "design", "controller.state_tolerance")
        .got(fmt::format("{} values long", tolerances.size()))
        .expected(fmt::format("one value a state: {}", fmt::join(labels(model.states), ", ")));
  }
  LoopDesign loop;
  FLYBALL_TRY(loop.Q, told_of("controller.state_tolerance", bryson(tolerances)));
  FLYBALL_TRY(loop.R, told_of("controller.input_tolerance", bryson({controller.input_tolerance})));
  FLYBALL_TRY(auto regulator, lqr(plant, loop.Q, loop.R));
  loop.K = regulator.K;
  loop.poles = regulator.poles;

  auto delayed = compensate_latency(loop.K, plant.A, plant.B, plant.period, delay);
  if (!delayed && delayed.error().is(MatrixFunctionError::no_real_power)) {
    // A closed-loop pole on the negative real axis has no real fractional power.
    loop.whole_periods = true;
    const Time whole(std::round(delay.si() / plant.period.si()) * plant.period.si());
    delayed = compensate_latency(loop.K, plant.A, plant.B, plant.period, whole);
  }
  FLYBALL_TRY(loop.K_delayed, told_of("controller.delay", std::move(delayed)));

  const double sigma = measurement_std(job);
  FLYBALL_TRY(auto observer, told_of("the observer",
                                     kalman_gain(plant, process_covariance(model, job),
                                                 standard_deviations({sigma})),
                                     "raise estimator.model_std, or leave it out"));
  loop.kalman_gain = observer.K;
  loop.estimator_poles = observer.poles;

  FLYBALL_TRY(const auto inversion, pseudoinverse(plant.B));
  loop.inversion = inversion.X;

  FLYBALL_TRY(auto opened, observer_regulator_loop(model.A, model.B, model.C, plant, loop.K_delayed,
                                                   loop.kalman_gain, delay));
  FLYBALL_TRY(auto margins, stability_margins(opened));
  loop.margins = std::move(margins);
  FLYBALL_TRY(auto grid, robustness_grid(model.A, model.B, model.C, plant, loop.K_delayed,
                                         loop.kalman_gain, delay));
  loop.robustness = std::move(grid);
  return loop;
}

bool is_comfortable(const LoopDesign& loop) {
  const StabilityMargins& margins = loop.margins;
  return margins.stable && margins.gain_margin_up >= 2.0 && margins.phase_margin >= 45.0 &&
         margins.disk_margin >= 0.5 && loop.robustness.all_stable;
}

}  // namespace flyball::study
