#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/identification/recording.hpp>

namespace flyball::identification {

/// A run made fit for fitting: rows sorted, finite, signs corrected, its usable window marked.
struct PreparedRun {
  TestRun run;              ///< The rows kept; time starts as recorded.
  std::size_t source = 0;   ///< Index of the run in the recording.
  bool begins_cut = false;  ///< Rows before its first were cut by a person.
  bool moved = false;       ///< Whether the mechanism moved as the voltage asked.
  double direction = 1.0;   ///< Sign of the motion.

  std::size_t first = 0;        ///< First row of the usable window (start of the simulation).
  std::size_t last = 0;         ///< One past the last row of the usable window.
  bool starts_at_rest = false;  ///< The window starts before the motion does.
  std::vector<double> smoothed_velocity;  ///< Velocity over a window of about 70 ms, per row.

  /// Rows at which the encoder's value was refreshed (loggers repeat the last value in between).
  std::vector<std::size_t> fresh_position;
  std::vector<std::size_t> fresh_velocity;
};

/// All runs, with what was found while preparing them.
struct PreparedRecording {
  std::optional<mechanisms::MechanismKind> mechanism;
  std::string unit;
  std::vector<PreparedRun> runs;  ///< One per run of the recording that has two or more rows.
  bool has_position = false;
  bool has_velocity = false;
  double row_period = 0.0;               ///< s, median distance of rows.
  double position_refresh_period = 0.0;  ///< s, median distance of new positions while moving.
  double velocity_refresh_period = 0.0;  ///< s, the same of velocities.
  double position_quantum = 0.0;         ///< m or rad, smallest step of the position.
  double velocity_quantum = 0.0;         ///< m/s or rad/s, smallest step of the velocity.
  double top_speed = 0.0;                ///< m/s or rad/s, over all runs.
  double velocity_scale = 1.0;           ///< Velocity column over derivative of the position.
  std::vector<Diagnostic> diagnostics;
};

/// What counts as motion and where runs are trimmed.
struct PreparationOptions {
  std::optional<mechanisms::MechanismKind> mechanism;  ///< Overrides the recording's.
  double motion_threshold =
      0.04;  ///< Ramps start at sustained motion above this share of top speed.
  double voltage_threshold =
      0.15;                   ///< Trailing rows below this share of the run's voltage are cut.
  double stall_margin = 0.1;  ///< s, cut before the mechanism stalls under voltage.
};

/// Sorts, screens and trims a recording. It never refuses for what the data say, only for malformed
/// columns: a recording without motion comes back with runs that did not move and the diagnostics
/// that say so, so that everything can still be plotted.
///
/// @param recording  Columns of equal length per run, SI.
/// @return  The prepared runs and the diagnostics.
/// @errors ArgumentError::wrong_shape if the columns of a run differ in length or it has neither
///         position nor velocity; out_of_range for rows more than a second apart.
/// Cost: O(rows log rows); allocates.
[[nodiscard]] Expected<PreparedRecording> prepare(const Recording& recording,
                                                  const PreparationOptions& options = {});

}  // namespace flyball::identification
