#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <flyball/estimation/covariance.hpp>
#include <flyball/geometry/manifold.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// What a filter, linear or extended, did between two of its estimates: the prediction
/// x⁻ = f(x of before), P⁻ = F P Fᵀ + Q with P of before, and the estimate that its measurements
/// made of it. X is a vector or any other Manifold; its matrices are of its differences.
template <Manifold X>
struct FilterStepOf {
  TangentMatrix<X> F;  ///< n x n, A or ∂f/∂x at the estimate of before.
  TangentMatrix<X> Q;  ///< n x n, covariance of the noise of this step.
  X x_prior;           ///< x⁻.
  X x;                 ///< x⁺; x⁻ where nothing was measured.
  TangentMatrix<X> P;  ///< n x n, P⁺.
};

/// The same of vectors, n x 1.
template <int States = Eigen::Dynamic>
using FilterStep = FilterStepOf<Eigen::Matrix<double, States, 1>>;

/// The F and Q of a filter that has no Jacobian, such as an unscented one: F = XᵀP⁺, the linear map
/// that explains most of x⁻, and Q = P⁻ - F P Fᵀ, the rest and the noise.
/// @param cross    n x n, X = cov(x of before, x⁻). @param P  n x n, of before.
/// @param P_prior  n x n, P⁻.
/// @return F and Q; the rest is left empty.
/// @errors ArgumentError for shapes and entries; not_positive if the three are no joint covariance.
/// Source: Särkkä, "Unscented Rauch-Tung-Striebel smoother", IEEE Trans. Automatic Control 53
/// (2008).
[[nodiscard]] Expected<FilterStep<>> statistical_linearization(const MatrixRef& cross,
                                                               const MatrixRef& P,
                                                               const MatrixRef& P_prior);

/// Estimates that use the measurements before and after them.
struct SmoothedPath {
  Eigen::MatrixXd x;                     ///< n x (N + 1), column 0 before the first step.
  std::vector<Eigen::MatrixXd> P;        ///< N + 1 error covariances, n x n.
  std::vector<Eigen::MatrixXd> P_cross;  ///< N, cov(x_k, x_{k+1}), for fits of the noise.
};

/// The Rauch-Tung-Striebel smoother over what a filter left. Theorem 9.7.1:
///
///     K = P⁺Fᵀ(P⁻)⁻¹,  x_{k|N} = x⁺ + K(x_{k+1|N} - x⁻),  P_{k|N} = P⁺ + K(P_{k+1|N} - P⁻)Kᵀ
///
/// from the last estimate back. P is carried as a factor of the sum of covariances
/// (I - KF)P⁺(I - KF)ᵀ + K(P_{k+1|N} + Q)Kᵀ, and K is computed from factors of P⁺ and Q, so that a
/// P⁻ without an inverse (Q without noise on some state, a state that was known) is no exception.
/// With an extended filter's history it is the extended smoother.
///
/// @param x0, P0  n, n x n: the estimate before the first step. @param steps  N steps of n states.
/// @errors ArgumentError for shapes, entries, and not_positive for what is no covariance, each
///         naming the step.
/// Cost: O(N n³), allocates. Source: book, Theorem 9.7.1; Rauch, Tung, Striebel, "Maximum
/// likelihood estimates of linear dynamic systems", AIAA Journal 3 (1965), (3.30) to (3.33); the
/// sum: Park and Kailath, "New square-root smoothing algorithms", IEEE Trans. Automatic Control 41
/// (1996).
[[nodiscard]] Expected<SmoothedPath> smooth(const Eigen::VectorXd& x0, const MatrixRef& P0,
                                            std::span<const FilterStep<>> steps);

/// A step of a linear model, of which each may be another, and what was measured after it:
/// x_k = A x_{k-1} + input + w, w ~ N(0, Q); y = C x_k + v, v ~ N(0, R).
struct LinearStep {
  Eigen::MatrixXd A;      ///< n x n.
  Eigen::VectorXd input;  ///< n, B u; empty for zero.
  Eigen::MatrixXd Q;      ///< n x n, may be singular or zero.
  Eigen::MatrixXd C;  ///< p x n; p may be another in each step, and 0 where nothing is measured.
  Eigen::MatrixXd R;  ///< p x p, may be singular.
  Eigen::VectorXd y;  ///< p, without D u; NaN is an entry that is missing.
};

/// A path, what the filter had made of it before, and how likely the measurements are.
struct LinearSmoothing {
  SmoothedPath smoothed;
  Eigen::MatrixXd x_filtered;               ///< n x (N + 1), x⁺.
  std::vector<Eigen::MatrixXd> P_filtered;  ///< N + 1.
  double log_likelihood = 0.0;  ///< log p(y₁ … y_N), the sum of the innovations' log densities.
  Eigen::VectorXd nis;          ///< N, normalised innovation squared; 0 where nothing was measured.
  Eigen::VectorXi measured;     ///< N, how many entries it has: its degrees of freedom.
};

/// Kalman filter and Rauch-Tung-Striebel smoother of a linear model (Theorems 9.6.3 and 9.7.1), by
/// factors of the covariances throughout: the path is that of one least-squares problem
///
///     min ‖x₀ - x0‖²_P0⁻¹ + Σ ‖x_k - A x_{k-1} - input‖²_Q⁻¹ + ‖y - C x_k‖²_R⁻¹
///
/// whose certain parts (P0, Q, R singular) are constraints.
///
/// @param x0, P0  n, n x n: the estimate before the first step; a measurement of that instant is a
///                step with A = I and Q = 0.
/// @errors ArgumentError for shapes, entries, and not_positive for what is no covariance, each
///         naming the step; out_of_range where the estimate is beyond the largest double;
///         GaussianError::contradiction with the entry of y for a measurement
///         without noise that differs from what is certain.
/// Cost: O(N n³), allocates.
[[nodiscard]] Expected<LinearSmoothing> smooth(const Eigen::VectorXd& x0, const MatrixRef& P0,
                                               std::span<const LinearStep> steps);

/// The same for a plant: x_k = A x_{k-1} + B u_{k-1}, y_k = C x_k + D u_{k-1} with the input that
/// is held until y_k is measured.
/// @param Q, R  Covariances per sample. @param inputs  m x N. @param outputs  p x N; NaN: missing.
/// @errors As above, and those of the covariances' makers.
[[nodiscard]] Expected<LinearSmoothing> smooth(const DiscreteSystem<>& plant, const Covariance& Q,
                                               const Covariance& R, const Eigen::VectorXd& x0,
                                               const Covariance& P0, const MatrixRef& inputs,
                                               const MatrixRef& outputs);

}  // namespace flyball
