#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/core/function_ref.hpp>
#include <flyball/math/integration/adaptive.hpp>

namespace flyball {

/// An integral and what is known of its error.
struct Quadrature {
  double value = 0.0;
  double error = 0.0;   ///< Estimate of |value - integral|, from two rules of each piece.
  int evaluations = 0;  ///< Of the function.
};

/// How far a quadrature goes.
struct QuadratureOptions {
  double relative_tolerance = 1e-12;
  double absolute_tolerance = 0.0;
  int most_evaluations = 100'000;
};

/// ∫ f(x) dx from `low` to `high`, either of which may be infinite, by the Gauss-Kronrod rule of 7
/// and 15 points; the piece whose error is the largest is halved until the tolerance is met or
/// halving helps no more. A peak far from the ends and much narrower than the interval is missed:
/// give ends that are near it.
/// @param f  Finite inside the interval; it is not asked for the ends.
/// @errors ArgumentError::not_finite for an end that is NaN; IntegrationError::not_finite with the
///         place, too_many_steps with the value and error that were reached.
/// Cost: 15 evaluations a piece; allocates. Source: Piessens et al., "QUADPACK" (1983), QAG and the
/// rule QK15.
[[nodiscard]] Expected<Quadrature> quadrature(FunctionRef<double(double)> f, double low,
                                              double high, const QuadratureOptions& options = {});

}  // namespace flyball
