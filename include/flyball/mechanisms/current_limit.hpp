#pragma once

#include <cmath>

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
  const double back = flyball::detail::signal_or_zero(omega) / motor.Kv;
  const double most = I_max > 0.0 ? flyball::detail::signal_or_zero(I_max) * motor.R : 0.0;
  const double wanted = flyball::detail::signal_or_zero(voltage);
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
  const double omega = motor.Kv * (flyball::detail::signal_or_zero(applied) -
                                   flyball::detail::signal_or_zero(current) * motor.R);
  return limit_predicted_current(motor, voltage, omega, I_max);
}

/// The voltage nearest to `voltage` with which a motor at this speed draws at most I_max from the
/// battery, V (V - e)/(R V_rail) <= I_max; what it feeds back is not limited. It is reduced before
/// the current is exceeded.
/// @param rail  V, of the battery now. @param I_max  A, of all motors together.
/// @return  V, finite whatever comes. Source: book, section 12.1.3 (predictive), for the supply.
[[nodiscard]] inline double limit_predicted_supply_current(const DcMotor& motor, double voltage,
                                                           double omega, double rail,
                                                           double I_max) noexcept {
  const double half = 0.5 * flyball::detail::signal_or_zero(omega) / motor.Kv;
  const double most = I_max > 0.0 ? flyball::detail::signal_or_zero(I_max) : 0.0;
  const double power = rail > 0.0 ? most * flyball::detail::signal_or_zero(rail) : 0.0;
  // V² - e V - R V_rail I_max = 0
  const double root = std::hypot(half, std::sqrt(motor.R * power));
  const double wanted = flyball::detail::signal_or_zero(voltage);
  return wanted > half + root ? half + root : wanted < half - root ? half - root : wanted;
}

/// The same by a current that was measured in the motor, from which ω = K_v V - I R K_v.
/// @param voltage  V, which is wanted. @param applied  V, under which the current was measured.
/// @param current  A, in the motor: of the supply's the rail's voltage over `applied` times.
[[nodiscard]] inline double limit_measured_supply_current(const DcMotor& motor, double voltage,
                                                          double applied, double current,
                                                          double rail, double I_max) noexcept {
  const double omega = motor.Kv * (flyball::detail::signal_or_zero(applied) -
                                   flyball::detail::signal_or_zero(current) * motor.R);
  return limit_predicted_supply_current(motor, voltage, omega, rail, I_max);
}

/// A current limit that lets a peak pass for a while, as fuses and motor controllers do: `peak`
/// until the current has been above `sustained` for `duration`, then `sustained` until it has been
/// below 0.95 of it. Run-time object: noexcept, allocation-free.
class PeakCurrentLimit {
 public:
  /// @param sustained  A. @param peak  A, not below that. @param duration  s. @param period  s, of
  /// the updates.
  PeakCurrentLimit(double sustained, double peak, double duration, double period) noexcept
      : sustained_(sustained),
        peak_(peak > sustained ? peak : sustained),
        duration_(duration),
        period_(period) {}

  /// @param current  A, measured now; its sign does not matter, and what is no number changes
  /// nothing: one lost sample does not give the peak back.
  /// @return The limit for the next period, A.
  double update(double current) noexcept {
    if (!is_signal(current)) {
      return limit();
    }
    const double size = std::abs(current);
    if (size > sustained_) {
      above_ += period_;
    } else if (size < 0.95 * sustained_) {
      above_ = 0.0;
      limiting_ = false;
    }
    // A hair for the sum of the periods.
    limiting_ = limiting_ || above_ > duration_ - 1e-9 * period_;
    return limit();
  }
  [[nodiscard]] double limit() const noexcept { return limiting_ ? sustained_ : peak_; }

 private:
  double sustained_;
  double peak_;
  double duration_;
  double period_;
  double above_ = 0.0;
  bool limiting_ = false;
};

}  // namespace flyball::mechanisms
