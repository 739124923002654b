#pragma once

#include <complex>

#include <flyball/systems/system.hpp>

namespace flyball {

/// The highest frequency that samples of this period can hold, half the sample rate: π/T, rad/s.
/// (Section 7.1.2 once calls it twice the sample rate; 7.1.3 is right.)
/// @errors ArgumentError for a period that is not positive. Source: book, section 7.1.3.
[[nodiscard]] Expected<double> nyquist_frequency(Time period);

/// Where a frequency appears after sampling, min over N of |f - N f_s|: folded down across the
/// Nyquist frequency. @param frequency  rad/s. @return rad/s, within [0, π/T].
/// @errors ArgumentError for a period that is not positive and a frequency that is not finite.
/// Source: book, section 7.1.3 and its footnote, Figure 7.4.
[[nodiscard]] Expected<double> alias_frequency(double frequency, Time period);

/// The phase that a zero-order hold costs at a frequency, ωT/2 rad: that of its average sample
/// delay T/2. @param frequency  rad/s, not negative.
/// @errors ArgumentError as above. Source: book, sections 7.2.1 and E.6.
[[nodiscard]] Expected<double> sample_delay_phase_loss(double frequency, Time period);

/// z = e^{sT}: where a continuous pole lies once it is sampled.
/// @errors ArgumentError as above. Source: book, section 7.1, Table 7.1.
[[nodiscard]] Expected<std::complex<double>> discrete_pole(std::complex<double> s, Time period);

/// s = ln(z)/T, the slowest continuous pole that is sampled as z; its frequency is at most π/T, and
/// for z = 0 it is -∞. @errors ArgumentError as above. Source: book, section 7.1.
[[nodiscard]] Expected<std::complex<double>> continuous_pole(std::complex<double> z, Time period);

/// What sampling with a period does to a plant or a loop.
struct SamplingAnalysis {
  double nyquist_frequency = 0.0;   ///< π/T, rad/s.
  double fastest_frequency = 0.0;   ///< The largest imaginary part of a pole, rad/s.
  double fastest_rate = 0.0;        ///< The largest magnitude of a pole, rad/s.
  double samples_per_radian = 0.0;  ///< 1/(T fastest_rate); ∞ without dynamics.
  double sample_delay = 0.0;        ///< T/2, s: the average age of a held input.
  double phase_loss = 0.0;          ///< rad, at the crossover that was given.
  bool aliases = false;  ///< A pole oscillates at or above the Nyquist frequency: samples mistake
                         ///< it for a slower one.
  bool loses_controllability = false;  ///< Two poles of equal real part, apart by a multiple of
                                       ///< 2π/T, fall onto one sampled pole.
};

/// @param plant  Continuous. @param period  T, s.
/// @param crossover  rad/s: the loop's bandwidth, at which `phase_loss` is taken; zero if unknown.
/// @errors ArgumentError for the system, a period that is not positive, a negative crossover; those
///         of `poles`. Cost: O(n³), allocates.
/// Source: book, sections 7.1.2, 7.1.3, 7.2. Kalman, Ho and Narendra, "Controllability of linear
/// dynamical systems", Contributions to Differential Equations 1 (1963), for the last verdict.
[[nodiscard]] Expected<SamplingAnalysis> analyze_sampling(const ContinuousSystem<>& plant,
                                                          Time period, double crossover = 0.0);

}  // namespace flyball
