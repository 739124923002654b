#pragma once

#include <flyball/core/instantiated.hpp>
#include <flyball/core/sizes.hpp>
#include <flyball/estimation/kalman_gain.hpp>

namespace flyball {

namespace detail {
struct ObserverDefinitions;  ///< Complete where the .tpp is included.
}

/// An observer with a constant gain: the Kalman filter after it has settled, without covariances.
///
/// x_hat⁻ = A x_hat⁺ + B u (9.20), x_hat⁺ = x_hat⁻ + K (y - C x_hat⁻ - D u) (9.23): Theorem 9.2.2
/// with K = A⁻¹ L, from `kalman_gain` or from poles by `place_observer` (control).
/// Run-time object: noexcept, finite whatever comes, and for sizes known at compile time
/// allocation-free.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
class Observer {
 public:
  static_assert(
      detail::has_definitions<detail::ObserverDefinitions, States, Inputs, Outputs>,
      "the library has no code for this size: #include <flyball/estimation/observer.tpp> first");

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
  /// A vector of another size.
  template <class A>
    requires wrong_size<A, InputVector>
  bool predict(const Eigen::MatrixBase<A>&) = delete;
  /// Corrects; a measurement that is not finite, or that would take the estimate beyond
  /// `largest_signal`, is left out and answered with false.
  bool update(const OutputVector& y, const InputVector& u) noexcept;
  /// A vector of another size.
  template <class A, class B>
    requires(wrong_size<A, OutputVector> || wrong_size<B, InputVector>)
  bool update(const Eigen::MatrixBase<A>&, const Eigen::MatrixBase<B>&) = delete;

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

/// An observer in one step, which predicts and corrects at once:
///
/// x_hat_{k+1} = A x_hat_k + B u_k + L (y_k - C x_hat_k - D u_k) (9.3, 9.4).
///
/// Its estimate is that of the next sample, before that is measured, so it is one period behind
/// `Observer`; in return L need not be A K, and A need no inverse.
/// Run-time object: noexcept, finite whatever comes, and for sizes known at compile time
/// allocation-free. Source: book, Theorem 9.2.1.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
class LuenbergerObserver {
 public:
  using Plant = DiscreteSystem<States, Inputs, Outputs>;
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using OutputVector = Eigen::Matrix<double, Outputs, 1>;
  using Gain = Eigen::Matrix<double, States, Outputs>;

  /// @param plant  The model. @param L  n x p, predictor form, as KalmanGain::L.
  LuenbergerObserver(const Plant& plant, const Gain& L)
      : plant_(plant), L_(L), x_hat_(StateVector::Zero(plant.A.rows())) {}

  /// From x_hat_k to x_hat_{k+1}.
  /// @param u  The input from sample k on; one that is not a finite number counts as zero.
  /// @param y  Measured at sample k; if it is not finite, the step is a prediction.
  /// @return  Whether u and y were used and x_hat has moved: one that would grow beyond
  ///          `largest_signal` stays where it is.
  bool step(const InputVector& u, const OutputVector& y) noexcept;

  [[nodiscard]] const StateVector& x_hat() const noexcept { return x_hat_; }
  [[nodiscard]] const Plant& plant() const noexcept { return plant_; }
  [[nodiscard]] const Gain& L() const noexcept { return L_; }
  /// Starts again from x_hat. @return  Whether it was taken: one that is not finite is not.
  bool reset(const StateVector& x_hat) noexcept;

 private:
  Plant plant_;
  Gain L_;
  StateVector x_hat_;
};

/// The observer as a system of its own, to be simulated, discretised or analysed: its inputs are
/// [u; y], its states and outputs x_hat, its A is A - L C, its B is [B - L D, L] (9.1 to 9.4).
/// @param plant  Continuous or discrete. @param L  n x p.
/// @errors ArgumentError for shapes and entries. Source: book, Theorem 9.2.1.
///@{
[[nodiscard]] Expected<ContinuousSystem<>> observer_system(const ContinuousSystem<>& plant,
                                                           const MatrixRef& L);
[[nodiscard]] Expected<DiscreteSystem<>> observer_system(const DiscreteSystem<>& plant,
                                                         const MatrixRef& L);
///@}

/// K = A⁻¹ L, the gain of predict and update apart from that of one step (Theorem 9.2.2, D.2.1).
/// @param A  n x n, discrete. @param L  n x p.
/// @errors ArgumentError for shapes and entries; out_of_range for an A without an inverse (to
///         1e-12), with its condition: then L is no A K, and LuenbergerObserver takes it as it is.
[[nodiscard]] Expected<Eigen::MatrixXd> filter_gain(const MatrixRef& A, const MatrixRef& L);

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  extern template class Observer<States, Inputs, Outputs>;     \
  extern template class LuenbergerObserver<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
