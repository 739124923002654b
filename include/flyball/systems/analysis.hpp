#pragma once

#include <complex>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// Which time a system lives in: whether A moves x by dx/dt = A x or by x_{k+1} = A x_k.
enum class TimeDomain { continuous, discrete };

/// What becomes of a disturbance of an equilibrium (6.4, 7.1.1).
enum class Stability {
  stable,    ///< It decays.
  marginal,  ///< It stays: a pole on the imaginary axis or unit circle, within rounding.
  unstable,  ///< It grows, also if only because such a pole is repeated in one chain (defective).
};
/// "stable", "marginally stable", "unstable".
[[nodiscard]] std::string_view to_string(Stability stability);

/// One pole of a system, in the words of second-order systems.
struct Mode {
  std::complex<double> pole;       ///< λ: s, 1/s, in the continuous, z in the discrete case.
  std::complex<double> s;          ///< λ, or ln(z)/T; -∞ for z = 0.
  double natural_frequency = 0.0;  ///< ω_n = |s|, rad/s.
  double damping_ratio = 0.0;      ///< ζ = -Re(s)/|s|; 1 for real stable poles, 0 at the origin.
  double time_constant = 0.0;      ///< τ = -1/Re(s), s; negative for a growing mode, ∞ for none.
  double uncertainty = 0.0;  ///< How far rounding may have moved λ: n ε ‖A‖ times its condition.
  Stability stability = Stability::stable;  ///< Of this pole alone.
};

/// The poles of a system and what they mean.
struct ModalAnalysis {
  std::vector<Mode> modes;  ///< By decreasing real part of s: the slowest or most unstable first.
  Stability stability = Stability::stable;
  double slowest_time_constant = 0.0;  ///< The largest, s; ∞ unless stable.
};

/// @param A  n x n. @param domain  Whose poles these are. @param period  T, s, of a discrete
/// system; unused for a continuous one.
/// @errors ArgumentError for shape, entries and, in the discrete case, a period that is not
///         positive; SystemError::no_convergence.
/// Cost: O(n³), allocates. Source: book, sections 6.4, 7.1, E.2.
[[nodiscard]] Expected<ModalAnalysis> analyze_modes(const MatrixRef& A, TimeDomain domain,
                                                    Time period = Time(1.0));
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<ModalAnalysis> analyze_modes(
    const ContinuousSystem<States, Inputs, Outputs>& system) {
  return analyze_modes(MatrixRef(system.A), TimeDomain::continuous);
}
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<ModalAnalysis> analyze_modes(
    const DiscreteSystem<States, Inputs, Outputs>& system) {
  return analyze_modes(MatrixRef(system.A), TimeDomain::discrete, system.period);
}

/// A line a mode: "-1.5 +/- 3i rad/s: damped oscillation, 3.35 rad/s, damping ratio 0.447, time
/// constant 0.667 s".
[[nodiscard]] std::string describe(const ModalAnalysis& analysis);

/// Where a system rests.
struct Equilibrium {
  Eigen::VectorXd x;   ///< n: A x + B u = 0 or A x + B u = x; of several the least norm.
  Eigen::VectorXd y;   ///< p: C x + D u.
  bool unique = true;  ///< Whether A (I - A, in the discrete case) is regular.
};

/// The state at which the input u keeps the system.
/// @param u  m.
/// @errors ArgumentError for the system and u; SystemError::no_equilibrium if u drives an
///         integrator, with what is left of the equation as evidence.
/// Cost: O(n³), allocates. Source: book, sections 6.4, 8.2.
[[nodiscard]] Expected<Equilibrium> equilibrium(const ContinuousSystem<>& system,
                                                const Eigen::VectorXd& u);
[[nodiscard]] Expected<Equilibrium> equilibrium(const DiscreteSystem<>& system,
                                                const Eigen::VectorXd& u);

/// V(x) = xᵀPx, which proves stability: P > 0 and its derivative (difference) is -xᵀQx < 0.
struct LyapunovCertificate {
  Eigen::MatrixXd P;               ///< n x n: AᵀP + PA = -Q, or AᵀPA - P = -Q.
  Eigen::VectorXd eigenvalues;     ///< Of P, increasing.
  bool positive_definite = false;  ///< Whether all of them are positive beyond rounding: the proof.
  double residual = 0.0;           ///< Of the equation, relative to its terms.
  double decay_rate = 0.0;         ///< V falls at least by e^{-rate t}, or by the factor 1 - rate a
                                   ///< sample: the smallest eigenvalue of P⁻¹Q; zero without proof.
};

/// @param A  n x n. @param Q  n x n, symmetric, positive definite.
/// @return The certificate; `positive_definite` is false exactly where A is not stable, and P's
/// negative eigenvalues then count the unstable poles.
/// @errors ArgumentError for shapes, entries, asymmetry and a Q that is not positive definite;
///         MatrixEquationError::no_unique_solution where two poles mirror each other (a pole on the
///         imaginary axis or unit circle among them): no such P exists.
/// Cost: O(n³), allocates. Source: book, section 8.3.1.
[[nodiscard]] Expected<LyapunovCertificate> lyapunov_certificate(const MatrixRef& A,
                                                                 const MatrixRef& Q,
                                                                 TimeDomain domain);
/// The same with Q = I, 1/state². @errors As above.
[[nodiscard]] Expected<LyapunovCertificate> lyapunov_certificate(const MatrixRef& A,
                                                                 TimeDomain domain);

}  // namespace flyball
