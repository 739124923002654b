#pragma once

#include <complex>
#include <optional>
#include <vector>

#include <flyball/classical/frequency_response.hpp>

namespace flyball::classical {

/// A half circle to the right around poles on the axis; a quarter at ω = 0 and at π/T.
struct Indentation {
  double frequency = 0.0;  ///< rad/s, of the poles.
  int multiplicity = 0;    ///< How many poles are there, zeros in the same place taken off.
  double radius = 0.0;     ///< rad/s; L is above 100 on it, and no closed-loop pole within it.
  Eigen::Index first = 0;  ///< Its points: from here
  Eigen::Index last = 0;   ///< to here.
};

/// L along the upper half of the Nyquist contour; the lower half is its mirror image.
struct NyquistData {
  Eigen::VectorXd frequency;  ///< rad/s, not decreasing, from 0 where L(0) is finite.
  Eigen::VectorXcd value;     ///< L; on indentations at points beside the axis.
  std::vector<Indentation> indentations{};
  /// Of -1 by the whole contour, clockwise; none where the curve passes through -1, or circles it
  /// for ever (a delay behind a gain of one at infinity).
  std::optional<int> encirclements{};
  int open_loop_unstable = 0;  ///< Poles of L to the right of the axis, or outside the circle.
  /// encirclements + open_loop_unstable: the closed loop's.
  std::optional<int> closed_loop_unstable{};
  double distance = 0.0;  ///< Of the curve from -1: the inverse of the largest |1/(1 + L)|
  double distance_frequency = 0.0;  ///< rad/s, among the points of the curve.
};

/// The Nyquist curve of a loop under negative feedback.
///
/// The count is proven, not sampled: between two points L keeps within |L| (e^v - 1) of its value,
/// where v bounds how far ln L moves, the sum over its poles, zeros and delay; steps are halved
/// until -1 is outside that disk, so that 1 + L turns by the angle between the ends.
/// @param loop  One input, one output, with known factors.
/// @errors ArgumentError::wrong_shape for a matrix; empty for one without factors, of which only
/// points are known; those of `frequency_grid`.
/// Cost: some thousand evaluations. Source: book, section E.3.6; Nyquist, "Regeneration theory",
/// Bell System Technical Journal 11 (1932).
[[nodiscard]] Expected<NyquistData> nyquist(const FrequencyResponse& loop,
                                            const FrequencyGridOptions& options = {});

}  // namespace flyball::classical
