#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <flyball/estimation/forms/square_root_covariance.hpp>
#include <flyball/estimation/model_filter.hpp>
#include <flyball/estimation/sigma_points.hpp>

namespace flyball {

/// The unscented Kalman filter's steps, on any Estimate: functions of the state asked at points
/// around it, without derivatives, so they need not be smooth, nor written over a generic scalar.
///
/// The straight line that fits a function's values best takes the place of the extended filter's
/// tangent, and what it leaves counts as noise; the rest (gates, weights, missing entries, the
/// forms of P) is the same. A SquareRootCovariance is carried by QR decompositions alone, and by a
/// rank-one downdate only where the points' c is negative; one that would make P indefinite is left
/// out, which leaves P too large rather than wrong, and counted.
///
/// Source: book, section 9.9; van der Merwe and Wan, "The square-root unscented Kalman filter for
/// state and parameter-estimation", ICASSP (2001); Lefebvre, Bruyninckx, De Schutter, "Comment on
/// 'A new method for the nonlinear transformation of means and covariances'", IEEE Trans. Automatic
/// Control 47 (2002), for the straight line; Hertzberg et al. (2013) for manifolds.
template <class Points = ScaledPoints>
class Unscented {
 public:
  /// @param points  Their settings.
  Unscented(const Points& points = {}) noexcept : points_(points) {}  // NOLINT: settings are it.

  /// How often a negative c had to be left out.
  [[nodiscard]] long downdates_left_out() const noexcept { return left_out_; }

  /// As Extended::predict. @param f  f(x), X to X.
  template <class X, class Form, class F, class Noise>
  bool predict(Estimate<X, Form>& estimate, const F& f, const Noise& Q,
               TangentMatrix<X>* transition = nullptr) noexcept {
    constexpr int N = tangent_size<X>;
    const X& x = estimate.x_hat();
    const TangentMatrix<X> S = estimate.form().factor();
    const Eigen::Index n = S.rows();
    const X centre = f(x);
    Eigen::Matrix<double, N, outer<N>> E(n, Points::outer(static_cast<int>(n)));
    TangentOf<X> m;
    Eigen::Matrix<double, N, columns<N>> Z(n, n + Points::rest(static_cast<int>(n)));
    double c = 0.0;
    X next = centre;
    if constexpr (detail::EigenVector<X>) {
      for (Eigen::Index i = 0; i < E.cols(); ++i) {
        E.col(i) = f(X(x + points_.place(S, i))) - centre;
      }
      c = points_.regress(E, m, Z);
      next += m;
    } else {
      c = mean_of(estimate, f, S, centre, E, m, Z, next);
    }
    TangentMatrix<X> A;
    if constexpr (requires { Q(A); }) {
      A = divided_by(Z.leftCols(n), S);
      if (transition != nullptr) {
        *transition = A;
      }
      return assign(estimate, next, Z, m, c, Q(A));
    } else {
      if (transition != nullptr) {
        *transition = divided_by(Z.leftCols(n), S);
      }
      return assign(estimate, next, Z, m, c, Q);
    }
  }

  /// As Extended::correct, with h as it is called for X. Iterated, the points stand around what is
  /// known after the measurement, and the prediction is corrected anew with the line found there.
  /// Source: García-Fernández, Svensson, Morelande, Särkkä, "Posterior linearization filter:
  /// principles and implementation using sigma points", IEEE Trans. Signal Processing 63 (2015).
  template <class X, class Form, Manifold Y, class H, class Subtract = Difference>
  Correction<tangent_size<Y>> correct(Estimate<X, Form>& estimate, const Y& y, const H& h,
                                      const MeasurementNoise<tangent_size<Y>>& R,
                                      const CorrectionOptions& options = {},
                                      const Subtract& subtract = {}) noexcept {
    constexpr int M = tangent_size<Y>;
    const X& x = estimate.x_hat();
    TangentOf<X> point = minus(x, x);
    auto line = line_of<M>(x, point, estimate.form().factor(), y, h, R, subtract);
    for (int k = 1; k < options.iterations; ++k) {
      Estimate<X, Form> trial = estimate;
      CorrectionOptions once = options;
      std::optional<OutlierGuard> guard;
      if (options.guard != nullptr) {
        once.guard = &guard.emplace(*options.guard);
      }
      if (!trial.template correct<M>(line.residual, line.slope, line.noise, once).accepted()) {
        break;
      }
      const TangentOf<X> moved = minus(trial.x_hat(), x);
      const bool settled = (moved - point).cwiseAbs().sum() <= 1e-6 * moved.cwiseAbs().sum();
      point = moved;
      line = line_of<M>(x, point, trial.form().factor(), y, h, R, subtract);
      if (settled) {
        break;
      }
    }
    return estimate.template correct<M>(line.residual, line.slope, line.noise, options);
  }

 private:
  template <int N>
  static constexpr int outer = N == Eigen::Dynamic ? N : Points::outer(N);
  template <int N>
  static constexpr int columns = N == Eigen::Dynamic ? N : N + Points::rest(N);

  /// The straight line that fits h best around x ⊕ δ, as a measurement of an error of x.
  template <int M, int N>
  struct Line {
    Eigen::Matrix<double, M, 1> residual;
    Eigen::Matrix<double, M, N> slope;
    MeasurementNoise<M> noise;
  };
  template <int M, class X, class Y, class H, class Subtract>
  Line<M, tangent_size<X>> line_of(const X& x, const TangentOf<X>& delta, const TangentMatrix<X>& S,
                                   const Y& y, const H& h, const MeasurementNoise<M>& R,
                                   const Subtract& subtract) noexcept {
    constexpr int N = tangent_size<X>;
    const Eigen::Index n = S.rows();
    const Y centre = h(plus(x, delta));
    Eigen::Matrix<double, M, outer<N>> E(R.size(), Points::outer(static_cast<int>(n)));
    for (Eigen::Index i = 0; i < E.cols(); ++i) {
      E.col(i) = subtract(Y(h(plus(x, TangentOf<X>(delta + points_.place(S, i))))), centre);
    }
    Eigen::Matrix<double, M, 1> m(R.size());
    Eigen::Matrix<double, M, columns<N>> Z(R.size(), n + Points::rest(static_cast<int>(n)));
    const double c = points_.regress(E, m, Z);
    const Eigen::Matrix<double, M, N> slope = divided_by(Z.leftCols(n), S);
    Eigen::Matrix<double, M, M> total = R.R();
    const Eigen::Index count = Z.cols();
    for (Eigen::Index k = n; k < count; ++k) {
      total += Z.col(k) * Z.col(k).transpose();
    }
    const Eigen::Matrix<double, M, M> of_centre = c * m * m.transpose();
    MeasurementNoise<M> noise(Eigen::Matrix<double, M, M>(total + of_centre));
    if (R.usable() && !noise.usable() && c < 0.0) {
      ++left_out_;
      noise = MeasurementNoise<M>(total);
    }
    const Eigen::Matrix<double, M, 1> residual =
        subtract(y, plus(centre, m)) + slope.lazyProduct(delta);
    return {residual, slope, noise};
  }

  /// H of H S = B; zero along what S does not span.
  template <class Slope, class Matrix>
  static auto divided_by(const Slope& B, const Matrix& S) noexcept {
    Eigen::Matrix<double, Slope::RowsAtCompileTime, Matrix::ColsAtCompileTime> H = B;
    for (Eigen::Index j = S.cols(); j-- > 0;) {
      for (Eigen::Index k = j + 1; k < S.cols(); ++k) {
        H.col(j) -= H.col(k) * S(k, j);
      }
      H.col(j) *= S(j, j) > 0.0 ? 1.0 / S(j, j) : 0.0;
    }
    return H;
  }

  /// The mean on a manifold, where the weighted differences of the values vanish, from the centre's
  /// value in a few steps; E, m and Z are those in its frame.
  template <class Est, class F, class X, class Values, class Mean, class Columns>
  double mean_of(const Est& estimate, const F& f, const TangentMatrix<X>& S, const X& centre,
                 Values& E, Mean& m, Columns& Z, X& next) const noexcept {
    std::array<X, static_cast<std::size_t>(outer<tangent_size<X>>)> values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] =
          f(plus(estimate.x_hat(), TangentOf<X>(points_.place(S, static_cast<Eigen::Index>(i)))));
    }
    double c = 0.0;
    constexpr int cap = 20;
    for (int k = 0; k < cap; ++k) {
      const TangentOf<X> from_centre = minus(centre, next);
      for (std::size_t i = 0; i < values.size(); ++i) {
        E.col(static_cast<Eigen::Index>(i)) = minus(values[i], next) - from_centre;
      }
      c = points_.regress(E, m, Z);
      const TangentOf<X> step = from_centre + m;
      if (step.cwiseAbs().sum() <= 1e-12 * E.cwiseAbs().sum()) {
        break;
      }
      next = plus(next, step);
    }
    return c;
  }

  template <class X, class Form, class Columns>
  bool assign(Estimate<X, Form>& estimate, const X& next, const Columns& Z, const TangentOf<X>& m,
              double c, const typename Form::Noise& Q) noexcept {
    constexpr int count = Columns::ColsAtCompileTime;
    constexpr int rows = Columns::RowsAtCompileTime;
    Eigen::Matrix<double, rows, count == Eigen::Dynamic ? count : count + 1> all(Z.rows(),
                                                                                 Z.cols() + 1);
    all.leftCols(Z.cols()) = Z;
    all.col(Z.cols()) = m * std::sqrt(std::max(c, 0.0));
    if (c >= 0.0 || m.isZero(0.0)) {
      return estimate.assign(next, all, Q);
    }
    Eigen::Matrix<double, count == Eigen::Dynamic ? count : count + 1, rows> rows_of_factor =
        all.transpose();
    TangentMatrix<X> S;
    triangular_factor(rows_of_factor, S);
    if (!cholesky_downdate(S, TangentOf<X>(m * std::sqrt(-c)))) {
      ++left_out_;
    }
    return estimate.assign(next, S, Q);
  }

  Points points_;
  long left_out_ = 0;
};

/// The unscented Kalman filter, of the whole covariance.
template <class M, class Points = ScaledPoints>
using UnscentedKalmanFilter =
    ModelFilter<M, JosephCovariance<FilterModel<M>::states>, Unscented<Points>>;

/// The unscented Kalman filter of the covariance's factor (section 9.9).
template <class M, class Points = ScaledPoints>
using SquareRootUnscentedKalmanFilter =
    ModelFilter<M, SquareRootCovariance<FilterModel<M>::states>, Unscented<Points>>;

}  // namespace flyball
