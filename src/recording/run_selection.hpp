#pragma once

#include <flyball/recording/load_recording.hpp>

/// What a person says of single runs.
namespace flyball::recording {

/// Marks the runs that are trimmed ("2:0.5..3", "2:0.5..", "2:..3"; seconds after the run's start)
/// and left out ("3"). Runs are numbered from 1, as tables and figures do.
/// @errors RecordingError::no_run; ArgumentError::malformed, empty.
[[nodiscard]] Expected<void> select_runs(const LogSelection& selection,
                                         identification::Recording& recording);

}  // namespace flyball::recording
