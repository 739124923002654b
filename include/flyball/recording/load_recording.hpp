#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/identification/drive_fit.hpp>
#include <flyball/identification/recording.hpp>

namespace flyball {
struct Log;
}

namespace flyball::recording {

/// What a person may say about a log beyond what it says itself. Empty fields are detected.
struct LogSelection {
  std::optional<mechanisms::MechanismKind> mechanism{};
  bool drivetrain = false;      ///< The log is of a drivetrain, in place of a mechanism.
  std::string state_channel{};  ///< The channel with the name of the running test.
  std::string
      voltage_channel{};  ///< Channel names as the log has them; of a drivetrain "LEFT,RIGHT".
  std::string position_channel{};
  std::string velocity_channel{};
  std::string heading_channel{};  ///< Of a drivetrain's gyro.
  std::string
      also{};  ///< Path of another log of the same drivetrain: rotations beside straight tests.
  std::string unit{};           ///< Unit of the position channel: "rotations", "m", "deg", …
  std::string velocity_unit{};  ///< Unit of the velocity channel: "RPM", "deg/s", …
  bool no_velocity = false;     ///< Leave the velocity channel out; the position tells it.
  double scale = 1.0;           ///< Multiplies position and velocity: output units a recorded unit.
  double voltage_scale = 1.0;   ///< Volts a recorded unit of the voltage channel.
  /// What to use of single runs, "2:0.5..3": of the second run what lies between 0.5 s and 3 s
  /// after its start. "2:0.5.." and "2:..3" leave the other end.
  std::vector<std::string> runs{};
  std::vector<std::string> without_runs{};  ///< The numbers of runs that are not to be used.
};

/// Why a log cannot be turned into a recording.
enum class RecordingError {
  drivetrain,         ///< A swerve drive's log, or two logs that are not of one drivetrain
                      ///< (no_answer).
  no_test_state,      ///< No channel tells which test runs.
  no_channel,         ///< Voltage, or both of position and velocity, are missing.
  ambiguous_channel,  ///< Several mechanisms were recorded; the person has to choose.
  unit_unknown,       ///< Nothing tells the unit, and none can be assumed.
  unit_mismatch,      ///< The unit cannot be one of that mechanism, or not of both channels.
  no_run,             ///< The person names a run that the log does not have.
  no_tests,           ///< A test state channel without a test.
};
[[nodiscard]] ErrorInfo error_info(RecordingError code);

/// Whether a person's word for the mechanism is a drivetrain: "drivetrain", "differential drive".
[[nodiscard]] bool means_drivetrain(std::string_view mechanism);

/// A log, read as the characterisation tests of one mechanism or drivetrain.
struct LoadedRecording {
  std::string path{};
  std::string format{};                 ///< "SysId JSON", "WPILOG", "CSV".
  std::string subject{};                ///< The mechanism's name in the log, or empty.
  identification::Recording recording;  ///< Without a mechanism if neither log nor person say it.
  std::optional<identification::DriveRecording> drive{};  ///< In its place, of a drivetrain.
  std::vector<Diagnostic> diagnostics{};  ///< What was found; assumptions have the code "assumed".
};

/// Reads a log and finds the tests in it: channels by name, type and unit; runs by the test state;
/// channels are joined by time onto the voltage's clock.
/// @errors LogError, FileError, RecordingError.
[[nodiscard]] ExpectedAll<LoadedRecording> load_recording(const std::string& path,
                                                          const LogSelection& selection = {});

/// The same from a log in memory.
[[nodiscard]] ExpectedAll<LoadedRecording> recording_from_log(const Log& log,
                                                              const LogSelection& selection = {});

}  // namespace flyball::recording
