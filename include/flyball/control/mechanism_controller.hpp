#pragma once

#include <optional>
#include <variant>

#include <flyball/control/lqg.hpp>
#include <flyball/control/predicting_lqg.hpp>
#include <flyball/planning/profiles/motion.hpp>

namespace flyball {

/// What the loop of a flywheel, elevator or arm is made of, as a design gives it.
struct MechanismControllerDesign {
  mechanisms::MechanismKind kind = mechanisms::MechanismKind::flywheel;
  /// Believed gains; kS and gravity are fed forward.
  mechanisms::FeedforwardGains gains{};
  /// Discrete model in volts, whose output is its first state: states [velocity] (flywheel),
  /// [position, velocity], or [position] for a mechanism that is faster than the period.
  DiscreteSystem<> plant{};
  Eigen::MatrixXd K;    ///< 1 x n, V per unit of the state.
  Eigen::MatrixXd K_e;  ///< n x 1, filter form.
  double max_voltage = 12.0;
  double nominal_voltage = 12.0;
  bool feed_forward_gravity = true;
  bool feed_forward_friction = true;
  bool compensate_voltage = true;  ///< (6.23) with the rail voltage measured at each sample.
  /// Age of a measurement, s. It is moved along the reference to now, y + delay dr/dt, so that a
  /// late sensor causes no error while the reference moves; the loop itself is not changed.
  Time measurement_delay{};
  /// In place of that, the regulator predicts over the delay with this continuous model (its A and
  /// B, of the plant's states, in volts), and K is the gain for no delay.
  std::optional<ContinuousSystem<>> predicts_with{};

  /// The gains that are fed forward: without those that the design leaves out.
  [[nodiscard]] mechanisms::FeedforwardGains fed_forward() const noexcept;
};

/// A mechanism's loop: everything that a robot runs each period.
///
///   y = measurement + delay dr/dt
///   x_hat, u: a step of `Lqg` with extra = gravity(r) + kS sgn(dr/dt), limited to max_voltage and
///   to the rail; command = u V_nominal / V_rail (6.23)
///
/// A design that predicts over the delay takes y = measurement and a step of `PredictingLqg`
/// instead; x_hat is then the state of now that it predicts. The inputs that it remembers are those
/// that the motor saw, limited and less `extra`.
///
/// Gravity and friction are taken at the reference, so that noise cannot enter; at the start of a
/// motion the direction is the next reference's. Simulations step this class, and the generated
/// loop of the `export` domain does the same arithmetic in the same order.
///
/// Run-time object: noexcept, allocation-free (with Eigen::Dynamic too, which holds one of the
/// others), bounded; voltage and command are finite and within their limits whatever comes, as
/// those of `Lqg`.
/// @tparam States  1, 2, or Eigen::Dynamic for the one that the design has.
/// Source: book, Theorems 6.9.1, 6.10.1, 6.11.1, 7.7.1, 7.8.1, 9.6.3 and 14.3.2.
template <int States = Eigen::Dynamic>
class MechanismController {
  static_assert(States == 1 || States == 2, "a mechanism's model has one state or two");

 public:
  using StateVector = Eigen::Matrix<double, States, 1>;

  /// @errors ArgumentError: wrong_shape for a plant whose states are not the mechanism's;
  ///         out_of_range for an output that is not the first state; those of `Lqg` and of
  ///         `SimpleFeedforward`; not_positive, not_finite for voltages and delay; those of
  ///         `DelayPredictor` for a design that predicts.
  [[nodiscard]] static Expected<MechanismController> create(
      const MechanismControllerDesign& design);

  /// One period. @param measurement  Of the velocity (flywheel), else of the position; one that is
  /// not finite is left out, see `measured`. @param r, r_next  The reference now and one period
  /// later; a flywheel's is its velocity. @param rail_voltage  V, measured; an unbelievable one
  /// counts as nominal.
  /// @return The motor's voltage, V.
  double update(double measurement, const MotionState& r, const MotionState& r_next,
                double rail_voltage) noexcept;

  /// Starts again at a state, as after a time without control: the next update predicts from it.
  /// @param state  A flywheel's is its velocity. One that is not finite leaves the estimate.
  void reset(const MotionState& state) noexcept;

  /// Whether the measurement of the last update is in the estimate.
  [[nodiscard]] bool measured() const noexcept {
    return of_regulator([](const auto& regulator) { return regulator.measured(); });
  }
  /// The last answer of `update`, V at the motor.
  [[nodiscard]] double voltage() const noexcept { return voltage_; }
  /// What to send to a controller that scales by the rail, V of nominal_voltage: the last answer
  /// with the rail's sag compensated, or as it is where the design does not compensate.
  [[nodiscard]] double command() const noexcept { return command_; }
  /// What |voltage| was limited to in the last update, V.
  [[nodiscard]] double limit() const noexcept { return limit_; }
  /// The estimate after the last update.
  [[nodiscard]] const StateVector& x_hat() const noexcept {
    return of_regulator(
        [](const auto& regulator) -> const StateVector& { return regulator.x_hat(); });
  }
  /// The reference or the truth in the coordinates of the model's states.
  [[nodiscard]] StateVector states_of(const MotionState& motion) const noexcept;
  /// B⁺ of the plant inversion, 1 x n.
  [[nodiscard]] const Eigen::Matrix<double, 1, States>& B_pinv() const noexcept {
    return of_regulator([](const auto& regulator) -> const Eigen::Matrix<double, 1, States>& {
      return regulator.feedforward().B_pinv();
    });
  }

 private:
  using Prompt = Lqg<States, 1, 1>;
  using Predicting = PredictingLqg<States, 1, 1>;
  using Regulator = std::variant<Prompt, Predicting>;

  MechanismController(const MechanismControllerDesign& design, const Regulator& regulator,
                      const SimpleFeedforward& feedforward);

  /// The predicting regulator of a design that has one.
  [[nodiscard]] static Expected<Regulator> regulator_of(const MechanismControllerDesign& design);

  template <class Ask>
  decltype(auto) of_regulator(Ask ask) const noexcept {
    const auto* prompt = std::get_if<Prompt>(&regulator_);
    return prompt != nullptr ? ask(*prompt) : ask(*std::get_if<Predicting>(&regulator_));
  }

  Regulator regulator_;
  SimpleFeedforward feedforward_;
  VoltageCompensation compensation_;
  double max_voltage_;
  double period_;
  double delay_;  ///< s, by which a measurement is moved.
  bool compensates_;
  double voltage_ = 0.0;
  double command_ = 0.0;
  double limit_ = 0.0;
};

/// The controller of a design whose number of states is not known at compile time: one of the two
/// others, so that it gives the same bits and allocates no more.
template <>
class MechanismController<Eigen::Dynamic> {
 public:
  /// @errors As for a known size.
  [[nodiscard]] static Expected<MechanismController> create(
      const MechanismControllerDesign& design);

  /// One period, see MechanismController.
  double update(double measurement, const MotionState& r, const MotionState& r_next,
                double rail_voltage) noexcept;
  /// Starts again at a state.
  void reset(const MotionState& state) noexcept;

  [[nodiscard]] bool measured() const noexcept;   ///< Whether the last measurement was used.
  [[nodiscard]] double voltage() const noexcept;  ///< V, the last answer.
  [[nodiscard]] double command() const noexcept;  ///< V, to be sent.
  [[nodiscard]] double limit() const noexcept;    ///< V, of |voltage| in the last update.
  /// The estimate after the last update, n x 1.
  [[nodiscard]] Eigen::Map<const Eigen::VectorXd> x_hat() const noexcept;
  /// B⁺ of the plant inversion, 1 x n.
  [[nodiscard]] Eigen::Map<const Eigen::RowVectorXd> B_pinv() const noexcept;

 private:
  using Sized = std::variant<MechanismController<1>, MechanismController<2>>;
  explicit MechanismController(const Sized& sized) noexcept : sized_(sized) {}

  Sized sized_;
};

extern template class MechanismController<1>;
extern template class MechanismController<2>;

}  // namespace flyball
