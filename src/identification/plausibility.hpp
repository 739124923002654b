#pragma once

#include <vector>

#include <flyball/identification/feedforward_fit.hpp>

/// Whether gains can be those of a mechanism at all.
namespace flyball::identification {

/// The gains against the battery, the voltages of the log and the speeds that mechanisms have.
/// @errors IdentificationError::unphysical_gains with the probable cause: kS + |kG| above the
/// voltage
///         that moved it, a speed at 12 V that no motor and gearing make.
[[nodiscard]] Expected<void> check_plausibility(const PreparedRecording& prepared,
                                                const FeedforwardFit& fit,
                                                std::vector<Diagnostic>& diagnostics);

}  // namespace flyball::identification
