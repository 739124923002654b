#pragma once

#include <optional>

#include <flyball/classical/filters/iir_design.hpp>

/// Between sample rates (section 7.1.3): what folds, what keeps it out, and what that costs.
namespace flyball::classical {

/// What an anti-aliasing filter shall do.
struct AntiAliasing {
  double band = 0.0;          ///< rad/s: up to here the signal shall be right.
  double attenuation = 40.0;  ///< dB, of what would fold into the band.
  double ripple = 1.0;        ///< dB, largest loss within the band.
  FilterFamily family = FilterFamily::butterworth;  ///< Any but Bessel.
};

/// A filter before samples are taken, and its price.
struct AntiAliasingAdvice {
  double nyquist_frequency = 0.0;  ///< rad/s, of the new rate.
  /// rad/s, 2π/T - band: the lowest frequency that folds into the band.
  double first_alias = 0.0;
  /// Least order. Analog, or for `design_filter` with the old period; order 0 where the old samples
  /// hold nothing that folds into the band.
  IirDesign design;
  double exact_order = 0.0;
  double attenuation = 0.0;  ///< dB, at the first alias: at least what was asked for.
  double loss = 0.0;         ///< dB, at the end of the band.
  double phase_lag = 0.0;    ///< rad, at the end of the band: comes off the phase margin of a loop
                             ///< that crosses over there.
  double delay = 0.0;        ///< s, of slow signals: the group delay at rest.
  double sampling_phase_lag =
      0.0;  ///< rad, ωT/2 there: what the slower samples cost by themselves.
  /// The same attenuation by a filter of linear phase (Kaiser), of a digital source alone.
  Eigen::Index fir_taps = 0;
  double fir_delay = 0.0;  ///< s
};

/// Which filter a signal needs before it is sampled, or sampled more slowly.
/// @param period  T, s: of the samples to come. @param source  s, of those that there are; nothing
/// for an analog signal.
/// @errors ArgumentError::not_positive; out_of_range for a band that is not below half the new
/// sample rate, a source that is not faster, and those of `filter_order`.
/// Source: book, section 7.1.3; Franklin, Powell and Workman, "Digital Control of Dynamic Systems",
/// section 11.3 (the phase).
[[nodiscard]] Expected<AntiAliasingAdvice> advise_anti_aliasing(
    Time period, const AntiAliasing& wanted, std::optional<Time> source = std::nullopt);

/// Each `factor`th sample of a recorded signal, after a low pass without delay (Chebyshev of order
/// 8, 0.05 dB, edge at 0.8 of the new Nyquist frequency, forward and backward).
/// @param x  samples x 1, at least two. @param factor  1 to 1000.
/// @errors ArgumentError::out_of_range, empty, wrong_shape, not_finite.
[[nodiscard]] Expected<Eigen::VectorXd> decimate(const MatrixRef& x, int factor);

/// A recorded signal at up/down times its sample rate, without delay: zeros between the samples,
/// a low pass of linear phase (Kaiser, β = 5, ten of the slower rate's samples long each way), each
/// `down`th sample. Before and after the record the signal counts as zero; with `line` the straight
/// line through its first and last sample is taken off before and put back after, so that it stays.
/// @param x  samples x 1. @param up, down  1 to 10⁵. @return ⌈samples up/down⌉.
/// @errors ArgumentError::out_of_range, empty, wrong_shape, not_finite.
/// Source: Crochiere and Rabiner, "Multirate Digital Signal Processing" (1983), section 3.3.
[[nodiscard]] Expected<Eigen::VectorXd> resample(const MatrixRef& x, int up, int down,
                                                 bool line = false);

}  // namespace flyball::classical
