#pragma once

#include <flyball/core/error.hpp>

namespace flyball {

/// Why a question about a linear system has no answer.
enum class SystemError {
  no_image,            ///< A pole or zero lies where the conversion has nothing to map it to.
  zero_transfer,       ///< The transfer function vanishes identically.
  algebraic_loop,      ///< I ± D₁D₂ of a feedback loop has no inverse.
  period_mismatch,     ///< Two discrete systems of different sample periods are connected.
  singular_transform,  ///< A change of coordinates without an inverse.
  not_controllable,    ///< A mode that no input moves.
  not_observable,      ///< A mode that no output shows.
  not_stable,          ///< The answer exists for stable systems alone.
  infinite_norm,       ///< White noise passes through D: its power is unbounded.
  no_equilibrium,      ///< No state rests under this input.
  no_convergence,      ///< An iteration ended without an answer.
};
[[nodiscard]] ErrorInfo error_info(SystemError code);

}  // namespace flyball
