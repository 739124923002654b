#pragma once

#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/identification/recording.hpp>

/// Whether what was taken for the applied voltage can be one.
namespace flyball::recording {

/// Volts that one of a channel's unit, or of what its name ends in ("voltage_mV"), is; 1 if neither
/// tells.
[[nodiscard]] double volts_a_unit(std::string_view unit, std::string_view name);

/// @param runs  In volts, as far as is known.
/// @errors RecordingError::unit_mismatch for values beyond any battery of a robot (counts, percent)
///         and for the battery's voltage, which does not follow the motion.
[[nodiscard]] Expected<void> check_voltage(const std::vector<identification::TestRun>& runs,
                                           std::vector<Diagnostic>& notes);

}  // namespace flyball::recording
