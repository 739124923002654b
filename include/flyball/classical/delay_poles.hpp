#pragma once

#include <flyball/classical/delay_system.hpp>

namespace flyball::classical {

/// The poles of a system with dead time that decide about it; with a delay in a loop there are
/// infinitely many.
struct DelayPoles {
  /// The rightmost, by falling real part; of a discrete system all, by falling size. Each is a zero
  /// of the characteristic function to rounding.
  Eigen::VectorXcd poles;
  /// How many lie right of the imaginary axis or on it, or not within the unit circle, listed (30
  /// and their conjugates at most) or not. The largest integer where infinitely many lie there or
  /// come as near to the axis as one likes (|L(∞)| >= 1 behind dead time); none is listed then.
  int unstable = 0;
  bool stable = false;
  /// s⁻¹, where the real parts of what jumps for ever in loops without a state tend to: that of
  /// the highest frequencies, -∞ where every loop with a delay has a state that is not passed by.
  double high_frequency_abscissa = 0.0;
};

/// The zeros of det [sI - A, -B₂Δ; -C₂, I - D₂₂Δ], Δ = diag e^{-τᵢs}, that lie farthest right.
///
/// Delay lines are discretised at Chebyshev's points as fine as the highest frequency with a loop
/// gain that matters, or, of long ones, poles sought along the axis where an eigenvalue λ of the
/// loop is 1 at jω + ln λ/τ; they are refined by Newton's method on the determinant itself, and how
/// many lie right of a line between two of them is counted by the determinant's turns along it.
/// Loops of jumps (D₂₂) count as stable only if they are exponentially and for every change of the
/// delays, be it ever so small: max over θ of ρ(D₂₂ diag e^{jθ}) < 1. At 1 a chain of poles tends
/// to the axis: (s + 1)/(s + 2) e^{-s} in a loop has all poles left of it, and is not stable.
/// Without a delay in a loop they are the eigenvalues of A.
/// @errors SystemError::no_convergence where the count does not agree, or the delay is more than
/// 30 000 radians long at frequencies that matter.
/// Cost: O((n + points)³), some milliseconds to seconds; allocates.
/// Source: Breda, Maset and Vermiglio, "Pseudospectral differencing methods for characteristic
/// roots of delay differential equations", SIAM J. Sci. Comput. 27 (2005); Michiels and Niculescu,
/// "Stability, Control, and Computation for Time-Delay Systems", 2nd ed. (2014), chapters 1 and 2.
[[nodiscard]] Expected<DelayPoles> rightmost_poles(const DelaySystem& system);

/// Whether every pole is where a stable system has it. @errors As `rightmost_poles`.
[[nodiscard]] Expected<bool> is_stable(const DelaySystem& system);

}  // namespace flyball::classical
