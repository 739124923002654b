#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <flyball/control/mechanism_controller.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/mechanisms/battery.hpp>
#include <flyball/simulation/mechanism_plant.hpp>
#include <flyball/simulation/sensor.hpp>

namespace flyball {

/// The mechanism that a controller meets, and what is between them.
struct MechanismTruth {
  mechanisms::FeedforwardGains gains{};  ///< True gains.
  double breakaway = 1.0;                ///< Static over sliding friction.
  double motor_resistance = std::numeric_limits<double>::infinity();  ///< Ω, for the battery.
  mechanisms::Battery battery{};
  SensorModel sensor{};        ///< Of the velocity (flywheel), else of the position.
  Time actuation_delay{};      ///< From the sample to the change of the voltage, s.
  double voltage_noise = 0.0;  ///< V, standard deviation of the applied voltage of each period.
};

/// A mechanism's loop to simulate.
struct MechanismLoop {
  MechanismControllerDesign controller{};
  MechanismTruth truth{};
  std::vector<MotionState> reference{};  ///< One a period; a flywheel's is its velocity.
  MechanismState initial{};
  std::uint64_t seed = 1;
};

/// What it answered.
struct MechanismResponse {
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

/// Closes the loop that the robot runs (MechanismController) over a mechanism that is not linear,
/// with what sensors, delay and battery do. Deterministic: the same loop gives the same numbers.
/// @errors Those of MechanismController, MechanismPlant and Sensor; ArgumentError for entries that
/// are not finite or out of range, and an empty reference.
[[nodiscard]] Expected<MechanismResponse> simulate_mechanism(const MechanismLoop& loop);

}  // namespace flyball
