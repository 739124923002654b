#pragma once

#include <flyball/estimation/kalman_gain.hpp>

namespace flyball {

/// How an update ended.
enum class UpdateStatus {
  updated,              ///< The measurement is in the estimate.
  not_finite,           ///< The measurement has a NaN or an infinity; it was left out.
  singular_innovation,  ///< C P Cᵀ + R is not positive definite; the measurement was left out.
};

/// The Kalman filter of a discrete plant. Theorem 9.6.3.
///
/// Run-time object: noexcept, bounded, and for sizes known at compile time allocation-free. A size
/// that the library does not ship needs <flyball/estimation/kalman_filter.tpp>.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
class KalmanFilter {
 public:
  using Plant = DiscreteSystem<States, Inputs, Outputs>;
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using OutputVector = Eigen::Matrix<double, Outputs, 1>;
  using StateMatrix = Eigen::Matrix<double, States, States>;
  using OutputMatrix = Eigen::Matrix<double, Outputs, Outputs>;

  /// A filter that starts at x_hat = 0 with the error covariance P0.
  /// @param Q, R  Covariances per sample, n x n and p x p. @param P0  n x n.
  /// @errors ArgumentError for shapes, entries and asymmetry.
  [[nodiscard]] static Expected<KalmanFilter> create(const Plant& plant, const Covariance& Q,
                                                     const Covariance& R, const Covariance& P0);

  /// A filter that starts at x_hat = 0 with the error covariance that it would converge to, so that
  /// its gain is the steady one from the first sample.
  /// @errors as `kalman_gain`.
  [[nodiscard]] static Expected<KalmanFilter> steady_state(const Plant& plant, const Covariance& Q,
                                                           const Covariance& R);

  /// x_hat = A x_hat + B u, P = A P Aᵀ + Q (9.20, 9.21).
  void predict(const InputVector& u) noexcept;

  /// Corrects with a measurement of now (9.22 to 9.24, Joseph's form), keeping P symmetric.
  /// @param y  The measurement. @param u  The input at the time of it; only D uses it.
  UpdateStatus update(const OutputVector& y, const InputVector& u) noexcept;

  [[nodiscard]] const StateVector& x_hat() const noexcept { return x_hat_; }
  [[nodiscard]] const StateMatrix& P() const noexcept { return P_; }
  /// Starts again from x_hat; P stays unless it is given.
  void reset(const StateVector& x_hat) noexcept { x_hat_ = x_hat; }
  void reset(const StateVector& x_hat, const StateMatrix& P) noexcept {
    x_hat_ = x_hat;
    P_ = P;
  }

 private:
  KalmanFilter(const Plant& plant, StateMatrix Q, OutputMatrix R, StateMatrix P);

  Plant plant_;
  StateMatrix Q_;
  OutputMatrix R_;
  StateVector x_hat_;
  StateMatrix P_;
};

/// `KalmanFilter::create` with the sizes of the plant.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<KalmanFilter<States, Inputs, Outputs>> kalman_filter(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Covariance& Q, const Covariance& R,
    const Covariance& P0) {
  return KalmanFilter<States, Inputs, Outputs>::create(plant, Q, R, P0);
}

/// `KalmanFilter::steady_state` with the sizes of the plant.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<KalmanFilter<States, Inputs, Outputs>> kalman_filter(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Covariance& Q,
    const Covariance& R) {
  return KalmanFilter<States, Inputs, Outputs>::steady_state(plant, Q, R);
}

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  extern template class KalmanFilter<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
