#pragma once

#include <complex>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball::classical {

/// A section of second order, (b0 + b1 z⁻¹ + b2 z⁻²)/(1 + a1 z⁻¹ + a2 z⁻²).
struct Biquad {
  double b0 = 1.0;
  double b1 = 0.0;
  double b2 = 0.0;
  double a1 = 0.0;
  double a2 = 0.0;

  friend bool operator==(const Biquad&, const Biquad&) = default;
};

/// H(z) = gain Π(z - zᵢ)/Π(z - pⱼ), and the same as sections one after the other.
struct DigitalFilter {
  Eigen::VectorXcd zeros;  ///< Never more than poles.
  Eigen::VectorXcd poles;  ///< Inside the unit circle.
  double gain = 1.0;
  /// Each has a gain of one where the filter has its reference gain (at rest, half the sample rate
  /// or in the middle of a band), but for the first, which has the filter's; the poles nearest to
  /// the circle come last.
  std::vector<Biquad> sections;
  Time period{1.0};

  /// H(e^{jωT}) by the roots. @param frequency  rad/s.
  [[nodiscard]] std::complex<double> response(double frequency) const;
  /// -d∠H/dω, s: how late the envelope of a sine comes out. @param frequency  rad/s.
  [[nodiscard]] double group_delay(double frequency) const;
};

/// A filter from its roots. @param zeros, poles  In pairs of conjugates, at most as many zeros as
/// poles. @param reference  Point of the unit circle, rad/s, at which the sections get their gains;
/// it must not be a zero.
/// @errors ArgumentError::not_finite, not_positive (the period), malformed (a root without its
///         conjugate, a reference at a zero), wrong_shape (more zeros than poles), out_of_range (a
///         pole that is not inside the unit circle).
/// Pairing: each pair of poles, those nearest to the circle first, takes the zeros nearest to it;
/// of real zeros the nearest and the farthest. Source: Jackson, "Digital Filters and Signal
/// Processing" (3rd ed.), section 11.3.
[[nodiscard]] Expected<DigitalFilter> make_filter(const Eigen::VectorXcd& zeros,
                                                  const Eigen::VectorXcd& poles, double gain,
                                                  Time period, double reference = 0.0);

/// The response of sections, by their coefficients. @param angle  ωT, rad.
[[nodiscard]] std::complex<double> section_response(std::span<const Biquad> sections, double angle);

/// What a filter takes for the samples before the first.
enum class FilterStart {
  steady,  ///< The first sample, for ever.
  rest,    ///< Zero.
};

/// A signal filtered as a robot would filter it: late by the filter's delay.
/// @param sections  Stable. @param x  samples x 1.
/// @errors ArgumentError::empty, wrong_shape, not_finite, out_of_range (an unstable section).
/// Cost: O(samples sections); allocates.
[[nodiscard]] Expected<Eigen::VectorXd> filter_signal(std::span<const Biquad> sections,
                                                      const MatrixRef& x,
                                                      FilterStart start = FilterStart::steady);

/// A recorded signal filtered forward and then backward: nothing is late, the response is |H|².
///
/// Both ends are continued by their point reflections, 2x₀ - x_k, three times as long as the filter
/// has coefficients (where the record is that long), and each way begins at rest with its first
/// sample.
/// @param sections  Stable. @param x  samples x 1, at least two.
/// @errors As `filter_signal`; out_of_range for one sample.
/// Cost: O(samples sections); allocates. Source: Gustafsson, IEEE Trans. Signal Processing 44
/// (1996), the point reflection.
[[nodiscard]] Expected<Eigen::VectorXd> filter_zero_phase(std::span<const Biquad> sections,
                                                          const MatrixRef& x);

/// Stable sections with finite coefficients below 1e100. @errors ArgumentError::empty, not_finite,
/// out_of_range.
[[nodiscard]] Expected<void> check_sections(std::span<const Biquad> sections,
                                            std::string_view where);

}  // namespace flyball::classical
