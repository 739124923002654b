#pragma once

#include <flyball/core/signal.hpp>
#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/estimation/ud_factors.hpp>

namespace flyball {

namespace detail {

struct KalmanFilterDefinitions {};

/// What KalmanFilter::create asks of its arguments.
[[nodiscard]] Expected<void> check_kalman_filter(const MatrixRef& A, const MatrixRef& B,
                                                 const MatrixRef& C, const MatrixRef& D,
                                                 Time period, const Covariance& Q,
                                                 const Covariance& R, const Covariance& P0);

}  // namespace detail

template <int States, int Inputs, int Outputs>
KalmanFilter<States, Inputs, Outputs>::KalmanFilter(const Plant& plant, const StateMatrix& Q,
                                                    const OutputMatrix& R, const StateMatrix& P)
    : plant_(plant), x_hat_(StateVector::Zero(plant.A.rows())), P_(P) {
  detail::ud_factorize(Q, Q_factor_, Q_variance_);
  detail::ud_factorize(R, R_factor_, R_variance_);
  detail::ud_factorize(P, U_, d_);
  detail::ud_product(U_, d_, P_);
  independent_ = R_factor_.isIdentity(0.0);
  feedthrough_ = !plant.D.isZero(0.0);
  detail::ud_solve(R_factor_, plant_.C);
  detail::ud_solve(R_factor_, plant_.D);
}

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
bool KalmanFilter<States, Inputs, Outputs>::take(const StateMatrix& U,
                                                 const StateVector& d) noexcept {
  StateMatrix P = U;
  detail::ud_product(U, d, P);
  bool bounded = true;
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    bounded = bounded & (P(i, i) <= detail::largest_variance);
  }
  if (bounded) {
    U_ = U;
    d_ = d;
    P_ = P;
  }
  return bounded;
}

template <int States, int Inputs, int Outputs>
bool KalmanFilter<States, Inputs, Outputs>::predict(const InputVector& u) noexcept {
  InputVector known = u;
  detail::keep_signals(known);
  const StateVector predicted = plant_.A * x_hat_ + plant_.B * known;
  const bool moved = is_signal(predicted);
  if (moved) {
    x_hat_ = predicted;
  }
  StateMatrix U = U_;
  StateVector d = d_;
  detail::ud_predict(plant_.A, Q_factor_, Q_variance_, U, d);
  return take(U, d) && moved && is_signal(u);
}

template <int States, int Inputs, int Outputs>
UpdateStatus KalmanFilter<States, Inputs, Outputs>::update(const OutputVector& y,
                                                           const InputVector& u) noexcept {
  if (!is_signal(y) || (feedthrough_ && !is_signal(u))) {
    return UpdateStatus::not_finite;
  }
  OutputVector z = y;
  if (!independent_) {
    detail::ud_solve(R_factor_, z);
  }
  if (feedthrough_) {
    z -= plant_.D * u;
  }
  StateMatrix U = U_;
  StateVector d = d_;
  StateVector x_hat = x_hat_;
  StateVector b = x_hat_;
  for (Eigen::Index j = 0; j < z.size(); ++j) {
    const double r = R_variance_(j);
    const double variance = detail::ud_correct(plant_.C.row(j), r, U, d, b);
    // Without noise, what the sensors before this one have left may be rounding alone.
    constexpr double rounding = 1e-14;
    if (!(variance > 0.0) ||
        (r == 0.0 && j > 0 &&
         variance <= rounding * plant_.C.row(j).dot(P_ * plant_.C.row(j).transpose()))) {
      return UpdateStatus::singular_innovation;
    }
    const double innovation = z(j) - plant_.C.row(j).dot(x_hat);
    x_hat += b * (innovation / variance);
  }
  if (!is_signal(x_hat) || !take(U, d)) {
    return UpdateStatus::not_finite;
  }
  x_hat_ = x_hat;
  return UpdateStatus::updated;
}

template <int States, int Inputs, int Outputs>
bool KalmanFilter<States, Inputs, Outputs>::reset(const StateVector& x_hat) noexcept {
  const bool usable = is_signal(x_hat);
  if (usable) {
    x_hat_ = x_hat;
  }
  return usable;
}

template <int States, int Inputs, int Outputs>
bool KalmanFilter<States, Inputs, Outputs>::reset(const StateVector& x_hat,
                                                  const StateMatrix& P) noexcept {
  StateMatrix U = U_;
  StateVector d = d_;
  detail::ud_factorize(P, U, d);
  const bool usable = (P.array().abs() <= detail::largest_variance).all();
  return usable && is_signal(x_hat) && take(U, d) && reset(x_hat);
}

}  // namespace flyball
