#pragma once

#include <string_view>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>

namespace flyball {

/// How a stretch of a signal is faded in and out, so that what does not end where it began does not
/// leak into other frequencies.
enum class Window {
  rectangular,      ///< None: right for a whole number of a signal's periods.
  hann,             ///< The usual one.
  hamming,          ///< Lowest next lobe of those with two cosines.
  blackman,         ///< Three cosines, side lobes below -58 dB.
  blackman_harris,  ///< Four, below -92 dB.
  flat_top,         ///< Five: amplitudes of lines right to 0.01 dB wherever they lie.
};
/// "rectangular", "hann", …
[[nodiscard]] std::string_view to_string(Window window);

/// The window's n samples, periodic: the next one would be the first again.
/// @param length  n >= 1. @errors ArgumentError::out_of_range.
/// Source: Harris, Proceedings of the IEEE 66 (1978); flat top: Heinzel, Rüdiger and Schilling
/// (2002), that of Matlab.
[[nodiscard]] Expected<Eigen::VectorXd> window_samples(Window window, Eigen::Index length);

}  // namespace flyball
