#pragma once

#include <complex>
#include <optional>

#include <flyball/core/argument.hpp>

#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/extended/double_double.hpp"

/// The steady state of a Kalman filter to more digits than a double has: where the outputs hardly
/// show a growing mode, P is large along it, and what its rounding does elsewhere is more than K
/// and P⁺ there.
namespace flyball::detail {

/// The problem as it was given, checked.
struct FilterProblem {
  Eigen::MatrixXd A, C, Q, R;
};

/// Powers of two: the states and the outputs in units of their deviations. Where those are far
/// apart, what is rounding in one is more than another.
struct FilterUnits {
  Eigen::VectorXi states;
  Eigen::VectorXi outputs;
};

/// What a measurement makes of the covariance P: K = P Cᵀ(C P Cᵀ + R)⁻¹, P⁺ = P - K C P.
struct FilterUpdate {
  DoubleDoubleMatrix K;
  DoubleDoubleMatrix P;
};

/// P and its update, in those units.
struct SteadyFilter {
  FilterUnits units;
  DoubleDoubleMatrix A, C, Q, R;
  DoubleDoubleMatrix P{};
  FilterUpdate update{};

  /// In the units that were given.
  [[nodiscard]] Eigen::MatrixXd gain(const DoubleDoubleMatrix& K) const {
    return times_powers(K.rounded(), units.states, -units.outputs, 0);
  }
  [[nodiscard]] Eigen::MatrixXd covariance(const DoubleDoubleMatrix& M) const {
    return times_powers(symmetrized(M.rounded()), units.states, units.states, 0);
  }
  [[nodiscard]] bool all_finite() const {
    return A.all_finite() && C.all_finite() && Q.all_finite() && R.all_finite() && P.all_finite();
  }
};

/// The filter at P; nothing where C P Cᵀ + R has no inverse.
[[nodiscard]] std::optional<SteadyFilter> filter_at(const FilterProblem& problem,
                                                    const Eigen::MatrixXd& P);

/// With the digits that P misses, by Newton's method with the residual in twice the precision.
[[nodiscard]] SteadyFilter corrected(SteadyFilter filter);

/// From a stable predictor gain L alone, where P's digits do not tell the stable solution: each
/// gain's covariance makes the next gain (Hewer's iteration). @param P  For the units.
[[nodiscard]] std::optional<SteadyFilter> iterated(const FilterProblem& problem,
                                                   const Eigen::MatrixXd& P,
                                                   const Eigen::MatrixXd& L);

/// What K and P, as they are answered, leave of P = SPSᵀ + LRLᵀ + Q with S = A - LC, L = AK, and of
/// K(CPCᵀ + R) = PCᵀ, beside the terms: in the units of the deviations, and in those given.
/// Infinite where P is no covariance.
[[nodiscard]] double residual_of(const SteadyFilter& filter);

/// The eigenvalues of A - LC with the K that is answered; in twice the working precision where
/// doubles do not tell that they are stable. Nothing where they are not.
[[nodiscard]] std::optional<Eigen::VectorXcd> poles_of(const SteadyFilter& filter);

}  // namespace flyball::detail
