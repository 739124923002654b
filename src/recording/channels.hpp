#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/identification/recording.hpp>
#include <flyball/io/log.hpp>
#include <flyball/recording/load_recording.hpp>

#include "recording/characterization_windows.hpp"

/// Finding a mechanism's channels in a log, by name, type and unit.
namespace flyball::recording {

/// The channels of one mechanism; at least one of position and velocity is there.
struct FoundChannels {
  const Signal* voltage = nullptr;
  const Signal* position = nullptr;
  const Signal* velocity = nullptr;
};

/// Why a log is taken for a drivetrain's, as a clause; empty if it is not. Its name says it, or
/// voltages, positions or velocities come in a left and a right one. What the person says (kind,
/// channels) and a name of another mechanism have the last word.
[[nodiscard]] std::string drivetrain_reason(const Log& log, const FoundTests& tests,
                                            const LogSelection& selection);

/// The channels of a drivetrain's left side, else the first that fit, to be looked at; nothing if
/// there is no voltage or no motion among them.
[[nodiscard]] std::optional<FoundChannels> one_side(const Log& log, const FoundTests& tests);

/// @errors RecordingError::no_channel, ambiguous_channel with the candidates.
[[nodiscard]] Expected<FoundChannels> find_channels(const Log& log, const FoundTests& tests,
                                                    const LogSelection& selection);

/// Joins the channels onto the clock of the fullest one. The voltage is held between its samples
/// (it is what was commanded), position and velocity are interpolated.
[[nodiscard]] std::vector<identification::TestRun> join_channels(
    const FoundChannels& channels, const std::vector<CharacterizationWindow>& windows);

}  // namespace flyball::recording
