#include <flyball/systems/system_error.hpp>

#include "core/error_rows.hpp"

namespace flyball {

ErrorInfo error_info(SystemError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_image", "the conversion has no image of a pole or zero", ErrorKind::no_answer},
      {"zero_transfer", "the transfer function is zero", ErrorKind::no_answer},
      {"algebraic_loop", "the feedback loop is algebraic", ErrorKind::no_answer},
      {"period_mismatch", "the sample periods differ", ErrorKind::misuse},
      {"singular_transform", "the transformation has no inverse", ErrorKind::no_answer},
      {"not_controllable", "the system is not controllable", ErrorKind::no_answer},
      {"not_observable", "the system is not observable", ErrorKind::no_answer},
      {"not_stable", "the system is not stable", ErrorKind::no_answer},
      {"infinite_norm", "the norm is infinite", ErrorKind::no_answer},
      {"no_equilibrium", "no state is an equilibrium", ErrorKind::no_answer},
      {"no_convergence", "the iteration did not converge", ErrorKind::no_answer},
  };
  return detail::info_of(code, "system", rows);
}

}  // namespace flyball
