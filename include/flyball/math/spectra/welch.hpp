#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/math/spectra/window.hpp>

namespace flyball {

/// How a record is cut into stretches whose spectra are averaged.
struct WelchOptions {
  /// Samples a stretch; 0 takes what gives eight half overlapping ones. The resolution is
  /// 2π/(length T).
  Eigen::Index length = 0;
  double overlap = 0.5;  ///< Share of a stretch that is in the next one too, in [0, 0.95].
  Window window = Window::hann;
  bool remove_mean = true;  ///< Of each stretch.
};

/// Averaged spectra of several signals and between them.
struct CrossSpectra {
  Eigen::VectorXd frequency;  ///< rad/s, from 0 to half the sample rate.
  /// For each frequency signals x signals, Hermitian: S_ij is the one-sided density of
  /// E[X_i X_j*], in unit_i unit_j / Hz. The integral of S_ii over the frequency in Hz is the
  /// signal's variance.
  std::vector<Eigen::MatrixXcd> density;
  Eigen::Index stretches = 0;
  double averages = 0.0;  ///< As many independent stretches would be as good.
};

/// Welch's estimate of the spectra of signals that were recorded together.
/// @param signals  samples x signals. @param period  T, s.
/// @errors ArgumentError for shapes, entries and options.
/// Cost: O(samples signals (log length + signals)), allocates.
/// Source: Welch, IEEE Trans. Audio Electroacoustics 15 (1967).
[[nodiscard]] Expected<CrossSpectra> cross_spectra(const MatrixRef& signals, Time period,
                                                   const WelchOptions& options = {});

/// The one of a single signal.
struct PowerSpectrum {
  Eigen::VectorXd frequency;  ///< rad/s.
  Eigen::VectorXd density;    ///< unit²/Hz, one-sided.
  double averages = 0.0;
};
/// As `cross_spectra`. @param x  samples x 1.
[[nodiscard]] Expected<PowerSpectrum> welch(const MatrixRef& x, Time period,
                                            const WelchOptions& options = {});

/// Which signals of a frequency response's estimate are taken for noisy.
enum class ResponseEstimator {
  h1,  ///< Noise in y alone: S_yu S_uu⁻¹, the least squares one.
  h2,  ///< Noise in u alone: S_yy S_uy⁻¹; as many outputs as inputs.
};

/// G(jω) with y = G u, measured.
struct FrequencyResponseEstimate {
  Eigen::VectorXd frequency;               ///< rad/s.
  std::vector<Eigen::MatrixXcd> response;  ///< Outputs x inputs, for each frequency.
  Eigen::MatrixXd coherence;  ///< Frequencies x outputs: the share of y's power that u explains (of
                              ///< several inputs together), in [0, 1].
  /// For each frequency, outputs x inputs: the true entry is within this distance with the asked
  /// confidence, infinite where there are not more averages than inputs.
  std::vector<Eigen::MatrixXd> radius;
  double averages = 0.0;
};

/// The frequency response between signals that were recorded together, by spectra.
///
/// A periodic excitation (`multisine`, `prbs`) is best cut into its whole periods, after the
/// transient: its length, no overlap, no window, mean kept.
/// @param u  samples x inputs. @param y  samples x outputs. @param period  T, s.
/// @param confidence  Of the radius, in (0, 1).
/// @errors ArgumentError for shapes, entries, options; wrong_shape for h2 with other sizes.
/// Where an input has no power at a frequency the response there is NaN, the coherence zero.
/// Source: book, section E.7; Bendat and Piersol, "Random Data" (4th ed.), sections 6.1, 9.2 and
/// 9.3.
[[nodiscard]] Expected<FrequencyResponseEstimate> estimate_frequency_response(
    const MatrixRef& u, const MatrixRef& y, Time period, const WelchOptions& options = {},
    ResponseEstimator estimator = ResponseEstimator::h1, double confidence = 0.95);

/// The response to a sine: amplitude and phase of both signals at one frequency.
struct SineResponse {
  std::complex<double> response;  ///< Y/U.
  double radius = 0.0;            ///< 95 % of it.
  double coherence = 0.0;  ///< Share of y that the sine explains, without its mean and drift.
};

/// One point of a Bode plot, as the book measures it: the sines of ω in u and y, fitted by least
/// squares together with a mean and a drift, over any number of turns (two at least).
/// @param u, y  samples x 1, after the transient. @param frequency  ω, rad/s, below half the sample
/// rate.
/// @errors ArgumentError for shapes, entries; out_of_range for a frequency that the record does not
/// hold twice or that aliases; malformed where u has no sine of it.
/// Source: book, section E.7.
[[nodiscard]] Expected<SineResponse> sine_response(const MatrixRef& u, const MatrixRef& y,
                                                   double frequency, Time period);

}  // namespace flyball
