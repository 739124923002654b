#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// A log of WPILib's SysId (2021 to 2023), or of its forerunner frc-characterization (2019, 2020):
/// up to four tests, each a table.
struct SysIdJson {
  /// The four layouts of a row.
  enum class Layout {
    mechanism,              ///< 4 columns: t, volts, position, velocity.
    drive,                  ///< 9 columns: t, Vl, Vr, posl, posr, vell, velr, angle, rate.
    characterization_2019,  ///< 9 columns: t, battery, speed, Vl, Vr, posl, posr, vell, velr.
    characterization_2020,  ///< 10 columns: the same and the gyro's angle.
  };

  /// One test. All columns that the layout has are as long as `time`, sorted by time and finite.
  struct Run {
    std::string name;  ///< "slow-forward", "slow-backward", "fast-forward", "fast-backward".
    std::vector<double> time;      ///< s.
    std::vector<double> voltage;   ///< V, as recorded; a drive's left side.
    std::vector<double> position;  ///< Rotations, as recorded; a drive's left side.
    std::vector<double> velocity;  ///< Rotations per second, as recorded; a drive's left side.

    // Drives only; empty otherwise.
    std::vector<double> right_voltage;
    std::vector<double> right_position;
    std::vector<double> right_velocity;
    std::vector<double> angle;       ///< rad; not in 2019.
    std::vector<double> angle_rate;  ///< rad/s; Layout::drive only.

    [[nodiscard]] bool quasistatic() const { return name.starts_with("slow"); }
    [[nodiscard]] bool forward() const { return name.ends_with("forward"); }
  };

  Layout layout = Layout::mechanism;
  std::string test;   ///< "Simple", "Elevator", "Arm", "Drivetrain", …; empty if not said.
  std::string units;  ///< "Meters", "Radians", "Degrees", …; empty if not said.
  /// Position units per rotation: 2π for radians, the wheel's circumference for metres.
  std::optional<double> units_per_rotation;
  /// The tests with at least one row, in the order slow-forward, slow-backward, fast-forward,
  /// fast-backward.
  std::vector<Run> runs;
  std::vector<std::string> missing;  ///< Keys of the format that the file lacks.
  std::vector<Diagnostic> diagnostics;

  [[nodiscard]] bool is_drive() const { return layout != Layout::mechanism; }
  /// The run of that name, or nullptr.
  [[nodiscard]] const Run* find(std::string_view name) const noexcept;
};

/// Reads the text of a SysId JSON.
///
/// Rows with null, NaN or infinity are dropped and counted (`non_finite_rows`), rows of another
/// width too (`malformed_rows`), unsorted time is sorted (`unsorted_time`), keys that are missing
/// are named (`missing_key`, `missing_run`), and of a file that ends in the middle every complete
/// row before the cut is used (`truncated_log`).
///
/// @param text    The file's contents. @param source  The path, for messages.
/// @errors LogError::empty, not_a_log (JSON of something else), malformed (with line and column),
///         no_data (no complete row).
/// Cost: one streaming pass; memory proportional to the rows.
[[nodiscard]] Expected<SysIdJson> parse_sysid_json(std::string_view text,
                                                   const std::string& source);

/// The JSON text of a log, as SysId writes it (rows of rotations, units at the end); numbers are
/// the shortest that read back to the same double. Reading it gives the same log.
/// @errors ArgumentError::wrong_shape (columns of unequal length), not_finite.
[[nodiscard]] Expected<std::string> to_sysid_json(const SysIdJson& log);

/// `to_sysid_json` into a file, atomically. @errors As above, and FileError.
[[nodiscard]] Expected<void> write_sysid_json(const std::string& path, const SysIdJson& log);

}  // namespace flyball
