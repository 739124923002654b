#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/core/function_ref.hpp>
#include <flyball/math/search/search_error.hpp>

namespace flyball {

/// Where a function changes its sign.
struct Root {
  double x = 0.0;
  double residual = 0.0;  ///< f(x).
  double low = 0.0;       ///< The signs at `low` and `high` differ, unless the residual is zero.
  double high = 0.0;
  int evaluations = 0;
};

/// A root of a function between two places where its signs differ.
///
/// Inverse quadratic interpolation where it can be trusted, a halving otherwise, and always one
/// where three evaluations did not halve the bracket, so that a bracket of b bits takes at most
/// 3 b + 3 evaluations. A pole with a change of sign is answered too: its residual is large.
/// Infinite values count by their sign.
///
/// @param f  Any function; continuous if the answer is to be a root. @param a, b  In any order.
/// @param options  The bracket ends no longer than absolute + relative |x|.
/// @return  The end of the last bracket with the smaller |f|.
/// @errors ArgumentError::not_finite for ends, out_of_range for options;
///         SearchError::no_sign_change, not_finite, no_convergence, with the bracket.
/// Cost: about ten evaluations of a smooth function; does not allocate unless it fails.
/// Source: Chandrupatla, "A new hybrid quadratic/bisection algorithm for finding the zero of a
/// nonlinear function", Advances in Engineering Software 28 (1997).
[[nodiscard]] Expected<Root> find_root(FunctionRef<double(double)> f, double a, double b,
                                       const SearchOptions& options = {});
/// The same where the values at the ends are known. @param f_a, f_b  f(a), f(b).
[[nodiscard]] Expected<Root> find_root(FunctionRef<double(double)> f, double a, double b,
                                       double f_a, double f_b, const SearchOptions& options = {});

}  // namespace flyball
