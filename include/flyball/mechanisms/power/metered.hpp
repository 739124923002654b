#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include <flyball/mechanisms/power/powered.hpp>
#include <flyball/mechanisms/power/winding.hpp>

namespace flyball::mechanisms {

/// The windings of the motors in one gearbox, each like the others.
struct MotorWindings {
  Winding winding{};
  int count = 1;  ///< Of the motors.
};

/// A powered model that keeps account: its motors' windings warm up, which raises their resistance
/// and takes from what they can push, and what its controllers take from the battery is added up.
///
///     states [x; T_1 … T_m (°C, of a motor's windings); E (J)],  inputs as before,
///     C dT_k/dt = I_k² R_k(T_k)/n_k - (T_k - T_ambient)/R_th,   dE/dt = Σ V_k I_k,
///
/// with I_k = (V_k - e_k)/R_k(T_k) and limits and sag of those currents. E grows less where motors
/// feed back.
template <MotorizedModel M>
class Metered {
 public:
  static constexpr std::size_t motors = Powered<M>::motors;
  /// The size of the state.
  static constexpr int states() { return M::states() + static_cast<int>(motors) + 1; }
  /// The size of u.
  static constexpr int inputs() { return M::inputs(); }
  /// Where a motor's temperature is among the states. @param motor  From 0.
  static constexpr int temperature_at(int motor) { return M::states() + motor; }
  /// Where the energy is.
  static constexpr int energy_at() { return states() - 1; }

  /// Of windings that are known to be good; `metered` checks them.
  Metered(Powered<M> powered, const std::array<MotorWindings, motors>& windings)
      : powered_(std::move(powered)), windings_(windings) {}

  /// The model behind its controllers.
  [[nodiscard]] const Powered<M>& powered() const noexcept { return powered_; }
  /// Where it starts: windings as warm as what is around them, nothing spent.
  [[nodiscard]] Eigen::Vector<double, states()> start(const StateOf<M>& x) const {
    Eigen::Vector<double, states()> all;
    all.template head<M::states()>() = x;
    for (std::size_t k = 0; k < motors; ++k) {
      all(temperature_at(static_cast<int>(k))) = windings_[k].winding.ambient;
    }
    all(energy_at()) = 0.0;
    return all;
  }
  /// What flows, over a generic scalar. @param x  All states. @param u  V, asked for.
  template <class X, class U>
  [[nodiscard]] auto flow(const X& x, const U& u) const {
    return flow_at(x, u).first;
  }
  /// The rates of all states over a generic scalar.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    const auto [flows, R] = flow_at(x, u);
    const Eigen::Vector<Scalar, M::states()> inner = x.template head<M::states()>();
    Eigen::Vector<Scalar, M::inputs()> volts;
    Eigen::Vector<Scalar, states()> rate;
    Scalar power(0.0);
    for (std::size_t k = 0; k < motors; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      const MotorTerminal& motor = powered_.bus().motors[k];
      // The voltage at which cold windings would carry the same current.
      volts(i) = flows.voltage[k] - flows.current[k] * (R[k] - motor.R);
      const MotorWindings& of = windings_[k];
      const Scalar heat =
          flows.current[k] * flows.current[k] * R[k] / static_cast<double>(of.count);
      const int at = temperature_at(static_cast<int>(k));
      rate(at) = of.winding.rate(Scalar(x(at)), heat);
      power += flows.voltage[k] * flows.current[k];
    }
    rate.template head<M::states()>() = powered_.model().derivative(inner, volts);
    rate(energy_at()) = power;
    return rate;
  }
  /// The model's, with the temperatures and the energy. The output is the state.
  [[nodiscard]] ModelDescription description() const {
    ModelDescription description = describe(powered_.model());
    description.parameters.clear();
    for (std::size_t k = 1; k <= motors; ++k) {
      description.states.push_back({"winding temperature " + std::to_string(k), "°C"});
    }
    description.states.push_back({"energy", "J"});
    description.outputs = description.states;
    return description;
  }

 private:
  template <class X, class U>
  [[nodiscard]] auto flow_at(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    const Eigen::Vector<Scalar, M::states()> inner = x.template head<M::states()>();
    std::array<Scalar, motors> wanted;
    std::array<Scalar, motors> speeds;
    std::array<Scalar, motors> R;
    for (std::size_t k = 0; k < motors; ++k) {
      const int motor = static_cast<int>(k);
      wanted[k] = u(motor);
      speeds[k] = powered_.model().motor_speed(inner, motor);
      R[k] = powered_.bus().motors[k].R *
             windings_[k].winding.warmth(Scalar(x(temperature_at(motor))));
    }
    return std::pair(powered_.bus().flow(wanted, speeds, R), R);
  }

  Powered<M> powered_;
  std::array<MotorWindings, motors> windings_;
};

namespace detail {

/// @errors As `metered`.
[[nodiscard]] Expected<void> check_windings(std::span<const MotorWindings> windings);

}  // namespace detail

/// @errors ArgumentError: a heat capacity or thermal resistance that is not positive (infinite is
///         not known), an ambient temperature that is not finite, a negative α, a count below one.
template <MotorizedModel M>
[[nodiscard]] Expected<Metered<M>> metered(
    Powered<M> model, const std::array<MotorWindings, Powered<M>::motors>& windings) {
  return detail::check_windings(windings).map(
      [&] { return Metered<M>(std::move(model), windings); });
}

}  // namespace flyball::mechanisms
