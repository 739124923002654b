#include <flyball/identification/identification_error.hpp>

#include "core/error_rows.hpp"

namespace flyball::identification {

ErrorInfo error_info(IdentificationError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"unknown_mechanism", "the log does not say what kind of mechanism it is", ErrorKind::misuse},
      {"no_data", "there is no usable row", ErrorKind::no_answer},
      {"no_motion", "the mechanism does not move in any test", ErrorKind::no_answer},
      {"missing_tests", "the tests do not determine the gains together", ErrorKind::no_answer},
      {"too_short", "the usable part of the tests is too short", ErrorKind::no_answer},
      {"singular", "the data do not tell the gains apart", ErrorKind::no_answer},
      {"no_convergence", "the fit does not settle", ErrorKind::no_answer},
      {"unphysical_gains", "no such mechanism has the gains that fit best", ErrorKind::no_answer},
      {"logs_differ", "the logs are not of one mechanism", ErrorKind::no_answer},
  };
  return detail::info_of(code, "identification", rows);
}

}  // namespace flyball::identification
