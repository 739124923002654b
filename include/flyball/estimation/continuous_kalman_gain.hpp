#pragma once

#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball {

/// The steady state of a Kalman filter in continuous time.
struct ContinuousKalmanGain {
  Eigen::MatrixXd L;       ///< n x p, P Cᵀ R⁻¹, the L of (9.1).
  Eigen::MatrixXd P;       ///< n x n, error covariance.
  Eigen::VectorXcd poles;  ///< Eigenvalues of A - L C.
  double residual = 0.0;   ///< Relative residual of the Riccati equation.
  double condition = 0.0;  ///< Condition estimate of its solution.
};

/// The L of the continuous observer dx_hat/dt = A x_hat + B u + L (y - C x_hat - D u) (9.1) whose
/// error is least: AP + PAᵀ - PCᵀR⁻¹CP + Q = 0, L = PCᵀR⁻¹. A sampled filter wants `kalman_gain`
/// with the discretised noise; its predictor gain over the period approaches this one.
/// @param A  n x n, continuous. @param C  p x n. @param Q  n x n. @param R  p x p, positive
/// definite.
/// @errors ArgumentError for shapes, entries, asymmetry, and not_positive for a Q that is no
/// density;
///         KalmanGainError::not_detectable with the mode that no output shows, undriven_mode for a
///         mode on the imaginary axis that no noise drives; RiccatiError as `care`.
/// Cost: one Riccati solution; allocates. Source: Kalman and Bucy, "New results in linear filtering
/// and prediction theory", J. Basic Engineering 83 (1961); book, section 9.2.1.
[[nodiscard]] Expected<ContinuousKalmanGain> continuous_kalman_gain(const MatrixRef& A,
                                                                    const MatrixRef& C,
                                                                    const ProcessDensity& Q,
                                                                    const MeasurementDensity& R);

}  // namespace flyball
