#pragma once

#include <complex>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/math/spectra/window.hpp>

/// Changes of basis (section E.3.1): of vectors, of signals to frequencies, and to damped ones.
namespace flyball {

/// A vector in another basis.
struct Coordinates {
  /// Of each basis vector, how often its direction w/|w| is taken: along an orthogonal basis the
  /// projection v·w/|w|.
  Eigen::VectorXd along;
  bool orthogonal = false;  ///< The basis, to 1e-12.
  double rest = 0.0;        ///< |v - Σ along w/|w||: zero where the basis spans v.
};

/// The coordinates of v: its projections where the basis is orthogonal, otherwise those of least
/// squares.
/// @param basis  n x m, m <= n vectors as columns, none of them zero, independent.
/// @param v      n x 1.
/// @errors ArgumentError::empty, wrong_shape, not_finite, malformed for a basis that is dependent.
/// Source: book, section E.3.1, Figure E.9.
[[nodiscard]] Expected<Coordinates> coordinates(const MatrixRef& basis, const MatrixRef& v);

/// What a sampled signal is between its samples.
enum class Interpolation {
  hold,    ///< Each sample for its period.
  linear,  ///< Straight lines, ending with the last sample.
};

/// X(s) = ∫₀^L x(t) e^{-st} dt of a recorded signal, at points of the plane: on the imaginary axis
/// its Fourier transform. The integral of what lies between the samples is exact.
///
/// @param x  samples x 1, from t = 0. @param period  T, s. @param s  Points, 1/s.
/// @return   As many, unit·s.
/// @errors ArgumentError::empty, wrong_shape, not_finite, not_positive; out_of_range for a point at
///         which e^{-st} overflows within the record.
/// Cost: O(samples points), an exponential a point. Source: book, sections E.3.1, E.3.3 and E.3.4.
[[nodiscard]] Expected<Eigen::VectorXcd> laplace_transform(
    const MatrixRef& x, Time period, const Eigen::VectorXcd& s,
    Interpolation between = Interpolation::linear);

/// The spectrum of a recorded signal as amplitudes of sines.
struct AmplitudeSpectrum {
  Eigen::VectorXd frequency;   ///< rad/s: 2πk/(n T), from 0 to half the sample rate.
  Eigen::VectorXcd amplitude;  ///< A e^{jφ} of A cos(ωt + φ), in the signal's unit.
  double bandwidth = 0.0;      ///< rad/s: of noise that a line holds, 2π Σw²/((Σw)² T).
};

/// 2 X_k/Σw for the windowed samples (X₀ and the one at half the sample rate once): a sine of
/// amplitude 1 has a line of 1 at its frequency, whichever the window.
/// @param x  samples x 1. @param period  T, s. @param window  `flat_top` reads amplitudes right
/// wherever they lie.
/// @errors ArgumentError::empty, wrong_shape, not_finite, not_positive.
/// Cost: O(n log n), allocates. Source: book, section E.3.2, Figure E.11.
[[nodiscard]] Expected<AmplitudeSpectrum> amplitude_spectrum(const MatrixRef& x, Time period,
                                                             Window window = Window::rectangular);

/// Tones of known frequencies in a recorded signal.
struct Tones {
  Eigen::VectorXcd amplitude;  ///< A e^{jφ} of A cos(ωt + φ).
  double mean = 0.0;
  double rest = 0.0;  ///< Root mean square of what they do not explain.
};
/// The chord of tones nearest to a signal, by least squares over the record, whichever part of
/// their periods it holds: what a transform's lines cannot tell apart.
/// @param x  samples x 1. @param period  T, s. @param frequency  rad/s, each below half the sample
/// rate, above zero, all different.
/// @errors ArgumentError::empty, wrong_shape, not_finite, not_positive, out_of_range; malformed for
///         a record in which they cannot be told apart.
/// Cost: O(samples tones²), allocates. Source: book, sections E.3.1 and E.3.2.
[[nodiscard]] Expected<Tones> fit_tones(const MatrixRef& x, Time period,
                                        const Eigen::VectorXd& frequency);

}  // namespace flyball
