#pragma once

#include <flyball/core/error.hpp>

namespace flyball {

/// Why a search along a line has no answer.
enum class SearchError {
  no_sign_change,  ///< The function has the same sign at both ends of the bracket.
  not_finite,      ///< The function is not a number somewhere in the bracket.
  no_convergence,  ///< The evaluations reached their cap.
};
[[nodiscard]] ErrorInfo error_info(SearchError code);

/// How far a search along a line goes.
struct SearchOptions {
  double absolute_tolerance = 0.0;  ///< Of the place; give one where it may be zero.
  double relative_tolerance = 0.0;  ///< Of the place; what doubles can tell at least.
  int most_evaluations = 300;       ///< Of the function.
};

}  // namespace flyball
