#pragma once

#include <flyball/identification/preparation.hpp>

namespace flyball::identification {

/// Decides which runs moved, and in which direction.
void detect_motion(PreparedRecording& prepared);

/// Marks the usable window of every run that moved and says what was cut and why.
void trim_runs(PreparedRecording& prepared, const PreparationOptions& options);

/// A ramp whose speed stays while the recorded voltage rises: the motors got no more than at the
/// knee, and all voltages are limited to that.
void mend_saturation(PreparedRecording& recording);

}  // namespace flyball::identification
