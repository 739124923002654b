#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/identification/preparation.hpp>

namespace flyball::identification {

/// Gains to start the output-error fit from. kA is of no use beyond its order of magnitude.
struct StartGains {
  double kS = 0.0;
  double kV = 0.0;
  double gravity_cosine = 0.0;
  double gravity_sine = 0.0;
};

/// Robust regression of V on sgn(v), v, a and gravity, with v and a smoothed over about 70 ms.
/// @errors IdentificationError::too_short, singular.
[[nodiscard]] Expected<StartGains> regress_gains(const PreparedRecording& recording);

}  // namespace flyball::identification
