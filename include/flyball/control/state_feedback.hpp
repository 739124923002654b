#pragma once

#include <Eigen/Core>

#include <flyball/core/instantiated.hpp>
#include <flyball/core/signal.hpp>
#include <flyball/core/sizes.hpp>

namespace flyball {

namespace detail {
struct StateFeedbackDefinitions;  ///< Complete where the .tpp is included.
}

/// State feedback with input limits: u = clamp(K (r - x) + u_ff, u_min, u_max) (7.15).
///
/// Run-time object: noexcept, finite and within the limits whatever comes, and, for sizes known at
/// compile time, allocation-free.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic>
class StateFeedback {
 public:
  static_assert(
      detail::has_definitions<detail::StateFeedbackDefinitions, States, Inputs>,
      "the library has no code for this size: #include <flyball/control/state_feedback.tpp> first");

  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using Gain = Eigen::Matrix<double, Inputs, States>;

  /// @param K  m x n. @param u_min, u_max  Limits of each input, V; infinite for
  /// none but ±largest_signal.
  StateFeedback(const Gain& K, const InputVector& u_min, const InputVector& u_max)
      : K_(K), u_min_(u_min), u_max_(u_max), modulus_(StateVector::Zero(K.cols())) {}

  /// Declares a state to be an angle that wraps: its error is taken to within half a turn.
  /// @param state  Its index; out of range is ignored. @param turn  Usually 2π rad.
  void set_angle(int state, double turn) noexcept {
    if (state >= 0 && state < modulus_.size()) {
      modulus_(state) = turn;
    }
  }

  /// @param x  The state or its estimate. @param r  The reference.
  /// @param u_ff  Feedforward, added before the limits.
  [[nodiscard]] InputVector calculate(const StateVector& x, const StateVector& r,
                                      const InputVector& u_ff) const noexcept;
  [[nodiscard]] InputVector calculate(const StateVector& x, const StateVector& r) const noexcept;
  /// A vector of another size.
  template <class A, class B>
    requires(wrong_size<A, StateVector> || wrong_size<B, StateVector>)
  InputVector calculate(const Eigen::MatrixBase<A>&, const Eigen::MatrixBase<B>&) const = delete;

  /// u within the limits; NaN becomes the limit nearest to zero.
  [[nodiscard]] InputVector clamp(const InputVector& u) const noexcept;

  [[nodiscard]] const Gain& K() const noexcept { return K_; }
  [[nodiscard]] const InputVector& u_min() const noexcept { return u_min_; }
  [[nodiscard]] const InputVector& u_max() const noexcept { return u_max_; }

 private:
  Gain K_;
  InputVector u_min_;
  InputVector u_max_;
  StateVector modulus_;
};

/// Voltage compensation: what to command so that a motor sees the voltage that was meant although
/// the rail is not at its nominal voltage.
///
/// V_cmd = V V_nominal/V_rail (6.23), and what the motor then sees, V = V_cmd V_rail/V_nominal
/// (6.24). A rail voltage that is not positive and finite counts as the nominal one: a broken
/// sensor must not multiply the command.
class VoltageCompensation {
 public:
  /// @param nominal_voltage  V, > 0: the rail voltage at which a command is the motor's voltage.
  explicit constexpr VoltageCompensation(double nominal_voltage = 12.0) noexcept
      : nominal_(nominal_voltage) {}

  /// The rail voltage if it is believable, else the nominal one. Not below a third of the nominal
  /// voltage, where motor controllers have long switched off.
  [[nodiscard]] constexpr double rail(double measured) const noexcept {
    const bool believable = measured > 0.0 && measured < 10.0 * nominal_;
    return !believable ? nominal_ : measured < nominal_ / 3.0 ? nominal_ / 3.0 : measured;
  }

  /// V_cmd for a wanted motor voltage (6.23), limited to the whole rail: |V_cmd| <= V_nominal; zero
  /// for NaN.
  [[nodiscard]] constexpr double command(double voltage, double rail_voltage) const noexcept {
    return detail::limited(voltage * (nominal_ / rail(rail_voltage)), -nominal_, nominal_);
  }

  /// What the motor sees of a command (6.24), zero for one that is not a finite number.
  [[nodiscard]] constexpr double motor_voltage(double command, double rail_voltage) const noexcept {
    return detail::signal_or_zero(command) * (rail(rail_voltage) / nominal_);
  }

  [[nodiscard]] constexpr double nominal_voltage() const noexcept { return nominal_; }

 private:
  double nominal_;
};

#define FLYBALL_STATES_INPUTS(States, Inputs) extern template class StateFeedback<States, Inputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
