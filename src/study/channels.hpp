#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/identification/recording.hpp>
#include <flyball/io/log.hpp>
#include <flyball/study/recording.hpp>

/// Finding a mechanism's channels and tests in a log, by name, type and unit.
namespace flyball::study {

/// A half-open stretch of time in which one test ran.
struct TestWindow {
  identification::TestKind kind{};
  double begin = 0.0;  ///< s
  double end = 0.0;    ///< s
};

/// The tests of a log.
struct FoundTests {
  std::string state_name;  ///< The channel that names them; empty if there is none.
  std::string subject;     ///< The mechanism's name in that channel's name.
  std::vector<TestWindow> windows;
};

/// The text channel whose values are names of tests, and when each ran. A log without one gives no
/// windows. @param state_channel  The channel's name if the person said it.
/// @errors RecordingError::no_test_state (the named one does not exist), ambiguous_channel (several
///         mechanisms were tested), no_tests (the channel never names one).
[[nodiscard]] Expected<FoundTests> find_tests(const Log& log, const std::string& state_channel);

/// The channels of one mechanism; at least one of position and velocity is there.
struct FoundChannels {
  const Signal* voltage = nullptr;
  const Signal* position = nullptr;
  const Signal* velocity = nullptr;
  bool drivetrain = false;  ///< The tests recorded a left and a right side.
};

/// @errors RecordingError::no_channel, ambiguous_channel with the candidates.
[[nodiscard]] Expected<FoundChannels> find_channels(const Log& log, const FoundTests& tests,
                                                    const LogSelection& selection);

/// Tests told apart by the voltage alone, for logs that do not name them: a stretch of one sign
/// that jumps to most of its level at once is a dynamic test, one that grows is quasistatic.
[[nodiscard]] std::vector<TestWindow> split_by_voltage(const Signal& voltage);

/// Joins the channels onto the clock of the fullest one. The voltage is held between its samples
/// (it is what was commanded), position and velocity are interpolated.
[[nodiscard]] std::vector<identification::TestRun> join_channels(
    const FoundChannels& channels, const std::vector<TestWindow>& windows);

/// "Rotation" of "Rotation per Second"; empty if the unit is no velocity.
[[nodiscard]] std::string position_unit_of_velocity(std::string_view unit);

/// A kind that a name gives away ("ElevatorSubsystem", "shooter flywheel"), if any.
[[nodiscard]] std::optional<mechanisms::MechanismKind> kind_from_name(std::string_view name);

/// What is wrong with a drivetrain's log: sides that stand still, encoders against the voltage.
[[nodiscard]] std::vector<Diagnostic> diagnose_drive(const SysIdJson& log);

}  // namespace flyball::study
