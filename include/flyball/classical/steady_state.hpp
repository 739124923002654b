#pragma once

#include <optional>

#include <flyball/classical/transfer_function.hpp>

namespace flyball::classical {

/// y(0+) = lim s Y(s) for s → ∞ of a signal's transform, or y₀ = lim Y(z) of a discrete one.
/// @param transform  Y, with a relative degree of one at least, so that y(0+) is a number; dead
/// time makes it zero. @errors TransferError::improper where y begins with an impulse. Source:
/// book, section E.3.5; Table E.1.
[[nodiscard]] Expected<double> initial_value(const TransferFunction& transform);

/// lim y(t) for t → ∞ = lim s Y(s) for s → 0, or lim (z - 1) Y(z) for z → 1 (E.8).
/// @errors SystemError::not_stable with the pole of sY that does not let y settle: there the limit
/// of sY(s) is a number that y does not tend to. SystemError::no_convergence. Source: (E.8).
[[nodiscard]] Expected<double> final_value(const TransferFunction& transform);

/// What is left of the error r - y of a loop under unity feedback, in the end.
struct SteadyStateError {
  /// Integrators in L: its poles at s = 0 (z = 1) less its zeros there; negative of a loop that
  /// differentiates.
  int type = 0;
  double position_constant = 0.0;      ///< K_p = L(0); ±∞ from type 1 on.
  double velocity_constant = 0.0;      ///< K_v = lim s L, or lim (z - 1)L/T.
  double acceleration_constant = 0.0;  ///< K_a = lim s² L, or lim (z - 1)²L/T².
  bool stable = false;                 ///< The closed loop; else there is no steady state.
  std::optional<double> step{};        ///< 1/(1 + K_p), for r = 1.
  std::optional<double> ramp{};        ///< 1/K_v, s, for r = t; ∞ of type 0.
  std::optional<double> parabola{};    ///< 1/K_a, s², for r = t²/2; ∞ of types 0 and 1.
};

/// @param loop  L, from the error to the output; dead time counts for stability, not for the
/// limits.
/// @errors SystemError::no_convergence; those of `loop_margins`.
/// Source: book, section E.3.5, equation (E.9).
[[nodiscard]] Expected<SteadyStateError> steady_state_error(const TransferFunction& loop);

}  // namespace flyball::classical
