#pragma once

namespace flyball {

/// How an update ended. Unless it is `updated`, the estimate has not changed.
enum class UpdateStatus {
  updated,  ///< The measurement is in the estimate.
  /// The measurement has a NaN, an infinity or what is beyond `largest_signal`, or would take the
  /// estimate beyond it; it was left out.
  not_finite,
  /// C P Cᵀ + R is not positive definite, or beyond 1e200; the measurement was left out.
  singular_innovation,
  rejected,  ///< The measurement does not fit the estimate: an OutlierGuard refused it.
  /// R is not positive semidefinite or not finite; or it, H and the residual differ in size.
  invalid_noise,
};

}  // namespace flyball
