#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <flyball/core/time_series.hpp>
#include <flyball/mechanisms/mechanism.hpp>
#include <flyball/planning/trapezoid_profile.hpp>
#include <flyball/simulation/battery.hpp>
#include <flyball/simulation/mechanism_plant.hpp>
#include <flyball/simulation/sensor.hpp>

namespace flyball {

/// What a robot runs: the observer-based regulator with the feedforward of what is not linear.
struct RegulatorDesign {
  mechanisms::MechanismKind kind = mechanisms::MechanismKind::flywheel;
  /// Believed gains; kS and gravity are fed forward.
  mechanisms::FeedforwardGains gains{};
  /// Discrete model in volts: states [velocity] (flywheel), [position, velocity], or [position] for
  /// a mechanism that is faster than the period.
  DiscreteSystem<> plant{};
  Eigen::MatrixXd K;    ///< 1 x n
  Eigen::MatrixXd K_e;  ///< n x 1, filter form.
  double max_voltage = 12.0;
  double nominal_voltage = 12.0;
  bool feed_forward_gravity = true;
  bool feed_forward_friction = true;
  bool compensate_voltage = true;  ///< (6.23) with the rail voltage measured at each sample.
  /// Age of a measurement, s. It is moved along the reference to now, y + delay dr/dt, so that a
  /// late sensor causes no error while the reference moves; the loop itself is not changed.
  Time measurement_delay{};
};

/// What the regulator meets.
struct PlantTruth {
  mechanisms::FeedforwardGains gains{};  ///< True gains.
  double breakaway = 1.0;                ///< Static over sliding friction.
  double motor_resistance = std::numeric_limits<double>::infinity();  ///< Ω, for the battery.
  Battery battery{};
  SensorModel sensor{};        ///< Of the velocity (flywheel), else of the position.
  Time actuation_delay{};      ///< From the sample to the change of the voltage, s.
  double voltage_noise = 0.0;  ///< V, standard deviation of the applied voltage of each period.
};

/// A closed loop to simulate.
struct ClosedLoopJob {
  RegulatorDesign regulator{};
  PlantTruth truth{};
  std::vector<MotionState> reference{};  ///< One a period; a flywheel's is its velocity.
  MechanismState initial{};
  std::uint64_t seed = 1;
};

/// What it answered.
struct ClosedLoopResult {
  /// One row a period; columns (with units): "reference_position", "reference_velocity",
  /// "position", "velocity" (the truth), "measurement", "estimated_position",
  /// "estimated_velocity" (those that the model has), "voltage" (asked for), "command" (sent),
  /// "motor_voltage" (seen by the motor, mean of the period), "rail_voltage", "current" (A of the
  /// battery, 0 without a motor resistance).
  TimeSeries series{};
  double rms_error = 0.0;           ///< Of the controlled quantity, over all rows.
  double max_error = 0.0;           ///< Its largest magnitude.
  double final_error = 0.0;         ///< Reference less truth at the last row.
  double peak_voltage = 0.0;        ///< Largest |motor voltage|, V.
  double saturated_fraction = 0.0;  ///< Share of the periods in which the limit was reached.
};

/// Closes the loop over a mechanism that is not linear, with what sensors, delay and battery do.
/// Deterministic: the same job gives the same numbers.
/// @errors ArgumentError for shapes, entries, an empty reference.
[[nodiscard]] Expected<ClosedLoopResult> simulate(const ClosedLoopJob& job);

/// A linear loop without noise, as the book's figures close it.
struct LinearLoop {
  DiscreteSystem<> plant{};              ///< Truth and model.
  Eigen::MatrixXd K;                     ///< m x n
  std::optional<Eigen::MatrixXd> K_e{};  ///< n x p, filter form; none feeds the true state back.
  bool plant_inversion = true;
  Eigen::VectorXd u_min{};
  Eigen::VectorXd u_max{};
  Eigen::VectorXd x0{};  ///< n; empty is zero.
};

/// Trajectories, one column a row of the reference.
struct LinearTrajectory {
  Eigen::VectorXd time{};   ///< s
  Eigen::MatrixXd x;        ///< n x samples
  Eigen::MatrixXd x_hat{};  ///< n x samples; x without an observer.
  Eigen::MatrixXd y;        ///< p x samples
  Eigen::MatrixXd u;        ///< m x samples
};

/// Each sample: x = A x + B u_previous; the observer predicts with u_previous and corrects with
/// y = C x + D u_previous; u = clamp(B⁺ (r_next - A r) + K (r - x_hat)). At the last sample the
/// next reference is the last one.
/// @param r  n x samples, the references.
/// @errors ArgumentError for shapes and entries.
[[nodiscard]] Expected<LinearTrajectory> simulate_linear(const LinearLoop& loop,
                                                         const MatrixRef& r);

}  // namespace flyball
