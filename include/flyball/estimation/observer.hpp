#pragma once

#include <flyball/estimation/kalman_gain.hpp>

namespace flyball {

/// An observer with a constant gain: the Kalman filter after it has settled, without covariances.
///
/// x_hat⁻ = A x_hat⁺ + B u (9.20), x_hat⁺ = x_hat⁻ + K (y - C x_hat⁻ - D u) (9.23).
/// Run-time object: noexcept, and for sizes known at compile time allocation-free.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
class Observer {
 public:
  using Plant = DiscreteSystem<States, Inputs, Outputs>;
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using OutputVector = Eigen::Matrix<double, Outputs, 1>;
  using Gain = Eigen::Matrix<double, States, Outputs>;

  /// @param plant  The model. @param K  n x p, filter form, as KalmanGain::K.
  Observer(const Plant& plant, const Gain& K)
      : plant_(plant), K_(K), x_hat_(StateVector::Zero(plant.A.rows())) {}

  /// x_hat <- A x_hat + B u.
  void predict(const InputVector& u) noexcept;
  /// Corrects; a measurement that is not finite is left out and answered with false.
  bool update(const OutputVector& y, const InputVector& u) noexcept;

  [[nodiscard]] const StateVector& x_hat() const noexcept { return x_hat_; }
  [[nodiscard]] const Plant& plant() const noexcept { return plant_; }
  [[nodiscard]] const Gain& K() const noexcept { return K_; }
  /// Starts again from x_hat.
  void reset(const StateVector& x_hat) noexcept { x_hat_ = x_hat; }

 private:
  Plant plant_;
  Gain K_;
  StateVector x_hat_;
};

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  extern template class Observer<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
