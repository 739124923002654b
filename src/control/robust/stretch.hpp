#pragma once

#include <flyball/systems/system.hpp>

#include "control/robust/structured_bound.hpp"

namespace flyball::detail {

/// M(jω) of a continuous system without a pole on the axis; ω may be infinite.
[[nodiscard]] Eigen::MatrixXcd response_at(const ContinuousSystem<>& system, double frequency);
/// dM/dω.
[[nodiscard]] Eigen::MatrixXcd response_slope(const ContinuousSystem<>& system, double frequency);

/// Frequencies, low to high.
struct Stretch {
  double low = 0.0;
  double high = 0.0;
};

/// The frequencies around one at which the scaling proves β, in which it still does: up to the
/// nearest at which the form is singular, an eigenvalue ζ of a Hamiltonian matrix on the imaginary
/// axis with s = jω₀ + 1/ζ (or s itself where ω₀ is infinite).
/// @param frequency  ω₀ >= 0, where the form at β is positive definite by more than rounding.
/// @return Within [0, ∞]; of no width where rounding leaves none.
[[nodiscard]] Stretch stretch_around(const ContinuousSystem<>& system, double frequency,
                                     const StructuredScaling& scaling, double beta);

}  // namespace flyball::detail
