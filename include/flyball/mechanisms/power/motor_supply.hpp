#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include <flyball/core/expected.hpp>
#include <flyball/core/signal.hpp>
#include <flyball/math/derivatives/dual.hpp>
#include <flyball/mechanisms/battery.hpp>

/// What a motor controller does between a battery and a motor: limits and sag, in closed form.
namespace flyball::mechanisms {

/// What a motor controller lets flow; infinite is no limit.
struct CurrentLimits {
  double stator = std::numeric_limits<double>::infinity();  ///< A, |I| in the motor's windings.
  double supply = std::numeric_limits<double>::infinity();  ///< A drawn from the battery.
};

/// A motor (or several in one gearbox) at its controller.
struct MotorTerminal {
  double R = 1.0;   ///< Ω, of all motors in parallel.
  double Kv = 1.0;  ///< rad/s/V
  CurrentLimits limits{};
};

/// The voltage nearest to `wanted` that the rail and the limits allow, over a generic scalar: with
/// the back EMF e and the battery's current V (V - e)/(R V_rail) (the controller loses nothing),
///
///     |V| <= V_rail,   |V - e| <= I_stator R,
///     e/2 - √(e²/4 + R V_rail I_supply) <= V <= e/2 + √(e²/4 + R V_rail I_supply).
///
/// The last two always have e in common. A motor that turns faster than the rail and its stator
/// limit can hold gets the rail, whatever flows then. What it feeds back is not limited.
/// @param R  Ω, of the windings as warm as they are. @param rail  V >= 0.
/// Source: book, Snippet 12.1 (predictive), and for the supply.
template <class Scalar, class Resistance>
[[nodiscard]] Scalar allowed_voltage(const CurrentLimits& limits, const Resistance& R,
                                     const Scalar& back_emf, const Scalar& wanted,
                                     const Scalar& rail) {
  using std::sqrt;
  Scalar V = wanted;
  if (limits.stator < largest_signal) {
    const Resistance most = limits.stator * R;
    V = V > back_emf + most   ? Scalar(back_emf + most)
        : V < back_emf - most ? Scalar(back_emf - most)
                              : V;
  }
  if (limits.supply < largest_signal) {
    const Scalar half = 0.5 * back_emf;
    // 1e-12 V² keeps the root's derivative finite at rest with a limit of zero.
    const Scalar root = sqrt(Scalar(half * half + R * limits.supply * rail + 1e-12));
    V = V > half + root ? Scalar(half + root) : V < half - root ? Scalar(half - root) : V;
  }
  return V > rail ? rail : V < -rail ? Scalar(-rail) : V;
}
/// The same of cold windings.
template <class Scalar>
[[nodiscard]] Scalar allowed_voltage(const MotorTerminal& motor, const Scalar& back_emf,
                                     const Scalar& wanted, const Scalar& rail) {
  return allowed_voltage(motor.limits, motor.R, back_emf, wanted, rail);
}

/// What flows while M controllers are asked for voltages.
template <std::size_t M, class Scalar = double>
struct PowerFlow {
  Scalar rail{};                    ///< V, at the controllers.
  Scalar battery_current{};         ///< A, of everything; negative charges.
  std::array<Scalar, M> voltage{};  ///< V, at the motors.
  std::array<Scalar, M> current{};  ///< A, in the motors: the stator's.
  std::array<Scalar, M> supply{};   ///< A, at the controllers: the supply's.
};

namespace detail {

/// The rail's voltage V with V = V_open - R_battery (I_other + Σ V_k (V_k - e_k)/(R_k V)), the
/// largest there is: that which a battery under load comes down to. 0 where there is none.
/// Cost: up to 24 + 60 evaluations of the sum; no allocation. @param R  Ω. @param back_emf, wanted
/// V.
[[nodiscard]] double rail_under_load(const Battery& battery, std::span<const MotorTerminal> motors,
                                     std::span<const double> R, std::span<const double> back_emf,
                                     std::span<const double> wanted) noexcept;

/// V_open - R_battery (I_other + Σ supply currents) - V, over a generic scalar.
template <class Scalar>
[[nodiscard]] Scalar rail_excess(const Battery& battery, std::span<const MotorTerminal> motors,
                                 std::span<const Scalar> R, std::span<const Scalar> back_emf,
                                 std::span<const Scalar> wanted, const Scalar& rail) {
  Scalar current(battery.other_current);
  for (std::size_t k = 0; k < motors.size(); ++k) {
    const Scalar V = allowed_voltage(motors[k].limits, R[k], back_emf[k], wanted[k], rail);
    current += V * (V - back_emf[k]) / (R[k] * rail);
  }
  return battery.open_circuit_voltage - battery.resistance * current - rail;
}

/// The value of a number with or without derivatives.
[[nodiscard]] inline double value_of(double number) noexcept {
  return number;
}
template <int N, int Order>
[[nodiscard]] double value_of(const Dual<N, Order>& number) {
  return number.value;
}

}  // namespace detail

/// M controllers on one battery, which sags.
///
/// The rail's voltage is solved for, no step behind; its derivatives are those of the implicit
/// function. Where a limit begins or ends the voltages have a kink.
/// Run-time object: noexcept, allocation-free in doubles.
template <std::size_t M>
struct PowerBus {
  std::array<MotorTerminal, M> motors{};
  Battery battery{};

  /// @param wanted  V, of the motors, before limits. @param speeds  rad/s, of the motors. What is
  /// not finite counts as zero.
  template <class Scalar>
  [[nodiscard]] PowerFlow<M, Scalar> flow(const std::array<Scalar, M>& wanted,
                                          const std::array<Scalar, M>& speeds) const {
    std::array<Scalar, M> R;
    for (std::size_t k = 0; k < M; ++k) {
      R[k] = Scalar(motors[k].R);
    }
    return flow(wanted, speeds, R);
  }
  /// The same of windings that are warm. @param R  Ω, of each motor's windings; positive.
  template <class Scalar>
  [[nodiscard]] PowerFlow<M, Scalar> flow(const std::array<Scalar, M>& wanted,
                                          const std::array<Scalar, M>& speeds,
                                          const std::array<Scalar, M>& R) const {
    using detail::value_of;
    std::array<Scalar, M> volts;
    std::array<Scalar, M> emf;
    std::array<double, M> volt_values;
    std::array<double, M> emf_values;
    std::array<double, M> R_values;
    for (std::size_t k = 0; k < M; ++k) {
      volts[k] = is_signal(value_of(wanted[k])) ? wanted[k] : Scalar(0.0);
      emf[k] = is_signal(value_of(speeds[k])) ? Scalar(speeds[k] / motors[k].Kv) : Scalar(0.0);
      volt_values[k] = value_of(volts[k]);
      emf_values[k] = value_of(emf[k]);
      R_values[k] = value_of(R[k]);
    }
    PowerFlow<M, Scalar> result;
    const double rail = detail::rail_under_load(battery, motors, R_values, emf_values, volt_values);
    result.rail = Scalar(rail);
    if constexpr (!std::is_same_v<Scalar, double>) {
      if (rail > 0.0 && battery.resistance > 0.0) {
        // Newton's step in numbers with derivatives gives the implicit function's: the first
        // order at once, the second with the second step.
        using Slope = Dual<1>;
        std::array<Slope, M> volt_constants;
        std::array<Slope, M> emf_constants;
        std::array<Slope, M> R_constants;
        for (std::size_t k = 0; k < M; ++k) {
          volt_constants[k] = Slope(volt_values[k]);
          emf_constants[k] = Slope(emf_values[k]);
          R_constants[k] = Slope(R_values[k]);
        }
        const Slope along = detail::rail_excess<Slope>(battery, motors, R_constants, emf_constants,
                                                       volt_constants, Slope::variable(rail, 0, 1));
        for (int step = 0; step < 2; ++step) {
          result.rail -= detail::rail_excess<Scalar>(battery, motors, R, emf, volts, result.rail) /
                         along.gradient(0);
        }
      }
    }
    result.battery_current = Scalar(battery.other_current);
    for (std::size_t k = 0; k < M; ++k) {
      const Scalar& V = result.voltage[k] =
          allowed_voltage(motors[k].limits, R[k], emf[k], volts[k], result.rail);
      result.current[k] = (V - emf[k]) / R[k];
      result.supply[k] = rail > 0.0 ? Scalar(V * result.current[k] / result.rail) : Scalar(0.0);
      result.battery_current += result.supply[k];
    }
    return result;
  }
};

/// The robot's controller in low voltage: below one voltage it switches the motors off, and on
/// again only above another. Run-time object: noexcept, allocation-free.
class Brownout {
 public:
  /// The defaults are the roboRIO 2's 6.75 V (the first one's is 6.3 V) and 7.5 V.
  /// @param threshold  V, below which motors are switched off. @param recovery  V, above which they
  /// are on again; not below the threshold.
  explicit Brownout(double threshold = 6.75, double recovery = 7.5) noexcept
      : threshold_(threshold), recovery_(recovery > threshold ? recovery : threshold) {}

  /// @param rail  V, measured now; what is no number changes nothing.
  /// @return Whether the motors may be driven.
  bool update(double rail) noexcept {
    if (rail < threshold_) {
      count_ += enabled_ ? 1 : 0;
      enabled_ = false;
    } else if (rail > recovery_) {
      enabled_ = true;
    }
    return enabled_;
  }
  [[nodiscard]] bool enabled() const noexcept { return enabled_; }
  /// How often it switched off.
  [[nodiscard]] int count() const noexcept { return count_; }

 private:
  double threshold_;
  double recovery_;
  bool enabled_ = true;
  int count_ = 0;
};

}  // namespace flyball::mechanisms
