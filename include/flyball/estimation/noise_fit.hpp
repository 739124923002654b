#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// How large the noises of a model are, from a record of its measurements.
namespace flyball {

/// A step of a linear model whose noises are looked for, and what was measured after it:
/// x_k = A x_{k-1} + input + w, w ~ N(0, Σ σᵢ² Gᵢ); y = C x_k + v, v ~ N(0, diag(ρ²)).
struct NoiseStep {
  Eigen::MatrixXd A;      ///< n x n.
  Eigen::VectorXd input;  ///< n; empty for zero.
  /// One an entry of σ, n x n: the covariance that σᵢ = 1 adds in this step. Empty: this step has
  /// no noise.
  std::vector<Eigen::MatrixXd> G;
  Eigen::MatrixXd C;  ///< p x n.
  Eigen::VectorXd y;  ///< p, without D u; NaN is an entry that is missing.
};

/// A record, from an estimate before its first step.
struct NoiseRecord {
  Eigen::VectorXd x0;            ///< n
  Eigen::MatrixXd P0;            ///< n x n
  std::vector<NoiseStep> steps;  ///< A measurement of the first instant is one with A = I, no G.
};

/// log p(y₁ … y_N; σ, ρ), and how it changes with the logarithms of the deviations.
struct NoiseLikelihood {
  double log_likelihood = 0.0;
  Eigen::VectorXd by_log_process;      ///< r, ∂/∂ log σ.
  Eigen::VectorXd by_log_measurement;  ///< p, ∂/∂ log ρ.
};

/// The likelihood of records by the Kalman filter, and its exact gradient by Fisher's identity in a
/// smoother's backward pass that inverts no Q (nor R): with r, N of de Jong's recursion
///
///     ∂/∂Q = (r rᵀ - N)/2,   ∂/∂R = (u uᵀ - D)/2,  u = S⁻¹ν - Kᵀr,  D = S⁻¹ + KᵀN K.
///
/// @param process, measurement  σ (r) and ρ (p), not negative.
/// @errors ArgumentError for shapes and entries, each naming the step; not_positive where an
///         innovation has no variance.
/// Cost: O(N (n + r) n²), allocates. Source: Koopman and Shephard, "Exact score for time series
/// models in state space form", Biometrika 79 (1992), theorem 1.
[[nodiscard]] Expected<NoiseLikelihood> noise_likelihood(std::span<const NoiseRecord> records,
                                                         const Eigen::VectorXd& process,
                                                         const Eigen::VectorXd& measurement);

/// A standard deviation that was looked for.
struct NoiseDeviation {
  double value = 0.0;
  /// Of its logarithm: value (1 ± relative_error). Infinite where the records do not determine it,
  /// zero of one that was fixed.
  double relative_error = 0.0;
  bool is_free = false;
  bool is_negligible = false;  ///< The records are as likely with a hundredth of it.
  /// A millionth of where the search began, where it ends: the records are ever more likely the
  /// smaller it is, as where readings repeat exactly.
  bool vanishes = false;
};

/// Options of `fit_noise`.
struct NoiseFitOptions {
  int iterations = 200;
  double tolerance = 1e-6;  ///< Of log p, what is left to be gained.
};

/// The noises that make records most likely.
struct NoiseFit {
  std::vector<NoiseDeviation> process{};      ///< r
  std::vector<NoiseDeviation> measurement{};  ///< p
  double log_likelihood = 0.0;
  double start_log_likelihood = 0.0;  ///< Of the deviations that it began with.
  double expected_gain = 0.0;  ///< What the quadratic model says is left to be gained of log p.
  int iterations = 0;
  bool converged = false;
};

/// Maximum likelihood of the diagonal noises: BFGS over the logarithms of the deviations with the
/// gradients of `noise_likelihood`, each step an increase; standard errors from the observed
/// information.
/// @param process, measurement  Where the search begins; zeros stay zero.
/// @errors As `noise_likelihood`; ArgumentError::empty where nothing is free, out_of_range for
///         options.
/// Cost: some dozen likelihoods; allocates. Source: Shumway, Stoffer, "Time Series Analysis and Its
/// Applications" (2017), 6.3, with Fisher's identity in place of EM's slow steps.
[[nodiscard]] Expected<NoiseFit> fit_noise(std::span<const NoiseRecord> records,
                                           const Eigen::VectorXd& process,
                                           const Eigen::VectorXd& measurement,
                                           const NoiseFitOptions& options = {});

/// ∫₀^dt Φ(τ) Q Φ(τ)ᵀ dτ (7.8) of a step whose transition is known, by Simpson's rule with
/// Φ(dt/2) = √F to third order; of steps that are short against the model.
/// @param F  n x n, Φ(dt). @param density  n x n, a spectral density. @param dt  s.
[[nodiscard]] Eigen::MatrixXd step_noise(const MatrixRef& F, const MatrixRef& density, double dt);

}  // namespace flyball
