#pragma once

#include <algorithm>
#include <limits>

#include <flyball/estimation/estimate.hpp>
#include <flyball/math/probability/truncated_normal.hpp>

/// What is known of a state without measuring it: an elevator is between its stops, a mass is not
/// negative, a robot is inside the field.
namespace flyball {

/// An estimate cut off where c(x) leaves lower ≤ c ≤ upper: the Gaussian that has the mean and the
/// covariance of N(x_hat, P) given the limits. With c(x_hat ⊕ e) = c + aᵀ e, σ² = aᵀ P a and the
/// moments m, s² of the cut N(c, σ²):
///
///     x_hat <- x_hat ⊕ P a (m - c)/σ²,   P <- P - P a aᵀ P (1 - s²/σ²)/σ²,
///
/// which is the correction with a measurement of c whose noise is s² σ²/(σ² - s²), and is done as
/// one, in whatever form P is carried. What is far inside does not change; what is outside comes
/// in. Of several limits one after the other is exact where they are of independent functions, else
/// an approximation that depends on their order.
///
/// A limit is knowledge at one instant. Taken again in each step, where nothing else tells of the
/// state, it says again what it has said: P then is too small.
///
/// @param value  c(x_hat). @param row  a, n x 1. @param lower, upper  Either may be infinite.
/// @return  Whether x_hat is within the limits. Not, with the estimate unchanged: for lower >
/// upper,
///          what is no number, and a c that is known without error to be outside.
/// Run-time: noexcept, bounded, allocation-free for fixed sizes.
/// Source: Simon, Simon, "Constrained Kalman filtering via density function truncation for turbofan
/// engine health estimation", Int. J. Systems Science 41 (2010).
template <class X, class Form>
bool truncate(Estimate<X, Form>& estimate, double value, const TangentOf<X>& row, double lower,
              double upper) noexcept {
  if (!is_signal(value) || !is_signal(row) || !(lower <= upper)) {
    return false;
  }
  const double variance = row.dot(estimate.P().lazyProduct(row));
  const bool inside = value >= lower && value <= upper;
  if (!(variance > 0.0)) {
    return inside;
  }
  const Moments cut = truncated_normal(value, variance, lower, upper);
  constexpr double rounding = 1e-14;
  const double less = variance - cut.variance;
  if (!(less > rounding * variance)) {
    return inside;
  }
  using Scalar = Eigen::Matrix<double, 1, 1>;
  const Scalar innovation((cut.mean - value) * (variance / less));
  const Scalar noise(variance * (cut.variance / less));
  return estimate.template correct<1>(innovation, row.transpose(), MeasurementNoise<1>(noise))
      .accepted();
}

/// The nearest estimate within lower ≤ c ≤ upper, as P measures distances: of all x it is the
/// likeliest. x_hat <- x_hat ⊕ P a (bound - c)/σ²; P stays, which is cautious.
/// @param value, row, lower, upper  As `truncate`. @return As there.
/// Source: Simon, "Kalman filtering with state constraints", IET Control Theory 4 (2010), 2.3.
template <class X, class Form>
bool project(Estimate<X, Form>& estimate, double value, const TangentOf<X>& row, double lower,
             double upper) noexcept {
  if (!is_signal(value) || !is_signal(row) || !(lower <= upper)) {
    return false;
  }
  const double bound = std::clamp(value, lower, upper);
  if (bound == value) {
    return true;
  }
  const TangentOf<X> toward = estimate.P().lazyProduct(row);
  const double variance = row.dot(toward);
  return variance > 0.0 &&
         estimate.reset(
             plus(estimate.x_hat(), TangentOf<X>(toward * ((bound - value) / variance))));
}

/// `truncate` of one entry of a vector. @param i  Which.
template <class X, class Form>
bool limit_state(Estimate<X, Form>& estimate, Eigen::Index i, double lower, double upper) noexcept
  requires detail::EigenVector<X>
{
  const X& x = estimate.x_hat();
  X row = X::Zero(x.size());
  if (!(i >= 0 && i < x.size())) {
    return false;
  }
  row(i) = 1.0;
  return truncate(estimate, double(x(i)), row, lower, upper);
}

}  // namespace flyball
