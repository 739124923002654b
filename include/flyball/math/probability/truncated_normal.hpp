#pragma once

#include <flyball/math/probability/moments.hpp>

namespace flyball {

/// Of a normal distribution that is cut off at two limits, N(mean, variance) given lower ≤ x ≤
/// upper: E[x] and Var[x], to a relative 1e-12 also where the limits are a thousand deviations away
/// or hardly apart, since every sum is of positive terms.
/// @param variance  Positive. @param lower, upper  lower ≤ upper; either may be infinite.
/// @return  NaN for other arguments. Cost: at most 80 exponentials; does not allocate.
/// Source: Johnson, Kotz, Balakrishnan, "Continuous Univariate Distributions 1" (1994), 13.10; the
/// integrals by Gauss's rule of 20 points, whose closed forms cancel.
[[nodiscard]] Moments truncated_normal(double mean, double variance, double lower,
                                       double upper) noexcept;

}  // namespace flyball
