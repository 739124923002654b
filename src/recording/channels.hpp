#pragma once

#include <initializer_list>
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

/// What a channel of a mechanism holds.
enum class Channel { voltage, position, velocity };

/// "voltage", …, as its option is called.
[[nodiscard]] std::string channel_name(Channel quantity);

/// Whether a channel's name and unit are those of such a quantity.
[[nodiscard]] bool fits(const Signal& signal, Channel quantity);

/// Channels whose name and unit fit, those of the tests' subject if there are any.
[[nodiscard]] std::vector<const Signal*> candidates_for(const Log& log, const FoundTests& tests,
                                                        Channel quantity);

/// The channel of that name. @errors RecordingError::no_channel with the nearest.
[[nodiscard]] Expected<const Signal*> named_channel(const Log& log, const std::string& name,
                                                    Channel quantity);

/// ", such as …": the channels with the most samples in the tests, for a person to choose from.
[[nodiscard]] std::string fullest_channels(const Log& log, const FoundTests& tests);

/// The one with the most samples in the windows; null among none.
[[nodiscard]] const Signal* fullest_of(std::initializer_list<const Signal*> signals,
                                       const std::vector<CharacterizationWindow>& windows);

/// A signal interpolated to the given ascending times.
[[nodiscard]] std::vector<double> sampled(const Signal& signal, const std::vector<double>& time);

/// Of several that fit, those that show the same are one mechanism's motors, told in `notes`.
/// @errors RecordingError::no_channel, ambiguous_channel with the candidates.
[[nodiscard]] Expected<FoundChannels> find_channels(const Log& log, const FoundTests& tests,
                                                    const LogSelection& selection,
                                                    std::vector<Diagnostic>& notes);

/// Takes out the tests in which this voltage stays at zero: those of another mechanism, whose
/// routine the same channel names. @return  How many.
[[nodiscard]] std::size_t leave_other_routines(const Signal& voltage, FoundTests& tests);

/// Joins the channels onto the times of `clock`. The voltage is held between its samples
/// (it is what was commanded), position and velocity are interpolated.
[[nodiscard]] std::vector<identification::TestRun> join_channels(
    const FoundChannels& channels, const std::vector<CharacterizationWindow>& windows,
    const Signal* clock);

}  // namespace flyball::recording
