#pragma once

#include <flyball/estimation/covariance.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// A plant whose process noise is independent of its measurement noise, in place of one where it is
/// not: x_{k+1} = A x_k + B u_k + K y_k + w', with w' ~ N(0, Q) of its own.
struct DecorrelatedPlant {
  Eigen::MatrixXd A;  ///< n x n, A - N R⁻¹ C
  Eigen::MatrixXd B;  ///< n x m, B - N R⁻¹ D
  Eigen::MatrixXd K;  ///< n x p, N R⁻¹, of the measurement y_k of the step's beginning.
  Eigen::MatrixXd Q;  ///< n x n, Q - N R⁻¹ Nᵀ
};

/// Correlated process and measurement noise, E[w_k v_kᵀ] = N, made independent: zero is added to
/// x_{k+1}, N R⁻¹ (y_k - C x_k - D u_k - v_k). A filter corrects with y_k and then predicts
/// x_hat <- A x_hat + B u + K y_k, P <- A P Aᵀ + Q with the matrices answered; without a
/// measurement at the sample it predicts with the plant's own.
///
/// @param Q  n x n. @param R  p x p, positive definite. @param N  n x p.
/// @errors  Those of the covariances' makers; ArgumentError for shapes and entries; not_positive
/// for
///          an R that is singular, and for noises that no joint covariance [Q, N; Nᵀ, R] allows.
/// Cost: O(n³ + p³), allocates. Source: Simon, "Optimal State Estimation" (2006), section 7.1.
[[nodiscard]] Expected<DecorrelatedPlant> decorrelate(const DiscreteSystem<>& plant,
                                                      const Covariance& Q, const Covariance& R,
                                                      const MatrixRef& N);

}  // namespace flyball
