#include <flyball/study/simulate.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

}  // namespace

RegulatorDesign regulator_of(const DesignResult& design) {
  const DesignJob& job = design.job;
  RegulatorDesign regulator;
  regulator.kind = job.plant.kind;
  regulator.gains = job.plant.gains;
  regulator.plant = {design.A, design.B, design.C, Eigen::MatrixXd::Zero(1, 1),
                     Time(job.controller.period)};
  regulator.K = design.K_delayed;
  regulator.K_e = design.kalman_gain;
  regulator.max_voltage = job.controller.max_voltage;
  regulator.nominal_voltage = job.plant.nominal_voltage;
  regulator.measurement_delay = Time(job.controller.delay.value_or(0.0));
  return regulator;
}

std::vector<MotionState> reference_of(const DesignResult& design) {
  constexpr double hold = 0.5;  // s, to see it settle
  const double T = design.job.controller.period;
  const double goal = design.motion.goal;
  const auto rows = static_cast<std::size_t>(std::ceil((design.motion.duration + hold) / T)) + 1;
  std::vector<MotionState> reference(rows);
  if (design.job.plant.kind == MechanismKind::flywheel) {
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

Expected<ClosedLoopResult> simulate(const DesignResult& design, const SimulateJob& job) {
  constexpr std::string_view where = "simulate";
  FLYBALL_CHECK(Checks(where)
                    .positive(job.inertia_factor, "inertia_factor")
                    .positive(job.gain_factor, "gain_factor")
                    .not_negative(job.measurement_noise, "measurement_noise"));
  const DesignJob& designed = design.job;
  ClosedLoopJob loop;
  loop.regulator = regulator_of(design);
  loop.truth.gains = designed.plant.gains;
  // A larger inertia needs more volts to accelerate; a larger gain fewer volts for everything.
  loop.truth.gains.kA *= job.inertia_factor / job.gain_factor;
  loop.truth.gains.kV /= job.gain_factor;
  loop.truth.battery.open_circuit_voltage = designed.battery.open_circuit_voltage;
  loop.truth.battery.resistance = designed.battery.resistance;
  if (designed.plant.motor) {
    loop.truth.motor_resistance = designed.plant.motor->R;
  }
  loop.truth.sensor.resolution = designed.sensor.resolution;
  loop.truth.sensor.noise = job.measurement_noise;
  loop.truth.sensor.delay = Time(designed.controller.delay.value_or(0.0));
  loop.reference = reference_of(design);
  loop.seed = job.seed;
  return flyball::simulate(loop);
}

}  // namespace flyball::study
