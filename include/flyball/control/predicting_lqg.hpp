#pragma once

#include <flyball/control/delay_compensation.hpp>
#include <flyball/control/feedforward.hpp>
#include <flyball/control/state_feedback.hpp>
#include <flyball/estimation/observer.hpp>

namespace flyball {

/// The observer-based regulator of a plant that is measured, or acts, late: `Lqg` on the state that
/// a DelayPredictor gives, so that the gain for no delay can be used as it is.
///
/// One step, where ξ is the state that is measured now, `latency` old, and u_k the input of step k:
///   ξ⁻ = A ξ + B_0 u_{k-1-d} + B_1 u_{k-2-d},  ξ = ξ⁻ + K_e (y - C ξ⁻)
///   x_hat = ξ carried through the delay by the inputs on their way, see DelayPredictor
///   u = clamp(K (r - x_hat) + B⁺ (r_next - A r) + extra);  u - extra is what is sent
/// With a true model the loop has the poles of the loop without delay, and poles at 0. The inputs
/// are remembered as they were limited, so that a limit that is reached does not wind anything up.
///
/// Run-time object: noexcept, and for sizes known at compile time allocation-free after `create`.
/// Whatever comes, u is finite and within its limits, as with `Lqg`.
/// Source: Åström and Wittenmark, "Computer-Controlled Systems", 3rd ed., section 4.5; book, B.4.2.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
class PredictingLqg {
 public:
  using Plant = DiscreteSystem<States, Inputs, Outputs>;
  using Predictor = DelayPredictor<States, Inputs>;
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using OutputVector = Eigen::Matrix<double, Outputs, 1>;
  using FeedbackGain = Eigen::Matrix<double, Inputs, States>;
  using EstimatorGain = Eigen::Matrix<double, States, Outputs>;

  /// @param plant  The discrete model without its delay, D = 0. @param predictor  Of the same
  /// plant, with its delay. @param K  m x n, for no delay. @param K_e  n x p, filter form.
  /// @param u_min, u_max  m x 1, limits of the input.
  /// @errors As `Lqg::create`; ArgumentError: out_of_range for a D that is not zero, wrong_shape
  /// for
  ///         a predictor of another plant.
  [[nodiscard]] static Expected<PredictingLqg> create(
      const Plant& plant, const Predictor& predictor, const FeedbackGain& K,
      const EstimatorGain& K_e, const InputVector& u_min, const InputVector& u_max);

  /// One period. @param r, r_next  The reference of the predicted state, and one period later.
  /// @param y  The measurement of now, which is late; one that is not finite is left out, see
  /// `measured`. @param extra, rail_voltage  As with `Lqg::step`. @return u.
  [[nodiscard]] InputVector step(const StateVector& r, const StateVector& r_next,
                                 const OutputVector& y, const InputVector& extra,
                                 double rail_voltage) noexcept;

  /// Declares a state to be an angle that wraps, see StateFeedback.
  void set_angle(int state, double turn) noexcept { feedback_.set_angle(state, turn); }

  /// Starts again at an estimate of the measured state, with nothing on its way.
  /// @return  Whether it was taken: one that is not finite is not.
  bool reset(const StateVector& x_hat) noexcept;

  /// Whether the measurement of the last step is in the estimate.
  [[nodiscard]] bool measured() const noexcept { return measured_; }
  /// The estimate when the delay has passed: what the last step acted on.
  [[nodiscard]] const StateVector& x_hat() const noexcept { return x_hat_; }
  [[nodiscard]] const FeedbackGain& K() const noexcept { return feedback_.K(); }
  [[nodiscard]] const LinearPlantInversion<States, Inputs>& feedforward() const noexcept {
    return inversion_;
  }

 private:
  static constexpr int arriving = Inputs == Eigen::Dynamic ? Eigen::Dynamic : 2 * Inputs;
  using LateObserver = Observer<States, arriving, Outputs>;

  PredictingLqg(const LateObserver& observer, const Predictor& predictor,
                const StateFeedback<States, Inputs>& feedback,
                const LinearPlantInversion<States, Inputs>& inversion);

  LateObserver observer_;  ///< Of ξ, with the inputs [u_{k-1-d}; u_{k-2-d}].
  Predictor predictor_;
  StateFeedback<States, Inputs> feedback_;
  LinearPlantInversion<States, Inputs> inversion_;
  typename LateObserver::InputVector arriving_;
  StateVector x_hat_;
  bool measured_ = false;
};

extern template class PredictingLqg<1, 1, 1>;
extern template class PredictingLqg<2, 1, 1>;
extern template class PredictingLqg<>;

}  // namespace flyball
