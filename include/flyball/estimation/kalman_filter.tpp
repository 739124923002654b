#pragma once

#include <cmath>
#include <utility>

#include <flyball/estimation/kalman_filter.hpp>

namespace flyball {

namespace detail {

/// What KalmanFilter::create asks of its arguments.
[[nodiscard]] Expected<void> check_kalman_filter(const MatrixRef& A, const MatrixRef& B,
                                                 const MatrixRef& C, const MatrixRef& D,
                                                 Time period, const Covariance& Q,
                                                 const Covariance& R, const Covariance& P0);

/// S = L Lᵀ in the lower triangle; false if S is not positive definite to within rounding.
template <class Matrix>
[[nodiscard]] bool cholesky(Matrix& S) noexcept {
  for (Eigen::Index j = 0; j < S.rows(); ++j) {
    double pivot = S(j, j);
    const double size = pivot;
    for (Eigen::Index k = 0; k < j; ++k) {
      pivot -= S(j, k) * S(j, k);
    }
    if (!(pivot > 1e-14 * size) || !std::isfinite(pivot)) {
      return false;
    }
    S(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < S.rows(); ++i) {
      double entry = S(i, j);
      for (Eigen::Index k = 0; k < j; ++k) {
        entry -= S(i, k) * S(j, k);
      }
      S(i, j) = entry / S(j, j);
    }
  }
  return true;
}

/// X <- X (L Lᵀ)⁻¹, row by row.
template <class Factor, class Matrix>
void solve_right(const Factor& L, Matrix& X) noexcept {
  const Eigen::Index p = L.rows();
  for (Eigen::Index row = 0; row < X.rows(); ++row) {
    for (Eigen::Index i = 0; i < p; ++i) {
      for (Eigen::Index k = 0; k < i; ++k) {
        X(row, i) -= L(i, k) * X(row, k);
      }
      X(row, i) /= L(i, i);
    }
    for (Eigen::Index i = p; i-- > 0;) {
      for (Eigen::Index k = i + 1; k < p; ++k) {
        X(row, i) -= L(k, i) * X(row, k);
      }
      X(row, i) /= L(i, i);
    }
  }
}

}  // namespace detail

template <int States, int Inputs, int Outputs>
KalmanFilter<States, Inputs, Outputs>::KalmanFilter(const Plant& plant, StateMatrix Q,
                                                    OutputMatrix R, StateMatrix P)
    : plant_(plant),
      Q_(std::move(Q)),
      R_(std::move(R)),
      x_hat_(StateVector::Zero(plant.A.rows())),
      P_(std::move(P)) {}

template <int States, int Inputs, int Outputs>
auto KalmanFilter<States, Inputs, Outputs>::create(const Plant& plant, const Covariance& Q,
                                                   const Covariance& R, const Covariance& P0)
    -> Expected<KalmanFilter> {
  if (auto checked =
          detail::check_kalman_filter(plant.A, plant.B, plant.C, plant.D, plant.period, Q, R, P0);
      !checked) {
    return tl::unexpected(checked.error());
  }
  return KalmanFilter(plant, *Q.get(), *R.get(), *P0.get());
}

template <int States, int Inputs, int Outputs>
auto KalmanFilter<States, Inputs, Outputs>::steady_state(const Plant& plant, const Covariance& Q,
                                                         const Covariance& R)
    -> Expected<KalmanFilter> {
  auto gain = kalman_gain(plant.A, plant.C, Q, R);
  if (!gain) {
    return tl::unexpected(gain.error());
  }
  // The next call is a prediction, which takes the posterior covariance to the prior one.
  return create(plant, Q, R, gain->P_posterior);
}

template <int States, int Inputs, int Outputs>
void KalmanFilter<States, Inputs, Outputs>::predict(const InputVector& u) noexcept {
  const StateVector predicted = plant_.A * x_hat_ + plant_.B * u;
  x_hat_ = predicted;
  const StateMatrix AP = plant_.A * P_;
  P_.noalias() = AP * plant_.A.transpose();
  P_ += Q_;
}

template <int States, int Inputs, int Outputs>
UpdateStatus KalmanFilter<States, Inputs, Outputs>::update(const OutputVector& y,
                                                           const InputVector& u) noexcept {
  if (!y.allFinite()) {
    return UpdateStatus::not_finite;
  }
  // K = P Cᵀ S⁻¹ with S = C P Cᵀ + R
  Eigen::Matrix<double, States, Outputs> K = P_ * plant_.C.transpose();
  OutputMatrix S = plant_.C * K + R_;
  if (!detail::cholesky(S)) {
    return UpdateStatus::singular_innovation;
  }
  detail::solve_right(S, K);

  const OutputVector innovation = y - plant_.C * x_hat_ - plant_.D * u;
  x_hat_ += K * innovation;

  // P = (I - K C) P (I - K C)ᵀ + K R Kᵀ
  StateMatrix I_KC = -K * plant_.C;
  I_KC.diagonal().array() += 1.0;
  const StateMatrix left = I_KC * P_;
  const Eigen::Matrix<double, States, Outputs> KR = K * R_;
  const StateMatrix posterior = left * I_KC.transpose() + KR * K.transpose();
  P_ = 0.5 * (posterior + posterior.transpose());
  return UpdateStatus::updated;
}

}  // namespace flyball
