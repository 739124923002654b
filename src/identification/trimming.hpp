#pragma once

#include <flyball/identification/preparation.hpp>

namespace flyball::identification {

/// Decides which runs moved, and in which direction.
void detect_motion(PreparedRecording& prepared);

/// Marks the usable window of every run that moved and says what was cut and why.
void trim_runs(PreparedRecording& prepared, const PreparationOptions& options);

}  // namespace flyball::identification
