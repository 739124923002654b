#pragma once

#include <flyball/systems/system.hpp>

namespace flyball {

/// A and B of a discretised system.
struct DiscretizedMatrices {
  Eigen::MatrixXd A;  ///< n x n
  Eigen::MatrixXd B;  ///< n x m
};

/// Zero-order hold: A_d = e^{A T}, B_d = ∫₀ᵀ e^{A τ} dτ B, from one block exponential
/// exp([A B; 0 0] T) = [A_d B_d; 0 I], so that A need not have an inverse.
///
/// @param A  n x n, continuous system matrix. @param B  n x m, continuous input matrix.
/// @param period  T, s.
/// @errors ArgumentError for shapes, entries and a period that is not positive; the errors of
/// `expm`. Cost: one exponential of order n + m; allocates. Source: book, Theorem 7.3.1 and D.1.
[[nodiscard]] Expected<DiscretizedMatrices> discretize_zoh(const MatrixRef& A, const MatrixRef& B,
                                                           Time period);

/// A system under zero-order hold, sampled each `period` (Theorem 7.3.1); C and D stay.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<DiscreteSystem<States, Inputs, Outputs>> discretize(
    const ContinuousSystem<States, Inputs, Outputs>& system, Time period) {
  if (auto checked = check_system(system, "discretize"); !checked) {
    return tl::unexpected(checked.error());
  }
  return discretize_zoh(system.A, system.B, period).map([&](const DiscretizedMatrices& discrete) {
    return DiscreteSystem<States, Inputs, Outputs>{discrete.A, discrete.B, system.C, system.D,
                                                   period};
  });
}

// The common sizes are compiled once, in the library.
extern template Expected<DiscreteSystem<1, 1, 1>> discretize(const ContinuousSystem<1, 1, 1>&,
                                                             Time);
extern template Expected<DiscreteSystem<2, 1, 1>> discretize(const ContinuousSystem<2, 1, 1>&,
                                                             Time);

/// A process noise's spectral density, (state unit)²·s: continuous white noise dx/dt = A x + w with
/// E[w(t) w(τ)ᵀ] = Q δ(t - τ). A type of its own, because a per-sample covariance must not be
/// discretised again.
struct ProcessDensity {
  Eigen::MatrixXd Q;  ///< n x n, symmetric, positive semidefinite.
};

/// A measurement noise's spectral density, (output unit)²·s.
struct MeasurementDensity {
  Eigen::MatrixXd R;  ///< p x p, symmetric.
};

/// Q_d = ∫₀ᵀ e^{A τ} Q e^{Aᵀ τ} dτ (7.8).
///
/// By doubling: a Taylor series for a step h = T/2^k with ‖A‖h < 1/2, then
/// Q(2h) = Q(h) + e^{A h} Q(h) e^{Aᵀ h}. Every term is positive semidefinite, so nothing cancels;
/// Van Loan's single exponential carries e^{-A T} and loses everything for ‖A‖T > 25.
///
/// @param A  n x n, continuous. @param density  Q, n x n. @param period  T, s.
/// @return Covariance per sample, n x n, symmetric.
/// @errors ArgumentError for shapes, entries, asymmetry and a period that is not positive;
/// not_finite
///         if the covariance itself overflows (a very unstable A over a long period).
/// Cost: O(n³ log ‖A‖T), allocates.
/// Source: book, Theorem 7.3.1.
[[nodiscard]] Expected<Eigen::MatrixXd> discretize(const MatrixRef& A,
                                                   const ProcessDensity& density, Time period);

/// R_d = R / T: the covariance of one sample that averages the noise over the period (7.9).
/// @errors ArgumentError for an R that is not symmetric or finite, and a period that is not
/// positive.
[[nodiscard]] Expected<Eigen::MatrixXd> discretize(const MeasurementDensity& density, Time period);

}  // namespace flyball
