#pragma once

#include <array>
#include <cstddef>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/mechanisms/power/motor_supply.hpp>
#include <flyball/systems/model.hpp>

namespace flyball::mechanisms {

/// A model whose inputs are motors' voltages, and which knows their speeds and their numbers.
template <class M>
concept MotorizedModel = Model<M> && requires(const M& model, const StateOf<M>& x) {
  { model.motor_speed(x, 0) };
  { model.shaft(0).R };
  { model.shaft(0).Kv };
};

/// A motorised model behind its controllers and its battery: the same states, and as inputs the
/// voltages that are asked for. What the motors get is `PowerBus::flow` at each instant: current
/// limits act before they are exceeded, and the rail sags under all motors together.
///
/// It is continuous, and smooth but where a limit begins or ends.
template <MotorizedModel M>
class Powered {
 public:
  /// The size of x.
  static constexpr int states() { return M::states(); }
  /// The size of u.
  static constexpr int inputs() { return M::inputs(); }
  static constexpr std::size_t motors = static_cast<std::size_t>(M::inputs());
  using Bus = PowerBus<motors>;

  /// @param limits  Of each motor's controller; checked by `powered_each`.
  Powered(M model, const std::array<CurrentLimits, motors>& limits, const Battery& battery)
      : model_(std::move(model)) {
    bus_.battery = battery;
    for (std::size_t k = 0; k < motors; ++k) {
      const auto& shaft = model_.shaft(static_cast<int>(k));
      bus_.motors[k] = {shaft.R, shaft.Kv, limits[k]};
    }
  }

  /// The model itself.
  [[nodiscard]] const M& model() const noexcept { return model_; }
  [[nodiscard]] const Bus& bus() const noexcept { return bus_; }

  /// What flows, over a generic scalar. @param u  V, asked for.
  template <class X, class U>
  [[nodiscard]] auto flow(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    std::array<Scalar, motors> wanted;
    std::array<Scalar, motors> speeds;
    for (std::size_t k = 0; k < motors; ++k) {
      wanted[k] = u(static_cast<Eigen::Index>(k));
      speeds[k] = model_.motor_speed(x, static_cast<int>(k));
    }
    return bus_.flow(wanted, speeds);
  }
  /// dx/dt of the model under the voltages that its motors get.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return model_.derivative(x, applied(x, u));
  }
  /// The same for given parameters of the model.
  template <class X, class U, class P>
    requires ParametricModel<M>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    return model_.derivative(x, applied(x, u), p);
  }
  /// The model's. @private
  [[nodiscard]] auto parameters() const
    requires ParametricModel<M>
  {
    return model_.parameters();
  }
  /// The model's output under those voltages. @private
  template <class X, class U>
    requires ModelWithOutput<M>
  [[nodiscard]] auto output(const X& x, const U& u) const {
    return model_.output(x, applied(x, u));
  }
  /// The model's.
  [[nodiscard]] ModelDescription description() const { return model_.description(); }

 private:
  template <class X, class U>
  [[nodiscard]] auto applied(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    const auto flows = flow(x, u);
    Eigen::Vector<Scalar, M::inputs()> volts;
    for (std::size_t k = 0; k < motors; ++k) {
      volts(static_cast<Eigen::Index>(k)) = flows.voltage[k];
    }
    return volts;
  }

  M model_;
  Bus bus_;
};

namespace detail {

/// @errors As `powered_each`.
[[nodiscard]] Expected<void> check_supply(std::span<const CurrentLimits> limits,
                                          const Battery& battery);

}  // namespace detail

/// Limits for each motor. @errors ArgumentError: a limit that is negative or NaN, a battery without
/// voltage, a resistance
///         that is negative or not finite.
template <MotorizedModel M>
[[nodiscard]] Expected<Powered<M>> powered_each(
    M model, const std::array<CurrentLimits, static_cast<std::size_t>(M::inputs())>& limits,
    const Battery& battery) {
  return detail::check_supply(limits, battery).map([&] {
    return Powered<M>(std::move(model), limits, battery);
  });
}
/// The same limits for all motors. @errors As `powered_each`.
template <MotorizedModel M>
[[nodiscard]] Expected<Powered<M>> powered(M model, const CurrentLimits& limits,
                                           const Battery& battery) {
  std::array<CurrentLimits, static_cast<std::size_t>(M::inputs())> all;
  all.fill(limits);
  return powered_each(std::move(model), all, battery);
}

}  // namespace flyball::mechanisms
