#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/identification/recording.hpp>
#include <flyball/io/log.hpp>
#include <flyball/recording/load_recording.hpp>

/// Finding the tests in a log: when each ran.
namespace flyball::recording {

/// A half-open stretch of time in which one test ran.
struct CharacterizationWindow {
  identification::TestKind kind{};
  double begin = 0.0;  ///< s
  double end = 0.0;    ///< s
};

/// The tests of a log.
struct FoundTests {
  std::string state_name;  ///< The channel that names them; empty if there is none.
  std::string subject;     ///< The mechanism's name in that channel's name.
  std::vector<CharacterizationWindow> windows;
};

/// The text channel whose values are names of tests, and when each ran. A log without one gives no
/// windows. @param state_channel  The channel's name if the person said it.
/// @errors RecordingError::no_test_state (the named one does not exist), ambiguous_channel (several
///         mechanisms were tested), no_tests (the channel never names one).
[[nodiscard]] Expected<FoundTests> find_tests(const Log& log, const std::string& state_channel);

/// Tests told apart by the voltage alone, for logs that do not name them: a stretch of one sign
/// that jumps to most of its level at once is a dynamic test, one that grows is quasistatic.
[[nodiscard]] std::vector<CharacterizationWindow> split_by_voltage(const Signal& voltage);

/// Samples of a signal within any window; all of them if there is none.
[[nodiscard]] std::size_t samples_in(const Signal& signal,
                                     const std::vector<CharacterizationWindow>& windows);

}  // namespace flyball::recording
