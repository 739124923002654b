#pragma once

#include <complex>
#include <string>
#include <vector>

#include <flyball/classical/zero_pole_gain.hpp>

namespace flyball::classical {

/// r₁/(s - p) + r₂/(s - p)² + … of one pole.
struct PartialFraction {
  std::complex<double> pole;
  Eigen::VectorXcd residues;  ///< r₁, r₂, …: as many as the pole has multiplicity.
};

/// num/den = Σ qₖ sᵏ + Σ Σ rₖ/(s - p)ᵏ.
struct PartialFractions {
  Eigen::VectorXd polynomial;  ///< q, descending powers; empty of a strictly proper one.
  std::vector<PartialFraction> fractions{};  ///< By falling real part, conjugates after each other.

  /// Their sum at a point of the plane; not finite at a pole.
  [[nodiscard]] std::complex<double> at(std::complex<double> s) const;
};

/// The partial fractions of num(s)/den(s) of any degrees.
///
/// Roots by 31 digits; those of the denominator that lie so close together that one repeated root
/// in their midst changes no coefficient by more than 1e-14 of its terms are one repeated pole:
/// apart, their residues would cancel. Residues by the Taylor series of the other factors.
/// @param num, den  Coefficients in descending powers; zeros in front are left out.
/// @errors ArgumentError::empty, not_finite; TransferError::zero_denominator;
/// SystemError::no_convergence. Cost: O(n³) in 31 digits. Source: Appendix E.3.3 and Table E.1,
/// read backwards; Henrici, "Applied and Computational Complex Analysis", vol. 1 (1974),
/// section 7.1.
[[nodiscard]] Expected<PartialFractions> partial_fractions(const Eigen::VectorXd& num,
                                                           const Eigen::VectorXd& den);
/// Without its delay, of roots that are given: poles are repeated where they are equal. More zeros
/// than poles are allowed. @errors ArgumentError::not_finite beyond the largest double.
[[nodiscard]] Expected<PartialFractions> partial_fractions(const ZeroPoleGain& transfer);

/// tᵏ/k! e^{at} (c cos ωt + d sin ωt).
struct TimeTerm {
  int power = 0;           ///< k
  double rate = 0.0;       ///< a, 1/s
  double frequency = 0.0;  ///< ω, rad/s
  double cosine = 0.0;     ///< c
  double sine = 0.0;       ///< d
};

/// The function of time of which a rational function is the Laplace transform, from t = delay on.
struct TimeFunction {
  std::vector<TimeTerm> terms{};
  Eigen::VectorXd impulses;  ///< Of δ, δ', …; empty without.
  double delay = 0.0;        ///< s

  /// At t, s, from the right; 0 before the delay. Impulses are not in it.
  [[nodiscard]] double value(double t) const;
  /// Such as "0.5 + 2 e^(-t) cos(3 t)". @param digits  Of each number.
  [[nodiscard]] std::string text(int digits = 6) const;
};

/// The function of time of which fractions are the transform. @param delay  s
[[nodiscard]] TimeFunction function_of_time(const PartialFractions& fractions, double delay = 0.0);

/// The inverse Laplace transform in closed form; of a transfer function the impulse response.
/// @errors As `partial_fractions`; TransferError::period_mismatch for a discrete one.
/// Source: book, Table E.1.
[[nodiscard]] Expected<TimeFunction> inverse_laplace(const TransferFunction& transform);
[[nodiscard]] Expected<TimeFunction> inverse_laplace(const ZeroPoleGain& transform);
/// That of G(s)/s: what a unit step is answered by. @errors As above.
[[nodiscard]] Expected<TimeFunction> step_in_closed_form(const TransferFunction& transfer);

}  // namespace flyball::classical
