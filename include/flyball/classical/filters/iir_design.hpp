#pragma once

#include <array>
#include <optional>
#include <string_view>

#include <flyball/classical/filters/digital_filter.hpp>

/// Filters of infinite impulse response, by the classical analog prototypes. Frequencies are rad/s,
/// ripples and attenuations dB.
namespace flyball::classical {

/// Which error of the ideal filter is made as small as it can be.
enum class FilterFamily {
  butterworth,  ///< Flat in the middle of the pass band; falls everywhere.
  chebyshev1,   ///< Equal ripples in the pass band.
  chebyshev2,   ///< Equal ripples in the stop band.
  elliptic,     ///< In both: the shortest way from one to the other.
  bessel,       ///< Flat group delay at rest: keeps the shape of a signal.
};
[[nodiscard]] std::string_view to_string(FilterFamily family);

/// What passes.
enum class FilterBand { low_pass, high_pass, band_pass, band_stop };
[[nodiscard]] std::string_view to_string(FilterBand band);

/// What a filter shall be.
struct IirDesign {
  FilterFamily family = FilterFamily::butterworth;
  FilterBand band = FilterBand::low_pass;
  int order = 2;  ///< 1 to 20, of the prototype: a band has twice as many poles.
  /// rad/s, the edge, or a band's lower one: where a Butterworth filter is at -3.01 dB, where
  /// chebyshev1 and elliptic leave the ripple of the pass band, where chebyshev2 reaches its
  /// attenuation; of Bessel where its asymptotes meet (as a Butterworth filter's do there).
  double frequency = 0.0;
  double upper_frequency = 0.0;  ///< rad/s, a band's upper edge.
  double ripple = 1.0;           ///< dB, of chebyshev1 and elliptic in the pass band.
  double attenuation = 40.0;     ///< dB, of chebyshev2 and elliptic in the stop band.
};

/// H(s) = gain Π(s - zᵢ)/Π(s - pⱼ).
struct AnalogFilter {
  Eigen::VectorXcd zeros;  ///< rad/s
  Eigen::VectorXcd poles;  ///< rad/s
  double gain = 1.0;

  /// H(jω). @param frequency  rad/s.
  [[nodiscard]] std::complex<double> response(double frequency) const;
  /// -d∠H/dω, s.
  [[nodiscard]] double group_delay(double frequency) const;
};

/// The prototype, a low pass with its edge at 1 rad/s.
/// @errors ArgumentError for an order, ripple or attenuation out of its range.
/// Elliptic zeros and poles come from Jacobi's functions of a modulus and its complement, so that
/// they keep all digits for any ripple and attenuation.
/// Source: Orfanidis, "Lecture Notes on Elliptic Filter Design" (2006); Bessel: Thomson,
/// Proceedings of the IEE 96 (1949).
[[nodiscard]] Expected<AnalogFilter> filter_prototype(FilterFamily family, int order,
                                                      double ripple = 1.0,
                                                      double attenuation = 40.0);

/// The filter in s: the prototype through s/ω_c, ω_c/s, (s² + ω₁ω₂)/(s(ω₂ - ω₁)) or its inverse.
/// @errors As `filter_prototype`; not_positive for the frequency, out_of_range for an upper one
/// that is not above it, and for a frequency whose power of the order overflows.
[[nodiscard]] Expected<AnalogFilter> design_analog_filter(const IirDesign& design);

/// The filter in z, by the bilinear transform with each edge prewarped, so that the edges are where
/// they were asked for. Roots are mapped as roots; polynomials are never multiplied out.
/// @param period  T, s: of the samples.
/// @errors As `design_analog_filter`; out_of_range for an edge at or above half the sample rate,
/// and for one so far below it (some 1e-8 of it) that sections of doubles are not stable. Cost:
/// O(order²); allocates. The sections' coefficients are doubles: with an edge far below the sample
/// rate their rounding moves the response by about 1e-16/(ωT)², the reference gain excepted.
[[nodiscard]] Expected<DigitalFilter> design_filter(const IirDesign& design, Time period);

/// What a filter must do. Low pass: {pass} < {stop}; high pass: {stop} < {pass}; band pass: the
/// pass band lies within the stop edges; band stop: the other way around.
struct FilterSpecification {
  std::array<double, 2> pass{};  ///< rad/s, the second one of bands alone.
  std::array<double, 2> stop{};
  double ripple = 1.0;        ///< dB, largest loss in the pass band.
  double attenuation = 40.0;  ///< dB, least loss in the stop band.
};

/// The least order that meets a specification.
struct FilterOrder {
  /// Ready for `design_filter`: family, band, order, edges, ripples.
  IirDesign design;
  double exact = 0.0;  ///< The order before it was rounded up.
};

/// The filter of least order that meets a specification, with its pass band's edge exactly at the
/// ripple.
/// @param family  Any but Bessel. @param period  T, s, of a digital filter; of an analog one
/// nothing.
/// @errors ArgumentError::out_of_range for edges that are not in order, an attenuation that is not
///         above the ripple, an order above 20; malformed for Bessel; not_positive.
/// Source: Parks and Burrus, "Digital Filter Design" (1987), chapter 7.
[[nodiscard]] Expected<FilterOrder> filter_order(FilterFamily family, FilterBand band,
                                                 const FilterSpecification& specification,
                                                 std::optional<Time> period = std::nullopt);

}  // namespace flyball::classical
