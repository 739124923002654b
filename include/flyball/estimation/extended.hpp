#pragma once

#include <flyball/estimation/estimate.hpp>
#include <flyball/estimation/filter_model.hpp>

namespace flyball {

/// y ⊖ h, for vectors y - h.
struct Difference {
  template <class Y, class H>
  [[nodiscard]] auto operator()(const Y& y, const H& h) const {
    if constexpr (detail::EigenVector<Y>) {
      return (y - h).eval();
    } else {
      return minus(y, h);
    }
  }
};

/// y - h where the entries with these numbers are angles, which go the shorter way round.
template <int... Angles>
struct AngleDifference {
  template <class Y, class H>
  [[nodiscard]] auto operator()(const Y& y, const H& h) const {
    auto difference = (y - h).eval();
    using Scalar = typename decltype(difference)::Scalar;
    ((difference(Angles) = angle_difference(Scalar(difference(Angles)), Scalar(0.0))), ...);
    return difference;
  }
};

namespace detail {

/// x ⊕ (δ + ε) with the derivatives with respect to ε.
template <Manifold X>
[[nodiscard]] auto perturbed(const X& x, const TangentOf<X>& delta) noexcept {
  constexpr int N = tangent_size<X>;
  using T = ErrorDual<N>;
  const Eigen::Index n = delta.size();
  const Eigen::Index variables = N == Eigen::Dynamic ? n : N + N % 2;
  Eigen::Matrix<T, N, 1> moved(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    double start = delta(i);
    if constexpr (EigenVector<X>) {
      start += x(i);
    }
    moved(i) = T::variable(start, i, variables);
  }
  if constexpr (EigenVector<X>) {
    return moved;
  } else {
    return x.template cast<T>().plus(moved);
  }
}

/// The derivatives of y's entries, one row each.
template <class Duals, class Matrix>
void read_gradients(const Duals& y, Matrix& J) noexcept {
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    if (y(i).gradient.size() == 0) {
      J.row(i).setZero();
      continue;
    }
    for (Eigen::Index k = 0; k < J.cols(); ++k) {
      J(i, k) = y(i).gradient(k);
    }
  }
}

}  // namespace detail

/// The extended Kalman filter's steps, on any Estimate: functions over a generic scalar linearised
/// exactly (dual numbers) at the estimate.
/// Source: book, Theorem 9.8.1 and Table 9.3, with exact derivatives for the differences of its
/// scripts.
struct Extended {
  /// x_hat <- f(x_hat), P <- F P Fᵀ + Q.
  /// @param f  The state after the step, f(x), over a generic scalar: X of duals to X of duals. If
  ///           it has a member `linearize(x, next, F)`, which writes f(x) and its derivative with
  ///           respect to the error, that is taken.
  /// @param Q  The form's noise, or a function of F that answers it.
  /// @param transition  Takes F, if it is there: what smoothers need.
  /// @return   As Estimate::predict.
  template <class X, class Form, class F, class Noise>
  bool predict(Estimate<X, Form>& estimate, const F& f, const Noise& Q,
               TangentMatrix<X>* transition = nullptr) const noexcept {
    using Matrix = TangentMatrix<X>;
    const X& x = estimate.x_hat();
    X next = x;
    Matrix A;
    if constexpr (requires { f.linearize(x, next, A); }) {
      f.linearize(x, next, A);
    } else {
      const TangentOf<X> zero = TangentOf<X>::Zero(size_of_error(x));
      const auto moved = f(detail::perturbed(x, zero));
      A.resize(zero.size(), zero.size());
      if constexpr (detail::EigenVector<X>) {
        for (Eigen::Index i = 0; i < x.size(); ++i) {
          next(i) = moved(i).value;
        }
        detail::read_gradients(moved, A);
      } else {
        next = f(x);
        using T = detail::ErrorDual<tangent_size<X>>;
        detail::read_gradients(moved.minus(next.template cast<T>()), A);
      }
    }
    if (transition != nullptr) {
      *transition = A;
    }
    if constexpr (requires { Q(A); }) {
      return estimate.predict(next, A, Q(A));
    } else {
      return estimate.predict(next, A, Q);
    }
  }

  /// Corrects with y = h(x) ⊕ v, v ~ N(0, R).
  /// @param y  A vector, or another Manifold such as a pose. @param h  h(x), over a generic scalar.
  /// @param subtract  y ⊖ h: a Difference, an AngleDifference, or a function of both whose
  ///                  derivative by h is -I.
  template <class X, class Form, Manifold Y, class H, class Subtract = Difference>
  Correction<tangent_size<Y>> correct(Estimate<X, Form>& estimate, const Y& y, const H& h,
                                      const MeasurementNoise<tangent_size<Y>>& R,
                                      const CorrectionOptions& options = {},
                                      const Subtract& subtract = {}) const noexcept {
    constexpr int M = tangent_size<Y>;
    using Linearization = typename Estimate<X, Form>::template Linearization<M>;
    const X x = estimate.x_hat();
    return estimate.template correct_by<M>(
        [&](const TangentOf<X>& delta, Linearization& at) noexcept {
          if constexpr (requires { h.linearize(x, at.residual, at.H); }) {
            // h(x) and its derivative into `at`.
            const X there = plus(x, delta);
            h.linearize(there, at.residual, at.H);
            at.residual = subtract(y, Y(at.residual));
            return;
          } else {
            const auto expected = h(detail::perturbed(x, delta));
            if constexpr (detail::EigenVector<Y>) {
              at.H.resize(expected.size(), delta.size());
              Y value(expected.size());
              for (Eigen::Index i = 0; i < expected.size(); ++i) {
                value(i) = expected(i).value;
              }
              detail::read_gradients(expected, at.H);
              at.residual = subtract(y, value);
            } else {
              using T = detail::ErrorDual<tangent_size<X>>;
              const auto residual = subtract(y.template cast<T>(), expected);
              for (int i = 0; i < M; ++i) {
                at.residual(i) = residual(i).value;
              }
              detail::read_gradients(residual, at.H);
              at.H = -at.H;
            }
          }
        },
        R, options);
  }

 private:
  template <Manifold X>
  static Eigen::Index size_of_error(const X& x) noexcept {
    if constexpr (tangent_size<X> == Eigen::Dynamic) {
      return x.size();
    } else {
      return tangent_size<X>;
    }
  }
};

}  // namespace flyball
