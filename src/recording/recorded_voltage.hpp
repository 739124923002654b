#pragma once

#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/identification/recording.hpp>

/// Whether what was taken for the applied voltage can be one.
namespace flyball::recording {

/// @param runs  In volts, as far as is known.
/// @errors RecordingError::unit_mismatch for values beyond any battery of a robot (counts, percent)
///         and for the battery's voltage, which does not follow the motion.
[[nodiscard]] Expected<void> check_voltage(const std::vector<identification::TestRun>& runs,
                                           std::vector<Diagnostic>& notes);

}  // namespace flyball::recording
