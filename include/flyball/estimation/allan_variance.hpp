#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <flyball/core/expected.hpp>

/// What a sensor at rest says of its own noise.
namespace flyball {

/// The Allan deviation of averages over one time.
struct AllanPoint {
  double tau = 0.0;        ///< s, what is averaged over.
  double deviation = 0.0;  ///< σ(τ), in the reading's unit.
  /// Of the deviation, from the number of independent averages: (2 (T/τ - 1))^(-1/2).
  double relative_error = 0.0;
};

/// The overlapping Allan deviation of readings at equal distances, at times of averaging that grow
/// by a constant factor until a ninth of the record, where it errs by a quarter:
///
///     σ²(mT) = Σ (θ_{k+2m} - 2 θ_{k+m} + θ_k)² / (2 (mT)² (N + 1 - 2m)),  θ_k = T Σ_{i<k} y_i.
///
/// @param readings  N at least 18, of a sensor at rest, such as a gyroscope's rates. Finite.
/// @param period  s, between two of them. @param per_decade  How many times of averaging, about.
/// @errors ArgumentError::out_of_range for too few readings and options, not_finite, not_positive.
/// Cost: O(N) a point, allocates. Source: IEEE Std 952-1997, annex C; Riley, "Handbook of Frequency
/// Stability Analysis", NIST Special Publication 1065 (2008), 5.2.5.
[[nodiscard]] Expected<std::vector<AllanPoint>> allan_deviation(std::span<const double> readings,
                                                                double period, int per_decade = 10);

/// The noises that an Allan deviation shows, with y the reading's unit. Zero: not seen.
struct SensorNoise {
  /// N, y √s: white noise of the readings, a gyroscope's angle random walk. A reading that averages
  /// over T has the standard deviation N/√T; N² is its MeasurementDensity.
  double random_walk = 0.0;
  double bias_instability = 0.0;  ///< B, y: flicker, the floor of σ over 0.664.
  /// K, y/√s: the bias's own random walk; K² is its ProcessDensity.
  double bias_random_walk = 0.0;
  double quantization = 0.0;  ///< Q, y s: of the integral.
};

/// The noises by least squares of the variances in units of their errors, none negative:
///
///     σ²(τ) = 3 Q²/τ² + N²/τ + (2 ln 2/π) B² + K² τ/3.
///
/// @param points  As `allan_deviation` gives them; four at least.
/// @errors ArgumentError::out_of_range for too few points and entries.
/// Source: IEEE Std 952-1997, annex C.
[[nodiscard]] Expected<SensorNoise> fit_allan_deviation(std::span<const AllanPoint> points);

}  // namespace flyball
