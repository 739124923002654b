#pragma once

#include <limits>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/state_feedback.hpp>
#include <flyball/core/instantiated.hpp>
#include <flyball/core/sizes.hpp>
#include <flyball/estimation/observer.hpp>

namespace flyball {

namespace detail {
struct LqgDefinitions;  ///< Complete where the .tpp is included.
}

/// The observer-based regulator: steady-state Kalman filter, LQR state feedback and plant
/// inversion.
///
/// One step, as the book orders it:
///   x_hat⁻ = A x_hat + B u_model,  x_hat = x_hat⁻ + K_e (y - C x_hat⁻)   (9.20, 9.23)
///   u = clamp(K (r - x_hat) + B⁺ (r_next - A r) + extra)                  (7.15, 7.16)
///   u_model = u - extra
/// where extra is what the linear model does not hold, such as gravity and friction: it is added
/// before the limits, and the observer is told only what the linear model saw.
///
/// Run-time object: noexcept, and for sizes known at compile time allocation-free. Whatever comes,
/// u is finite and within its limits, and the estimate stays finite: a measurement, feedforward or
/// `extra` that is not a finite number, or beyond `largest_signal`, is left out, and a reference
/// that is not asks for nothing, u = 0. Source: book, Theorems 7.7.1, 7.8.1 and 9.6.3.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
class Lqg {
 public:
  static_assert(detail::has_definitions<detail::LqgDefinitions, States, Inputs, Outputs>,
                "the library has no code for this size: #include <flyball/control/lqg.tpp> first");

  using Plant = DiscreteSystem<States, Inputs, Outputs>;
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using OutputVector = Eigen::Matrix<double, Outputs, 1>;
  using FeedbackGain = Eigen::Matrix<double, Inputs, States>;
  using EstimatorGain = Eigen::Matrix<double, States, Outputs>;

  /// @param plant  The discrete model. @param K  m x n, such as LqrDesign::K.
  /// @param K_e    n x p, filter form, such as KalmanGain::K.
  /// @param u_min, u_max  m x 1, limits of the input, V.
  /// @errors ArgumentError for shapes, entries, and limits that are NaN or leave nothing between
  ///         them (out_of_range).
  [[nodiscard]] static Expected<Lqg> create(const Plant& plant, const FeedbackGain& K,
                                            const EstimatorGain& K_e, const InputVector& u_min,
                                            const InputVector& u_max);

  /// One period. @param r  The reference now. @param r_next  One period later.
  /// @param y  The measurement of now; one that is not finite is left out, see `measured`.
  /// @param extra  What to add for what is not in the linear model, V.
  /// @return u, V.
  [[nodiscard]] InputVector step(const StateVector& r, const StateVector& r_next,
                                 const OutputVector& y, const InputVector& extra) noexcept;
  [[nodiscard]] InputVector step(const StateVector& r, const StateVector& r_next,
                                 const OutputVector& y) noexcept;
  /// The same with a measured rail: no more voltage is asked for than the rail has, so that the
  /// observer knows what the motor sees. Send `VoltageCompensation::command(u, rail)` to it.
  /// @param rail_voltage  V; one that is not positive counts as not measured.
  /// `VoltageCompensation::rail` makes a measurement believable.
  [[nodiscard]] InputVector step(const StateVector& r, const StateVector& r_next,
                                 const OutputVector& y, const InputVector& extra,
                                 double rail_voltage) noexcept;
  /// A vector of another size.
  template <class R, class Next, class Y, class... More>
    requires(wrong_size<R, StateVector> || wrong_size<Next, StateVector> ||
             wrong_size<Y, OutputVector>)
  InputVector step(const R&, const Next&, const Y&, const More&...) = delete;

  /// Declares a state to be an angle that wraps, see StateFeedback.
  void set_angle(int state, double turn) noexcept { feedback_.set_angle(state, turn); }

  /// Starts again at an estimate, as after a time without control: the next step predicts from it.
  /// @return  Whether it was taken: one that is not finite is not.
  bool reset(const StateVector& x_hat) noexcept {
    u_model_.setZero();
    return observer_.reset(x_hat);
  }

  /// Whether the measurement of the last step is in the estimate.
  [[nodiscard]] bool measured() const noexcept { return measured_; }

  [[nodiscard]] const StateVector& x_hat() const noexcept { return observer_.x_hat(); }
  /// The input of the last step less `extra`: what the linear model saw.
  [[nodiscard]] const InputVector& u_model() const noexcept { return u_model_; }
  [[nodiscard]] const Plant& plant() const noexcept { return observer_.plant(); }
  [[nodiscard]] const FeedbackGain& K() const noexcept { return feedback_.K(); }
  [[nodiscard]] const EstimatorGain& K_e() const noexcept { return observer_.K(); }
  [[nodiscard]] const LinearPlantInversion<States, Inputs>& feedforward() const noexcept {
    return inversion_;
  }

 private:
  Lqg(const Plant& plant, const FeedbackGain& K, const EstimatorGain& K_e,
      const LinearPlantInversion<States, Inputs>& inversion, const InputVector& u_min,
      const InputVector& u_max);

  Observer<States, Inputs, Outputs> observer_;
  StateFeedback<States, Inputs> feedback_;
  LinearPlantInversion<States, Inputs> inversion_;
  InputVector u_model_;
  bool measured_ = false;
};

/// `Lqg::create` with the sizes of the plant and one limit for every input: |u| <= u_limit.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<Lqg<States, Inputs, Outputs>> lqg(
    const DiscreteSystem<States, Inputs, Outputs>& plant,
    const Eigen::Matrix<double, Inputs, States>& K,
    const Eigen::Matrix<double, States, Outputs>& K_e,
    double u_limit = std::numeric_limits<double>::infinity()) {
  using Input = Eigen::Matrix<double, Inputs, 1>;
  const Input limit = Input::Constant(plant.B.cols(), u_limit);
  return Lqg<States, Inputs, Outputs>::create(plant, K, K_e, -limit, limit);
}

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  extern template class Lqg<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
