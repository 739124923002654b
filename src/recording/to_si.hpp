#pragma once

#include <optional>
#include <string>
#include <vector>

#include "recording/channels.hpp"
#include "recording/recorded_units.hpp"

/// From recorded units to a recording in SI.
namespace flyball::recording {

struct OutputScale {
  double factor = 1.0;  ///< SI a recorded unit.
  std::string unit;     ///< "m" or "rad".
};

/// The SI size of a recorded position unit for a mechanism. @param scale  What the person said.
/// @errors RecordingError::unit_mismatch.
[[nodiscard]] Expected<OutputScale> output_scale(const RecordedUnit& unit, double scale,
                                                 std::optional<mechanisms::MechanismKind> kind);

/// The same for a drivetrain's wheels: metres, or radians of wheels whose size nobody said.
[[nodiscard]] Expected<OutputScale> drive_scale(const RecordedUnit& unit, double scale);

/// A unit that the person said; unknown if there is none. @errors RecordingError::unit_mismatch.
[[nodiscard]] Expected<RecordedUnit> said_unit(const std::string& text, bool rate);

/// The same with its runs in SI. @param output  Of the position.
/// @errors RecordingError::unit_mismatch if the voltage is none (`check_voltage`).
[[nodiscard]] Expected<LoadedRecording> in_si(LoadedRecording loaded, const RecordedUnits& units,
                                              const OutputScale& output, double voltage_scale);

/// Takes the velocity out where the position tells it too.
void leave_velocity_out(identification::Recording& recording);

/// Tells of which kind a log calls its mechanism, and that a person says another.
/// @param how  "the log says". @param selected  By the person, if at all.
void tell_said_kind(std::vector<Diagnostic>& notes, std::string_view how,
                    mechanisms::MechanismKind said,
                    std::optional<mechanisms::MechanismKind> selected);

/// Tells that an absolute encoder's angles were made continuous.
void tell_unwrapped(std::vector<Diagnostic>& notes, std::size_t leaps);

/// Tells first what was assumed and nothing can check.
void tell_assumed_unit(std::vector<Diagnostic>& notes, const RecordedUnit& unit);

/// The tests of a SysId JSON. @param loaded  With what is known so far.
[[nodiscard]] Expected<LoadedRecording> from_sysid_json(const Log& log,
                                                        const LogSelection& selection,
                                                        LoadedRecording loaded);
/// The units that the person, or the channels' metadata or names, say; else unknown.
[[nodiscard]] Expected<RecordedUnits> channel_units(const LogSelection& selection,
                                                    const FoundChannels& channels);

/// The tests of a log of channels.
[[nodiscard]] Expected<LoadedRecording> from_channels(const Log& log, const LogSelection& selection,
                                                      LoadedRecording loaded);

}  // namespace flyball::recording
