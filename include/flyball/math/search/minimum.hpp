#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/core/function_ref.hpp>
#include <flyball/math/search/search_error.hpp>

namespace flyball {

/// Where a function is smallest.
struct Minimum {
  double x = 0.0;
  double value = 0.0;  ///< f(x).
  double low = 0.0;    ///< The place lies between `low` and `high` if there is one minimum only.
  double high = 0.0;
  int evaluations = 0;
};

/// The minimum of a function on an interval; of several any, the ends included.
///
/// Parabolas where they are steep enough, golden sections otherwise (Brent). The value is exact to
/// rounding; the place of a smooth minimum only to the root of it, 1e-8 of its size, because the
/// function does not tell more, that of a kink to the tolerance.
///
/// @param f  Any function. Infinite values are values. @param low, high  low < high.
/// @param options  Of the place; its relative tolerance is at least 1e-12.
/// @errors ArgumentError::not_finite for the ends, out_of_range for an empty interval and options;
///         SearchError::not_finite, no_convergence.
/// Cost: about 40 evaluations; does not allocate unless it fails.
/// Source: Brent, "Algorithms for Minimization without Derivatives" (1973), chapter 5.
[[nodiscard]] Expected<Minimum> find_minimum(FunctionRef<double(double)> f, double low, double high,
                                             const SearchOptions& options = {});

}  // namespace flyball
