#pragma once

#include <flyball/core/signal.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms {

/// The voltage nearest to `voltage` that keeps a motor's current at this speed within ±I_max:
/// ω/K_v - I_max R <= V <= ω/K_v + I_max R. It is reduced before the current is exceeded.
/// @param voltage  V. @param omega  Of the motor, rad/s. @param I_max  A, of all motors together;
/// below 0 it is taken for 0.
/// @return  V, finite whatever comes.
/// Source: book, Snippet 12.1 (predictive), for both signs of the current.
[[nodiscard]] inline double limit_predicted_current(const DcMotor& motor, double voltage,
                                                    double omega, double I_max) noexcept {
  const double back = detail::signal_or_zero(omega) / motor.Kv;
  const double most = I_max > 0.0 ? detail::signal_or_zero(I_max) * motor.R : 0.0;
  const double wanted = detail::signal_or_zero(voltage);
  return wanted > back + most ? back + most : wanted < back - most ? back - most : wanted;
}

/// The same by a current that was measured, from which ω = K_v V - I R K_v: it is reduced once the
/// current is exceeded.
/// @param voltage  V, which is wanted. @param applied  V, under which the current was measured.
/// @param current  A, of all motors together.
/// Source: book, Snippet 12.1 (reactive), for both signs of the current.
[[nodiscard]] inline double limit_measured_current(const DcMotor& motor, double voltage,
                                                   double applied, double current,
                                                   double I_max) noexcept {
  const double omega =
      motor.Kv * (detail::signal_or_zero(applied) - detail::signal_or_zero(current) * motor.R);
  return limit_predicted_current(motor, voltage, omega, I_max);
}

}  // namespace flyball::mechanisms
