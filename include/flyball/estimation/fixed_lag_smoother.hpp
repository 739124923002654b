#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>

#include <flyball/core/signal.hpp>
#include <flyball/estimation/estimate.hpp>
#include <flyball/estimation/semidefinite_solve.hpp>
#include <flyball/estimation/smoother.hpp>
#include <flyball/geometry/lie_group.hpp>

namespace flyball {

/// What was the state some steps ago, by all measurements since: the Rauch-Tung-Striebel smoother
/// over the last `Lag` steps of a filter, linear or extended.
///
/// ```
/// filter.predict(u);
/// const auto x_prior = filter.x_hat();
/// filter.update(y, u);
/// smoother.take({plant.A, Q, x_prior, filter.x_hat(), filter.P()});
/// const auto [x, P] = smoother.at(10);  // ten periods ago
/// ```
///
/// The state is a vector or any other Manifold, such as a pose (FixedLagSmoother is that of
/// vectors); a covariance is then in the frame of its estimate, as an `Estimate` has it.
///
/// Each step stores the gain back over it, so that `at` only has to go back by Theorem 9.7.1.
/// Run-time object: noexcept, finite whatever comes, of fixed capacity, and for states known at
/// compile time allocation-free; a step that comes when all places are taken replaces the oldest.
/// `smooth` gives the same for a whole record.
/// Source: book, Theorem 9.7.1; Simon, "Optimal State Estimation" (2006), section 9.3.
template <Manifold X, int Lag>
class ManifoldFixedLagSmoother {
  static_assert(Lag > 0, "a lag of no steps is the filter itself");

 public:
  using StateVector = X;
  using StateMatrix = TangentMatrix<X>;

  /// An estimate of one instant.
  struct Estimate {
    StateVector x;
    StateMatrix P;
  };

  /// @param x0, P0  The filter's estimate before the first step; what `reset` would not take counts
  /// as zero.
  ManifoldFixedLagSmoother(const StateVector& x0, const StateMatrix& P0) : newest_{x0, P0} {
    if (!reset(x0, P0)) {
      if constexpr (detail::EigenVector<X>) {
        newest_.x.setZero();
      } else {
        newest_.x = X();
      }
      newest_.P.setZero();
    }
  }

  /// Takes a step of the filter. @return  Whether it was taken: one with a number that is not
  /// finite, or whose variances are beyond the square of `largest_signal`, is not, and `at` stays
  /// what it was. Cost: O(n³).
  bool take(const FilterStepOf<X>& step) noexcept;

  /// How many steps `at` can go back: those taken, Lag at most.
  [[nodiscard]] int available() const noexcept { return available_; }

  /// The estimate `lag` steps before the newest one; 0 is the filter's own. A lag outside
  /// [0, available] counts as the nearest of these. Cost: O(lag n³).
  [[nodiscard]] Estimate at(int lag) const noexcept;

  /// Starts again. @return  Whether it did: not with a number that is not finite, or beyond what
  /// `take` takes, and nothing changes.
  bool reset(const StateVector& x0, const StateMatrix& P0) noexcept {
    if (!detail::is_usable(x0, x0) || !is_covariance(P0)) {
      return false;
    }
    newest_ = {x0, P0};
    available_ = 0;
    return true;
  }

 private:
  [[nodiscard]] static bool is_covariance(const StateMatrix& P) noexcept {
    return (P.array().abs() <= largest_signal * largest_signal).all();
  }

  /// P <- J P Jᵀ
  static void transport(const StateMatrix& J, StateMatrix& P) noexcept {
    const StateMatrix half = J * P;
    P.noalias() = half * J.transpose();
  }

  /// The estimate before a step given the one after it: N(x ⊕ K(x_after ⊖ x_prior), P).
  struct Back {
    StateVector x;
    StateVector x_prior;
    StateMatrix K;
    StateMatrix P;
  };

  Estimate newest_;
  std::array<Back, static_cast<std::size_t>(Lag)> steps_{};
  std::size_t next_ = 0;
  int available_ = 0;
};

/// The smoother of vectors.
template <int States, int Lag>
using FixedLagSmoother = ManifoldFixedLagSmoother<Eigen::Matrix<double, States, 1>, Lag>;

template <Manifold X, int Lag>
bool ManifoldFixedLagSmoother<X, Lag>::take(const FilterStepOf<X>& step) noexcept {
  const StateMatrix& P = newest_.P;
  StateMatrix FP = P;
  FP.noalias() = step.F * P;
  StateMatrix P_prior = step.Q;
  P_prior.noalias() += FP * step.F.transpose();
  StateMatrix solved = FP;
  detail::ldl_factorize(P_prior);
  detail::ldl_solve(P_prior, solved);
  Back& back = steps_[next_];
  StateMatrix rest = P;  // (I - K F) P (I - K F)ᵀ + K Q Kᵀ
  StateMatrix left = StateMatrix::Identity(P.rows(), P.cols());
  left.noalias() -= solved.transpose() * step.F;
  StateMatrix half = P;
  half.noalias() = left * P;
  rest.noalias() = half * left.transpose();
  half.noalias() = solved.transpose() * step.Q;
  rest.noalias() += half * solved;
  const bool usable = is_signal(step.F) && detail::is_usable(step.x, newest_.x) &&
                      detail::is_usable(step.x_prior, newest_.x) && is_signal(solved) &&
                      is_covariance(step.Q) && is_covariance(rest) && is_covariance(step.P);
  if (!usable) {
    return false;
  }
  back.x = newest_.x;
  back.x_prior = step.x_prior;
  back.K = solved.transpose();
  back.P = rest;
  newest_.x = step.x;
  newest_.P = step.P;
  next_ = (next_ + 1) % steps_.size();
  available_ += available_ < Lag ? 1 : 0;
  return true;
}

template <Manifold X, int Lag>
auto ManifoldFixedLagSmoother<X, Lag>::at(int lag) const noexcept -> Estimate {
  lag = lag < 0 ? 0 : lag > available_ ? available_ : lag;
  Estimate estimate = newest_;
  TangentOf<X> difference = minus(newest_.x, newest_.x);
  StateMatrix half = newest_.P;
  std::size_t place = next_;
  for (int i = 0; i < lag; ++i) {
    place = (place == 0 ? steps_.size() : place) - 1;
    const Back& back = steps_[place];
    difference = minus(estimate.x, back.x_prior);
    if constexpr (!detail::EigenVector<X>) {
      transport(right_jacobian_inverse<X>(difference), estimate.P);  // into the frame of x⁻
      difference = back.K * difference;
      estimate.x = plus(back.x, difference);  // (9.42)
    } else {
      estimate.x = back.x;
      estimate.x.noalias() += back.K * difference;  // (9.42)
    }
    half.noalias() = back.K * estimate.P;
    estimate.P = back.P;
    estimate.P.noalias() += half * back.K.transpose();  // (9.43)
    if constexpr (!detail::EigenVector<X>) {
      transport(right_jacobian<X>(difference), estimate.P);  // into that of the smoothed x
    }
    half = estimate.P.transpose();
    estimate.P = 0.5 * (estimate.P + half);
  }
  return estimate;
}

}  // namespace flyball
