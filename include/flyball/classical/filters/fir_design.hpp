#pragma once

#include <Eigen/Core>

#include <flyball/classical/filters/iir_design.hpp>
#include <flyball/math/spectra/window.hpp>

/// Filters of finite impulse response, y_k = Σ b_i x_{k-i}: what they answer are the taps b,
/// the newest sample's first.
namespace flyball::classical {

/// What passes, and where the edges are.
struct FirDesign {
  FilterBand band = FilterBand::low_pass;
  Eigen::Index taps = 21;        ///< Odd, unless half the sample rate does not pass.
  double frequency = 0.0;        ///< rad/s: the edge (at -6 dB), or a band's lower one.
  double upper_frequency = 0.0;  ///< rad/s, a band's upper edge.
};

/// The ideal filter's impulse response, sin(ω_c k)/(πk), cut by a window and scaled to a gain of
/// one in the middle of what passes (at rest, half the sample rate, or between the edges). Its
/// phase is linear: every frequency is late by (taps - 1)/2 samples.
/// @param period  T, s. @param window  Symmetric: the last sample is the first again.
/// @errors ArgumentError::out_of_range for taps (1 to 10⁶, even where half the sample rate
/// passes) and edges; not_positive.
/// Source: Oppenheim and Schafer, "Discrete-Time Signal Processing", section 7.5.
[[nodiscard]] Expected<Eigen::VectorXd> design_fir(const FirDesign& design, Time period,
                                                   Window window = Window::hamming);
/// With Kaiser's window, I₀(β√(1 - x²))/I₀(β). @param beta  Not negative.
[[nodiscard]] Expected<Eigen::VectorXd> design_fir(const FirDesign& design, Time period,
                                                   double beta);

/// What Kaiser's window takes to reach an attenuation.
struct KaiserChoice {
  Eigen::Index taps = 0;
  double beta = 0.0;
};
/// @param attenuation  dB, of the stop band and the pass band's ripple; from 8. @param width  rad/s
/// from pass to stop edge. @param period  T, s.
/// @errors ArgumentError::out_of_range, not_positive.
/// Source: Kaiser, IEEE ISCAS (1974), eq. (3), (4).
[[nodiscard]] Expected<KaiserChoice> kaiser_choice(double attenuation, double width, Time period);

/// I₀(β√(1 - x²))/I₀(β) at as many places x from -1 to 1. @errors ArgumentError::out_of_range.
[[nodiscard]] Expected<Eigen::VectorXd> kaiser_window(Eigen::Index length, double beta);

/// 1/n each. @param taps  n, 1 to 10⁶. @errors ArgumentError::out_of_range.
[[nodiscard]] Expected<Eigen::VectorXd> moving_average(Eigen::Index taps);

/// The derivative of the polynomial through samples at given places: exact for polynomials of a
/// degree below their number.
/// @param offsets  n x 1, in samples relative to now, all different: {-2, -1, 0}. Taps go with
/// them, in their order. @param derivative  0 to n - 1. @param period  T, s.
/// @errors ArgumentError::empty, not_finite, malformed (a place twice), out_of_range, not_positive.
/// Source: Fornberg, Mathematics of Computation 51 (1988).
[[nodiscard]] Expected<Eigen::VectorXd> finite_difference(const Eigen::VectorXd& offsets,
                                                          int derivative, Time period);

/// The same of the last samples, newest first: the taps of a causal filter.
/// @param samples  Above the derivative. @errors As `finite_difference`.
[[nodiscard]] Expected<Eigen::VectorXd> backward_difference(int derivative, Eigen::Index samples,
                                                            Time period);

/// The value or derivative of the polynomial that fits the last samples best, by least squares.
struct SavitzkyGolay {
  Eigen::Index taps = 5;  ///< Samples, 1 to 10⁵.
  int degree = 2;         ///< Of the polynomial, below `taps`; up to 20.
  int derivative = 0;     ///< 0 … degree.
  /// Samples back from the newest one at which the polynomial is taken: (taps - 1)/2, the middle,
  /// is smoothest and that much late; 0 is not late, and noisier.
  double at = 0.0;
};
/// Taps, newest sample first. @param period  T, s.
/// @errors ArgumentError::out_of_range, not_finite, not_positive.
/// Cost: O(taps degree), by polynomials that are orthogonal on the samples: no ill-conditioned
/// powers. Source: Savitzky and Golay, Analytical Chemistry 36 (1964); Gram, the polynomials.
[[nodiscard]] Expected<Eigen::VectorXd> savitzky_golay(const SavitzkyGolay& fit, Time period);

/// A recorded signal smoothed (or differentiated) by it: each sample by the fit around it, those at
/// both ends by the first and the last whole fit.
/// @param x  samples x 1, `taps` at least. @param fit  `taps` odd; `at` is not used.
/// @errors As `savitzky_golay`; wrong_shape, out_of_range. Cost: O(samples taps).
[[nodiscard]] Expected<Eigen::VectorXd> smooth(const MatrixRef& x, const SavitzkyGolay& fit,
                                               Time period);

/// H(e^{jωT}) = Σ b_i e^{-jωTi}. @param angle  ωT, rad.
[[nodiscard]] std::complex<double> fir_response(const Eigen::VectorXd& taps, double angle);

}  // namespace flyball::classical
