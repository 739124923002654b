#pragma once

#include <cmath>

#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms {

/// Where a motor's power goes, W: electrical = copper + lost + shaft.
struct MotorPower {
  double electrical = 0.0;  ///< V I, from the controller; negative feeds back.
  double copper = 0.0;      ///< I² R, heat of the windings.
  double lost = 0.0;        ///< In iron, brushes and bearings: what is left.
  double shaft = 0.0;       ///< τ ω, at the shaft; negative brakes.

  /// Shaft over electrical power of a motor that drives, electrical over shaft power of one that
  /// brakes and feeds back; 0 where it does neither.
  [[nodiscard]] double efficiency() const noexcept {
    return electrical > 0.0 && shaft > 0.0   ? shaft / electrical
           : electrical < 0.0 && shaft < 0.0 ? electrical / shaft
                                             : 0.0;
  }
};

/// The powers of a motor (or all in a gearbox) at a speed under a voltage, by (12.1) and (12.2),
/// with the torque of the free current, K_t I_free, taken by friction: without load at free speed
/// nothing comes out. @param omega  rad/s. @param voltage  V. noexcept, allocation-free.
[[nodiscard]] inline MotorPower motor_power(const DcMotor& motor, double omega,
                                            double voltage) noexcept {
  const double current = motor.current(omega, voltage);
  const double friction = omega > 0.0   ? motor.free_current
                          : omega < 0.0 ? -motor.free_current
                                        : 0.0;
  MotorPower power;
  power.electrical = voltage * current;
  power.copper = current * current * motor.R;
  power.shaft = motor.Kt * (current - friction) * omega;
  power.lost = power.electrical - power.copper - power.shaft;
  return power;
}

/// The speed (rad/s) at which a motor's efficiency is largest under a voltage: with the currents
/// I_0 free and I_s = V/R stalled, at I = √(I_0 I_s). 0 for a voltage that does not overcome
/// friction.
/// @param voltage  V. Derivation: η = K_t (I - I_0)(V - I R) K_v/(V I) has dη/dI = 0 at I² = I_0
/// I_s.
[[nodiscard]] inline double most_efficient_speed(const DcMotor& motor, double voltage) noexcept {
  const double size = std::abs(voltage);
  const double stall = size / motor.R;
  if (!(stall > motor.free_current)) {
    return 0.0;
  }
  const double speed = motor.Kv * (size - motor.R * std::sqrt(motor.free_current * stall));
  return voltage < 0.0 ? -speed : speed;
}

/// The speed (rad/s) at which a motor's shaft gives the most power under a voltage: half of that
/// without load.
[[nodiscard]] inline double most_powerful_speed(const DcMotor& motor, double voltage) noexcept {
  const double speed = 0.5 * motor.Kv * (std::abs(voltage) - motor.R * motor.free_current);
  return speed > 0.0 ? (voltage < 0.0 ? -speed : speed) : 0.0;
}

}  // namespace flyball::mechanisms
