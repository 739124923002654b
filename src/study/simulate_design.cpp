#include <flyball/study/simulate_design.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

#include "core/try.hpp"

namespace flyball::study {

using mechanisms::MechanismKind;

MechanismControllerDesign controller_of(const DesignResult& design) {
  const DesignJob& job = design.job;
  MechanismControllerDesign controller;
  controller.kind = job.plant.kind;
  controller.gains = job.plant.gains;
  controller.gains.kA = job.plant.kA_determined ? job.plant.gains.kA : 0.0;
  controller.plant = {design.A, design.B, design.C, Eigen::MatrixXd::Zero(1, 1),
                      Time(job.controller.period)};
  controller.K = design.K_delayed;
  controller.K_e = design.kalman_gain;
  controller.max_voltage = job.controller.max_voltage;
  controller.nominal_voltage = job.plant.nominal_voltage;
  controller.measurement_delay = Time(job.controller.delay.value_or(0.0));
  if (design.predicts) {
    controller.predicts_with = {design.A_continuous, design.B_continuous, design.C,
                                Eigen::MatrixXd::Zero(1, 1)};
  }
  return controller;
}

namespace {

constexpr double hold = 0.5;  // s after the motion, to see it settle
constexpr double most_periods = 1e6;

double periods_of(const DesignResult& design, std::optional<double> duration) {
  return std::ceil(duration.value_or(design.motion.duration + hold) / design.job.controller.period -
                   1e-9);
}

}  // namespace

std::vector<MotionState> reference_of(const DesignResult& design, std::optional<double> duration) {
  const double T = design.job.controller.period;
  const double goal = design.motion.goal;
  const auto rows =
      static_cast<std::size_t>(std::min(periods_of(design, duration), most_periods)) + 1;
  std::vector<MotionState> reference(rows);
  if (controls_velocity(design.job.plant.kind)) {
    // A flywheel's motion is a ramp of its velocity.
    const double a = std::copysign(design.motion.max_acceleration, goal);
    for (std::size_t k = 0; k < rows; ++k) {
      const double t = static_cast<double>(k) * T;
      const bool ramp = std::abs(a * t) < std::abs(goal);
      reference[k] = {0.0, ramp ? a * t : goal, ramp ? a : 0.0};
    }
    return reference;
  }
  const TrapezoidProfile profile({design.motion.max_velocity, design.motion.max_acceleration}, {},
                                 {goal, 0.0, 0.0});
  for (std::size_t k = 0; k < rows; ++k) {
    reference[k] = profile.sample(static_cast<double>(k) * T);
  }
  return reference;
}

Expected<MechanismResponse> simulate_design(const DesignResult& design, const DesignTrial& trial) {
  constexpr std::string_view where = "simulate_design";
  FLYBALL_CHECK(Checks(where)
                    .positive(trial.inertia_factor, "inertia_factor")
                    .positive(trial.gain_factor, "gain_factor")
                    .positive(trial.duration.value_or(1.0), "duration", "s")
                    .not_negative(trial.measurement_noise, "measurement_noise"));
  if (const double periods = periods_of(design, trial.duration); !(periods <= most_periods)) {
    return refusal(ArgumentError::out_of_range, where, "the motion")
        .got(fmt::format("{} periods of controller.period long", format_number(periods, 3)))
        .expected(fmt::format("at most {} of them", format_number(most_periods, 7)))
        .hint(
            "bring profile.goal nearer, raise profile.max_velocity, shorten the duration or "
            "lengthen the period");
  }
  const DesignJob& designed = design.job;
  MechanismLoop loop;
  loop.controller = controller_of(design);
  loop.truth.gains = designed.plant.gains;
  // A larger inertia needs more volts to accelerate; a larger gain fewer volts for everything.
  if (!designed.plant.kA_determined) {
    loop.truth.gains.kA = designed.plant.kA_upper_bound;
  }
  loop.truth.gains.kA *= trial.inertia_factor / trial.gain_factor;
  loop.truth.gains.kV /= trial.gain_factor;
  loop.truth.battery.open_circuit_voltage = designed.battery.open_circuit_voltage;
  loop.truth.battery.resistance = designed.battery.resistance;
  if (designed.plant.motor) {
    loop.truth.motor_resistance = designed.plant.motor->R;
  }
  loop.truth.sensor.resolution = designed.sensor.resolution;
  loop.truth.sensor.noise = trial.measurement_noise;
  loop.truth.sensor.delay = Time(designed.controller.delay.value_or(0.0));
  loop.reference = reference_of(design, trial.duration);
  loop.initial = trial.initial;
  loop.seed = trial.seed;
  return simulate_mechanism(loop);
}

}  // namespace flyball::study
