#pragma once

#include <flyball/estimation/kalman_gain.hpp>

namespace flyball {

/// An observer with a constant gain: the Kalman filter after it has settled, without covariances.
///
/// x_hat⁻ = A x_hat⁺ + B u (9.20), x_hat⁺ = x_hat⁻ + K (y - C x_hat⁻ - D u) (9.23).
/// Run-time object: noexcept, finite whatever comes, and for sizes known at compile time
/// allocation-free.
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
      : plant_(plant),
        K_(K),
        x_hat_(StateVector::Zero(plant.A.rows())),
        feedthrough_(!plant.D.isZero(0.0)) {}

  /// x_hat <- A x_hat + B u. @param u  An input that is not a finite number counts as zero.
  /// @return  Whether u was used and x_hat has moved: one that would grow beyond `largest_signal`
  ///          stays where it is.
  bool predict(const InputVector& u) noexcept;
  /// Corrects; a measurement that is not finite, or that would take the estimate beyond
  /// `largest_signal`, is left out and answered with false.
  bool update(const OutputVector& y, const InputVector& u) noexcept;

  [[nodiscard]] const StateVector& x_hat() const noexcept { return x_hat_; }
  [[nodiscard]] const Plant& plant() const noexcept { return plant_; }
  [[nodiscard]] const Gain& K() const noexcept { return K_; }
  /// Starts again from x_hat. @return  Whether it was taken: one that is not finite is not.
  bool reset(const StateVector& x_hat) noexcept { return take(x_hat); }

 private:
  bool take(const StateVector& x_hat) noexcept;

  Plant plant_;
  Gain K_;
  StateVector x_hat_;
  bool feedthrough_;  ///< D is not zero.
};

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  extern template class Observer<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
