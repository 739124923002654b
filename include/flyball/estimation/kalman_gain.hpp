#pragma once

#include <complex>

#include <Eigen/Core>

#include <flyball/estimation/covariance.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// Why there is no steady-state filter.
enum class KalmanGainError {
  not_detectable,  ///< A mode that does not decay by itself is shown by no output.
  undriven_mode,   ///< A mode on the unit circle that no noise drives: its gain goes to zero.
};
[[nodiscard]] ErrorInfo error_info(KalmanGainError code);

/// The steady state of a Kalman filter.
template <int States = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
struct KalmanGain {
  Eigen::Matrix<double, States, Outputs> K;           ///< Filter form P Cᵀ (C P Cᵀ + R)⁻¹ (9.22).
  Eigen::Matrix<double, States, Outputs> L;           ///< Predictor form A K.
  Eigen::Matrix<double, States, States> P_prior;      ///< Error covariance before an update.
  Eigen::Matrix<double, States, States> P_posterior;  ///< Error covariance after it.
  Eigen::Matrix<std::complex<double>, States, 1> poles;  ///< Eigenvalues of A - L C.
  double residual = 0.0;   ///< Relative residual of the Riccati equation.
  double condition = 0.0;  ///< Condition estimate of its solution.
};

/// The gain that the filter of Theorem 9.6.3 converges to, from the Riccati equation's dual:
/// P = A P Aᵀ + Q - A P Cᵀ (C P Cᵀ + R)⁻¹ C P Aᵀ.
///
/// @param A  n x n, discrete. @param C  p x n.
/// @param Q  n x n, process noise covariance per sample. @param R  p x p, measurement noise
///           covariance per sample.
/// @errors ArgumentError for shapes, entries, asymmetry, and not_positive for a Q or R that is no
///         covariance; the error of a covariance's maker; KalmanGainError::not_detectable with the
///         mode that no output shows, undriven_mode with that mode; RiccatiError::singular where
///         C P Cᵀ + R has no inverse, no_convergence where no answer could be verified, overflow.
/// P, K, L and P⁺ are right to their last digit where the Riccati equation determines them: its
/// solution is corrected and used in twice the working precision.
/// Cost: one Riccati solution and a Lyapunov equation for each correction; allocates. Source: book,
/// section 9.6, equations 9.21 to 9.24.
[[nodiscard]] Expected<KalmanGain<>> kalman_gain(const MatrixRef& A, const MatrixRef& C,
                                                 const Covariance& Q, const Covariance& R);

template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<KalmanGain<States, Outputs>> kalman_gain(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Covariance& Q,
    const Covariance& R) {
  return kalman_gain(plant.A, plant.C, Q, R).map([](const KalmanGain<>& gain) {
    return KalmanGain<States, Outputs>{gain.K,     gain.L,        gain.P_prior,  gain.P_posterior,
                                       gain.poles, gain.residual, gain.condition};
  });
}

template <int States, int Inputs, int Outputs, class... Rest>
void kalman_gain(const ContinuousSystem<States, Inputs, Outputs>& plant, const Rest&...) = delete;

}  // namespace flyball
