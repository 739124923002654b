#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/identification/preparation.hpp>

namespace flyball::identification {

/// The gains of the book's one-step regression, for comparison only.
///
/// Noise and repeated rows in x_k bias it (regression dilution): kA can be off by 70 % at an R² of
/// 0.99. It is reported beside the output-error fit and never handed on.
struct OneStepFit {
  double kS = 0.0;            ///< V, equation (14.7).
  double kV = 0.0;            ///< V/(unit/s), equation (14.8).
  double kA = 0.0;            ///< V/(unit/s²), equation (14.9); NaN unless α > 0.
  double kG = 0.0;            ///< V, the constant (elevator) or amplitude (arm) term.
  double angle_offset = 0.0;  ///< rad, arms only.
  double alpha = 0.0;
  double beta = 0.0;
  double gamma = 0.0;
  double period = 0.0;     ///< s, sample period T.
  double r_squared = 0.0;  ///< Of x_{k+1}.
};

/// Ordinary least squares on x_{k+1} = α x_k + β u_k + γ sgn(x_k), with a constant for an elevator
/// and cos θ, sin θ for an arm, over the usable rows.
///
/// @errors IdentificationError::unknown_mechanism, too_short, singular.
/// Cost: O(rows). Source: book, section 14.2, equations (14.3)–(14.9).
[[nodiscard]] Expected<OneStepFit> fit_one_step(const PreparedRecording& recording);

}  // namespace flyball::identification
