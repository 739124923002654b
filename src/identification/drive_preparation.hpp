#pragma once

#include <vector>

#include <flyball/identification/drive_fit.hpp>

/// A drivetrain's log made fit for fitting.
namespace flyball::identification {

/// Which motion a run's voltages ask for.
[[nodiscard]] DriveTest drive_test(const DriveRun& run);

/// Mends signs and swapped sides, and tells of it.
/// @errors IdentificationError::no_data, no_motion; ArgumentError::wrong_shape.
[[nodiscard]] Expected<void> mend_drive(DriveRecording& recording,
                                        std::vector<Diagnostic>& diagnostics);

/// Half the sum (`sign` 1) or half the difference, right less left (−1), of the sides as a
/// mechanism's test. Where the sides' encoders have new values at different rows, the right one's
/// is interpolated to the left one's.
[[nodiscard]] TestRun mode_run(const DriveRun& run, double sign);

/// The trackwidth by the heading against the difference of the sides' ways; nothing without a gyro.
/// The heading's sense and unit are mended in the recording, and told.
[[nodiscard]] std::optional<GainEstimate> find_trackwidth(DriveRecording& recording,
                                                          const std::vector<DriveTest>& tests,
                                                          std::vector<Diagnostic>& diagnostics);

/// Free run of the whole model from the recorded voltages, over the windows that the modes' fits
/// used. @param used  Of each run, its window in the mode's fit, or null.
[[nodiscard]] std::vector<FittedDriveRun> simulate_drive(const DriveReport& report,
                                                         const DriveFit& fit,
                                                         const std::vector<const FittedRun*>& used);

}  // namespace flyball::identification
