#pragma once

#include <array>
#include <cstddef>

#include <flyball/mechanisms/power/motor_supply.hpp>

namespace flyball::mechanisms {

/// M motor controllers that limit by what they have measured, and the robot's controller that
/// switches them off when the battery is low: what is asked for in a period depends on the flow of
/// the last one, so that a current is exceeded for a period before it is reduced (Snippet 12.1,
/// reactive).
///
/// From the last period's voltage V and current I the back EMF is e = V - I R, with which the next
/// voltage keeps the stator's limit and, at the last rail, the supply's.
/// Run-time object: noexcept, allocation-free. For a simulation: `PowerBus` without limits is what
/// the motors are on.
template <std::size_t M>
class MotorControllers {
 public:
  using Volts = std::array<double, M>;

  /// @param motors  With the limits that the controllers hold.
  explicit MotorControllers(const std::array<MotorTerminal, M>& motors,
                            const Brownout& brownout = Brownout()) noexcept
      : motors_(motors), brownout_(brownout) {}

  /// The voltages of the next period. @param wanted  V. @param measured  What flowed in the last
  /// one; what is not finite counts as zero.
  /// Source: book, Snippet 12.1 (reactive), and for the supply.
  [[nodiscard]] Volts update(const Volts& wanted, const PowerFlow<M>& measured) noexcept {
    using flyball::detail::signal_or_zero;
    Volts volts{};
    const double rail = signal_or_zero(measured.rail);
    if (!brownout_.update(measured.rail)) {
      return volts;
    }
    for (std::size_t k = 0; k < M; ++k) {
      const double emf =
          signal_or_zero(measured.voltage[k]) - signal_or_zero(measured.current[k]) * motors_[k].R;
      volts[k] =
          allowed_voltage(motors_[k], emf, signal_or_zero(wanted[k]), rail > 0.0 ? rail : 0.0);
    }
    return volts;
  }
  [[nodiscard]] const Brownout& brownout() const noexcept { return brownout_; }

 private:
  std::array<MotorTerminal, M> motors_;
  Brownout brownout_;
};

}  // namespace flyball::mechanisms
