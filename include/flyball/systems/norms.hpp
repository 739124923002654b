#pragma once

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// The H2 norm: √(trace C W_c Cᵀ), and + DDᵀ in the discrete case. The standard deviation of the
/// output under white noise of density (covariance) one on each input; the energy of all impulse
/// responses.
/// @errors ArgumentError for the system; SystemError::not_stable with the pole; infinite_norm for a
///         continuous system with D ≠ 0; no_convergence.
/// Cost: O(n³ log κ), allocates. Source: Zhou, Doyle and Glover, "Robust and Optimal Control",
/// section 4.6.
[[nodiscard]] Expected<double> h2_norm(const ContinuousSystem<>& system);
[[nodiscard]] Expected<double> h2_norm(const DiscreteSystem<>& system);

/// The largest gain of a system, over all frequencies and input directions.
struct HInfinityNorm {
  double norm = 0.0;
  double frequency = 0.0;    ///< Where it is reached, rad/s; ∞ if at s = ∞. Up to π/T if discrete.
  double upper_bound = 0.0;  ///< No gain exceeds it; norm is within 1e-10 of it, relative.
  int iterations = 0;
};

/// sup over ω of the largest singular value of G(jω), or of G(e^{jωT}).
///
/// The gain at a frequency is raised until the Hamiltonian matrix has no eigenvalue on the
/// imaginary axis: between two crossings the middle is a better frequency, and convergence is
/// quadratic. A discrete system takes the bilinear transform, which maps circle to axis and keeps
/// the gains.
/// @errors ArgumentError for the system; SystemError::not_stable with the pole (its gain is
///         infinite, or no gain of a stable system); no_convergence.
/// Cost: a few times O((2n)³), allocates.
/// Source: Bruinsma and Steinbuch, Systems & Control Letters 14 (1990); Boyd and Balakrishnan,
/// same, 15 (1990).
[[nodiscard]] Expected<HInfinityNorm> h_infinity_norm(const ContinuousSystem<>& system);
[[nodiscard]] Expected<HInfinityNorm> h_infinity_norm(const DiscreteSystem<>& system);

/// The same of any system without a pole on the imaginary axis, or the unit circle: the largest
/// gain over the frequencies, which is no norm of what an unstable system does from rest.
/// @errors As above; SystemError::not_stable with the pole on the axis.
[[nodiscard]] Expected<HInfinityNorm> l_infinity_norm(const ContinuousSystem<>& system);
[[nodiscard]] Expected<HInfinityNorm> l_infinity_norm(const DiscreteSystem<>& system);

}  // namespace flyball
