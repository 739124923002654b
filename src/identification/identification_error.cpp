#include <flyball/identification/identification_error.hpp>

namespace flyball::identification {

ErrorInfo error_info(IdentificationError code) {
  constexpr std::string_view family = "identification";
  constexpr ErrorKind kind = ErrorKind::no_answer;
  switch (code) {
    case IdentificationError::unknown_mechanism:
      return {family, "unknown_mechanism", "the log does not say what kind of mechanism it is",
              kind};
    case IdentificationError::no_data:
      return {family, "no_data", "there is no usable row", kind};
    case IdentificationError::no_motion:
      return {family, "no_motion", "the mechanism does not move in any test", kind};
    case IdentificationError::missing_tests:
      return {family, "missing_tests", "the tests do not determine the gains together", kind};
    case IdentificationError::too_short:
      return {family, "too_short", "the usable part of the tests is too short", kind};
    case IdentificationError::singular:
      return {family, "singular", "the data do not tell the gains apart", kind};
    case IdentificationError::no_convergence:
      return {family, "no_convergence", "the fit does not settle", kind};
    case IdentificationError::unphysical_gains:
      return {family, "unphysical_gains", "no such mechanism has the gains that fit best", kind};
  }
  return {family, "unknown", "unknown error", ErrorKind::defect};
}

}  // namespace flyball::identification
