#pragma once

#include <limits>

#include <flyball/core/expected.hpp>

namespace flyball::classical {

/// How fast a signal may change, in its unit each second; both positive, infinite for any.
struct SlewRates {
  double rising = std::numeric_limits<double>::infinity();
  double falling = std::numeric_limits<double>::infinity();
};

/// Follows a signal no faster than it may change.
///
/// Run-time object: no allocation, noexcept. A sample that is not finite holds the output.
class SlewRateLimiter {
 public:
  /// @param period  s, between two calls. @param initial  The output before the first.
  /// @errors ArgumentError::not_positive (a rate, the period), not_finite.
  [[nodiscard]] static Expected<SlewRateLimiter> create(const SlewRates& rates, double period,
                                                        double initial = 0.0);

  /// One sample.
  double calculate(double x) noexcept;

  /// The output is x from here on. What is not finite counts as zero.
  void reset(double x = 0.0) noexcept;

  [[nodiscard]] double output() const noexcept { return output_; }  ///< Of the last call.

 private:
  SlewRateLimiter() = default;

  double up_ = 0.0;    ///< A period's.
  double down_ = 0.0;  ///< Positive.
  double output_ = 0.0;
};

}  // namespace flyball::classical
