#pragma once

#include <Eigen/Core>

#include <flyball/core/quantity.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball {

/// Coloured noise as what a linear system makes of white noise: ds/dt = A s + w with
/// E[w(t) w(τ)ᵀ] = Q δ(t - τ), and the noise is n = C s.
///
/// A Kalman filter assumes white noise; other noise is defined in terms of it, and the model
/// augmented with it (book, section 9.6.3, "Modeling other noise colors").
struct ShapingFilter {
  Eigen::MatrixXd A;       ///< k x k, 1/s.
  ProcessDensity density;  ///< Q, k x k.
  Eigen::MatrixXd C;       ///< q x k.
};

/// Noise with the autocovariance σ² e^{-|τ|/T}: dn/dt = -n/T + w, w of the density 2σ²/T. The usual
/// model of a sensor's bias that wanders, or of a disturbance that lasts for about T.
/// @param sigma  Standard deviation, in n's unit, positive. @param correlation_time  T, s.
/// @errors ArgumentError::not_positive, not_finite.
/// Source: Gelb, "Applied Optimal Estimation" (1974), section 3.4 and table 3.8-1.
[[nodiscard]] Expected<ShapingFilter> first_order_gauss_markov(double sigma, Time correlation_time);

/// Noise with a spectral peak: d²n/dt² = -ω² n - 2ζω dn/dt + w, w of the density 4ζω³σ², of
/// variance σ². ζ = 1 has the autocovariance σ² e^{-ω|τ|}(1 + ω|τ|), smooth at zero; a small ζ is a
/// vibration.
/// @param sigma  As above. @param natural_frequency  ω, rad/s. @param damping  ζ, positive.
/// @errors ArgumentError::not_positive, not_finite. Source: Gelb (1974), section 3.8.
[[nodiscard]] Expected<ShapingFilter> second_order_gauss_markov(double sigma,
                                                                AngularVelocity natural_frequency,
                                                                double damping);

/// The integral of white noise, of variance `density` t after t: a bias of which nothing is known
/// but that it walks. @param density  (unit of n)²/s, positive.
/// @errors ArgumentError::not_positive, not_finite. Source: Gelb (1974), section 3.4.
[[nodiscard]] Expected<ShapingFilter> wiener_process(double density);

/// C P e^{Aᵀτ} Cᵀ, q x q, of the noise long after its start: A P + P Aᵀ + Q = 0.
/// @param lag  τ, s, not negative: cov(n(t), n(t + τ)).
/// @errors ArgumentError for shapes and entries; out_of_range for a filter that is not stable, such
///         as a Wiener process, with the pole; those of `lyapunov` and `expm`.
[[nodiscard]] Expected<Eigen::MatrixXd> stationary_autocovariance(const ShapingFilter& filter,
                                                                  double lag = 0.0);

/// A plant and the white noise that drives it.
struct NoisySystem {
  ContinuousSystem<> plant;
  ProcessDensity density;  ///< n x n.
};

/// A plant of which coloured noise moves states and outputs, as a larger plant that only white
/// noise drives: states [x; s],
///
///     A_aug = [A G C_s; 0 A_s],  B_aug = [B; 0],  C_aug = [C F C_s],  Q_aug = [Q 0; 0 Q_s]
///
/// @param plant    Continuous; discretise the result, its noise by `discretize(A, density, T)`.
/// @param density  Q, n x n, of the white noise that the plant has beside it.
/// @param G  n x q, how the noise acts on the states; @param F  p x q, on the outputs.
/// @errors ArgumentError for shapes, entries, and not_positive for a density that is none.
/// Source: book, section 9.6.3; Gelb (1974), section 3.8; Simon, "Optimal State Estimation" (2006),
/// section 7.2.
[[nodiscard]] Expected<NoisySystem> augment_noise(const ContinuousSystem<>& plant,
                                                  const ProcessDensity& density,
                                                  const ShapingFilter& filter, const MatrixRef& G,
                                                  const MatrixRef& F);

}  // namespace flyball
