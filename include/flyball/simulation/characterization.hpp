#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include <flyball/core/expected.hpp>
#include <flyball/identification/recording.hpp>
#include <flyball/mechanisms/mechanism_kind.hpp>

namespace flyball {

/// What real mechanisms and logs have and the model of the four gains has not; nothing of it unless
/// it is said.
struct SessionDefects {
  double spring = 0.0;              ///< V/unit, pulls to the middle of the travel.
  double drag = 0.0;                ///< V/(unit/s)², against v |v|.
  double friction_asymmetry = 0.0;  ///< kS (1 + it) forward, kS (1 − it) in reverse; in (−1, 1).
  double headroom = std::numeric_limits<double>::infinity();  ///< V, of |V − kV v|: a current
                                                              ///< limit. The command is recorded.
  /// Resistance of battery and wires over the motor's: V is a duty of 12 V, which sags. Recorded is
  /// the command.
  double sag = 0.0;
  double backlash = 0.0;  ///< unit, between the motor, on which the encoder is, and the load.
  bool stale_first_row = false;  ///< The first row's position is 0.
  double slip = 0.0;             ///< unit, by which the position jumps twice in each test.
  double position_delay = 0.0;   ///< s, beyond sensor_delay.
  double velocity_delay = 0.0;   ///< s, beyond sensor_delay.
};

/// A characterization session to be recorded: a mechanism with known gains, driven through the
/// four tests, seen through the sensors and the logger that real robots have.
struct CharacterizationOptions {
  mechanisms::MechanismKind mechanism = mechanisms::MechanismKind::flywheel;
  double kS = 0.2;            ///< V, static friction.
  double kV = 0.02;           ///< V/(unit/s), > 0.
  double kA = 0.004;          ///< V/(unit/s²), > 0.
  double kG = 0.0;            ///< V, gravity (elevator, arm).
  double angle_offset = 0.0;  ///< rad, arm: true angle from horizontal − angle the encoder shows.
  double friction_variation = 0.0;  ///< Relative amplitude of kS along the travel, in [0, 1).
  double breakaway = 1.0;           ///< Friction at rest over friction in motion, ≥ 1.
  SessionDefects defects{};

  double ramp_rate = 0.25;      ///< V/s, quasistatic.
  double step_voltage = 6.0;    ///< V, dynamic.
  double ramp_limit = 6.0;      ///< V, where a ramp ends at the latest.
  double step_duration = 2.0;   ///< s, of a dynamic test at the longest.
  double rest_before = 0.05;    ///< s, recorded at rest (held) before the voltage rises.
  double coast_after = 0.1;     ///< s, recorded after the voltage is cut.
  double travel_low = -1.0;     ///< unit, true position (elevators and arms).
  double travel_high = 1.0;     ///< unit.
  double travel_margin = 0.05;  ///< unit, tests end that far from the end of the travel.

  double row_period = 5e-3;        ///< s.
  double row_jitter = 0.0;         ///< s, standard deviation of a row's time.
  double sensor_refresh = 20e-3;   ///< s, both channels; rows in between repeat the value.
  double sensor_delay = 0.0;       ///< s, age of a value when it is refreshed.
  double resolution = 0.0;         ///< unit, encoder step; 0: none.
  double velocity_window = 40e-3;  ///< s, moving average in the velocity; 0: none.
  /// unit/s, standard deviation of the velocity noise; not given: 0.5 % of (step_voltage − kS)/kV.
  std::optional<double> velocity_noise{};
  bool noise_per_row = false;   ///< Noise drawn anew in each row, also where the value repeats.
  double voltage_noise = 0.02;  ///< V, standard deviation of the recorded voltage.
  std::uint64_t seed = 1;
};

/// Records the four tests. The friction model is integrated exactly within each step (sticking and
/// slipping), the voltage is held over a row.
///
/// @return  A recording as a log of it would read.
/// @errors ArgumentError::not_finite, not_positive, out_of_range for the option that is wrong.
/// Cost: O(duration / 0.25 ms).
[[nodiscard]] Expected<identification::Recording> record_characterization(
    const CharacterizationOptions& options);

}  // namespace flyball
