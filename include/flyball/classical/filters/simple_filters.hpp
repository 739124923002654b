#pragma once

#include <flyball/classical/filters/digital_filter.hpp>

/// Filters of one section, in closed form. Frequencies rad/s.
namespace flyball::classical {

/// Takes out one frequency: H = 1 at rest and at half the sample rate, 0 at the notch, -3.01 dB at
/// both ends of `bandwidth`.
/// @param frequency  rad/s, below half the sample rate. @param bandwidth  rad/s: frequency/Q.
/// @param period  T, s.
/// @errors ArgumentError::not_positive; out_of_range for a frequency or a bandwidth that is not
/// below half the sample rate.
/// Source: Orfanidis, "Introduction to Signal Processing" (1996), section 11.3.
[[nodiscard]] Expected<DigitalFilter> notch_filter(double frequency, double bandwidth, Time period);

/// Passes one frequency: 1 minus the notch. Parameters and errors are those of `notch_filter`.
[[nodiscard]] Expected<DigitalFilter> peak_filter(double frequency, double bandwidth, Time period);

/// y_k = a y_{k-1} + (1 - a) x_k with a = e^{-T/τ}: the average that forgets with a time constant.
/// @param time_constant  τ, s. @param period  T, s.
/// @errors ArgumentError::not_positive.
[[nodiscard]] Expected<DigitalFilter> exponential_average(Time time_constant, Time period);

/// y_k = a y_{k-1} + a (x_k - x_{k-1}) with a = e^{-T/τ}: what changes faster than τ, without what
/// stays. At half the sample rate its gain is 2a/(1 + a).
/// @param time_constant  τ, s. @param period  T, s.
/// @errors ArgumentError::not_positive.
[[nodiscard]] Expected<DigitalFilter> single_pole_high_pass(Time time_constant, Time period);

}  // namespace flyball::classical
