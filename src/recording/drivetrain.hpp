#pragma once

#include <vector>

#include <flyball/identification/drive_fit.hpp>
#include <flyball/io/log.hpp>
#include <flyball/recording/load_recording.hpp>

#include "recording/channels.hpp"

/// A drivetrain's two sides as recordings of one mechanism each, and back.
namespace flyball::recording {

/// The gyro's columns beside the runs of a drivetrain.
struct GyroColumns {
  std::vector<std::vector<double>> heading;  ///< Of each run; rad, or as recorded.
  std::vector<std::vector<double>> rate;
};

/// Puts the right side's runs behind the left side's, so that one way leads both to SI.
[[nodiscard]] std::vector<identification::TestRun> both_sides(
    std::vector<identification::TestRun> left, std::vector<identification::TestRun> right);

/// The sides of a recording by `both_sides`, with the gyro, as a drivetrain's.
[[nodiscard]] LoadedRecording as_drive(LoadedRecording loaded, GyroColumns gyro);

/// Puts the tests of another log of the same drivetrain beside.
/// @errors RecordingError::drivetrain (not of one), unit_mismatch.
[[nodiscard]] Expected<LoadedRecording> with_other(LoadedRecording loaded, LoadedRecording other);

/// The channels of a drivetrain.
struct DriveChannels {
  FoundChannels left;
  FoundChannels right;
  const Signal* heading = nullptr;
};

/// Finds the sides' channels by name, or takes those that the person said ("LEFT,RIGHT").
/// @errors RecordingError::no_channel, ambiguous_channel, with all that is missing.
[[nodiscard]] Expected<DriveChannels> find_drive_channels(const Log& log, const FoundTests& tests,
                                                          const LogSelection& selection);

/// The tests of a drivetrain in a log of channels.
[[nodiscard]] Expected<LoadedRecording> drive_from_channels(const Log& log,
                                                            const LogSelection& selection,
                                                            FoundTests tests,
                                                            LoadedRecording loaded);

}  // namespace flyball::recording
