#include <flyball/systems/system_error.hpp>

namespace flyball {

ErrorInfo error_info(SystemError code) {
  constexpr std::string_view family = "system";
  switch (code) {
    case SystemError::no_image:
      return {family, "no_image", "the conversion has no image of a pole or zero",
              ErrorKind::no_answer};
    case SystemError::zero_transfer:
      return {family, "zero_transfer", "the transfer function is zero", ErrorKind::no_answer};
    case SystemError::algebraic_loop:
      return {family, "algebraic_loop", "the feedback loop is algebraic", ErrorKind::no_answer};
    case SystemError::period_mismatch:
      return {family, "period_mismatch", "the sample periods differ", ErrorKind::misuse};
    case SystemError::singular_transform:
      return {family, "singular_transform", "the transformation has no inverse",
              ErrorKind::no_answer};
    case SystemError::not_controllable:
      return {family, "not_controllable", "the system is not controllable", ErrorKind::no_answer};
    case SystemError::not_observable:
      return {family, "not_observable", "the system is not observable", ErrorKind::no_answer};
    case SystemError::not_stable:
      return {family, "not_stable", "the system is not stable", ErrorKind::no_answer};
    case SystemError::infinite_norm:
      return {family, "infinite_norm", "the norm is infinite", ErrorKind::no_answer};
    case SystemError::no_equilibrium:
      return {family, "no_equilibrium", "no state is an equilibrium", ErrorKind::no_answer};
    case SystemError::no_convergence:
      return {family, "no_convergence", "the iteration did not converge", ErrorKind::no_answer};
  }
  return {family, "unknown", "unknown error", ErrorKind::defect};
}

}  // namespace flyball
