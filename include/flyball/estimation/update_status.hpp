#pragma once

namespace flyball {

/// How an update ended. Unless it is `updated`, the estimate has not changed.
enum class UpdateStatus {
  updated,  ///< The measurement is in the estimate.
  /// The measurement has a NaN, an infinity or what is beyond `largest_signal`, or would take the
  /// estimate beyond it; it was left out.
  not_finite,
  singular_innovation,  ///< C P Cᵀ + R is not positive definite; the measurement was left out.
  rejected,             ///< The measurement does not fit the estimate: an OutlierGuard refused it.
  /// R is not positive semidefinite or not finite; or it, H and the residual differ in size.
  invalid_noise,
};

}  // namespace flyball
