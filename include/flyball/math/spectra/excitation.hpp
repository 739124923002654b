#pragma once

#include <cstdint>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>

/// Signals that excite a system so that it can be identified. Amplitudes are the largest value, in
/// the input's unit; frequencies rad/s.
namespace flyball {

/// How a chirp's frequency goes from one end to the other.
enum class ChirpShape { linear, logarithmic };

/// A sine whose frequency sweeps from `first` to `last` over all samples.
/// @param samples  From 2. @errors ArgumentError for what is not positive, or above half the sample
/// rate.
[[nodiscard]] Expected<Eigen::VectorXd> chirp(Eigen::Index samples, Time period, double first,
                                              double last, double amplitude = 1.0,
                                              ChirpShape shape = ChirpShape::logarithmic);

/// Sines one after the other, each for as many whole turns as told, as section E.7 measures them.
struct SteppedSine {
  Eigen::VectorXd u;
  /// One of the sines.
  struct Step {
    double frequency = 0.0;  ///< rad/s.
    Eigen::Index first = 0;  ///< First sample.
    Eigen::Index samples = 0;
  };
  std::vector<Step> steps;
};
/// @param frequencies  rad/s, each below half the sample rate. @param turns  Of each, from 2.
/// @errors ArgumentError as above.
[[nodiscard]] Expected<SteppedSine> stepped_sine(const Eigen::VectorXd& frequencies, Time period,
                                                 int turns, double amplitude = 1.0);

/// One period of a sum of sines of equal amplitude at harmonics first, first + step, … last of
/// 1/(samples T), with the phases that keep its crest factor (peak over RMS) low.
struct Multisine {
  Eigen::VectorXd u;
  double crest_factor = 0.0;
};
/// Which multiples of 1/(samples T) a multisine has.
struct Harmonics {
  Eigen::Index first = 1;
  Eigen::Index last = 1;
  Eigen::Index step = 1;
};
/// A multisine whose phases keep its crest factor low.
/// @param harmonics  {first, last, step}: within [1, samples/2). @param seed  Of the first phases;
/// further ones are tried and the best is kept.
/// @errors ArgumentError::out_of_range, not_positive.
/// Cost: O(iterations N log N), N the samples or 32 for each turn of the last harmonic, if that is
/// less; 600 iterations, fewer above 56 000 of N; then one transform of all samples.
/// Source: Van der Ouderaa, Schoukens and Renneboog, IEEE Trans. Instrumentation 37 (1988)
/// (clipping); Schroeder, IEEE Trans. Information Theory 16 (1970) (the start).
[[nodiscard]] Expected<Multisine> multisine(Eigen::Index samples, const Harmonics& harmonics,
                                            double amplitude = 1.0, std::uint64_t seed = 1);

/// A maximum-length pseudo-random binary sequence of 2^bits - 1 values ±amplitude, each held for
/// `hold` samples: its spectrum is flat up to 1/(3 hold T) Hz.
/// @param bits  From 2 to 24. @param seed  Where in the sequence it begins.
/// @errors ArgumentError::out_of_range, not_positive.
/// Source: Zierler, J. SIAM 7 (1959); feedback taps: primitive polynomials over GF(2).
[[nodiscard]] Expected<Eigen::VectorXd> prbs(int bits, Eigen::Index hold = 1,
                                             double amplitude = 1.0, std::uint64_t seed = 1);

/// Peak over root mean square. @param u  Not empty, not zero. @errors ArgumentError::empty,
/// malformed.
[[nodiscard]] Expected<double> crest_factor(const Eigen::VectorXd& u);

}  // namespace flyball
