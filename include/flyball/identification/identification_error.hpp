#pragma once

#include <flyball/core/error.hpp>

namespace flyball::identification {

/// Why a recording gives no gains. All but the first are answers, not misuse (exit status 1).
enum class IdentificationError {
  unknown_mechanism,  ///< Nobody says what the mechanism is, and the data fit several kinds.
  no_data,            ///< No run with usable rows.
  no_motion,          ///< The mechanism did not move in any test.
  missing_tests,      ///< The tests that moved do not determine the gains together.
  too_short,          ///< What is left after trimming is too short to fit.
  singular,           ///< The data do not distinguish the gains.
  no_convergence,     ///< The fit did not settle within its iteration cap.
  unphysical_gains,   ///< The best fit has gains that no such mechanism has.
  logs_differ,        ///< Several logs are not of one mechanism.
};
[[nodiscard]] ErrorInfo error_info(IdentificationError code);

}  // namespace flyball::identification
