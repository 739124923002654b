#include <flyball/mechanisms/powertrain.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <flyball/core/argument.hpp>
#include <flyball/mechanisms/gravity.hpp>

#include "core/try.hpp"
#include "mechanisms/motor_checks.hpp"

namespace flyball::mechanisms {

namespace {

/// The current I >= 0 with (e + R I) I = P.
double current_of_power(double P, double e, double R) noexcept {
  const double root = std::sqrt(e * e + 4.0 * R * P);
  // Without cancellation where e is positive.
  return e > 0.0 ? 2.0 * P / (e + root) : (root - e) / (2.0 * R);
}

/// V, with nothing drawn by this drive.
double idle_rail(const Battery& battery) noexcept {
  return battery.open_circuit_voltage - battery.resistance * battery.other_current;
}

/// What comes from the battery for a power at the rail. @param V  Its idle voltage.
void add_supply(MotorPoint& point, double V, double resistance) noexcept {
  const double P = point.power();
  const double root = std::sqrt(std::max(0.0, V * V - 4.0 * resistance * P));
  point.rail = 0.5 * (V + root);
  point.supply_current = point.rail > 0.0 ? P / point.rail : 0.0;
}

}  // namespace

std::string_view to_string(PowerBound bound) {
  switch (bound) {
    case PowerBound::voltage:
      return "the voltage limit";
    case PowerBound::rail:
      return "the battery's voltage";
    case PowerBound::battery:
      return "the battery's power";
    case PowerBound::stator:
      return "the stator limit";
    case PowerBound::supply:
      return "the supply limit";
    case PowerBound::grip:
      return "the wheels' grip";
  }
  return "";
}

MotorPoint strongest_push(const DcMotor& motor, const PowerLimits& limits, double omega,
                          int direction, double R) noexcept {
  const double V = idle_rail(limits.battery);
  const double Rb = limits.battery.resistance;
  const double e = direction * omega / motor.Kv;
  double I = limits.stator_current;
  PowerBound bound = PowerBound::stator;
  const auto take = [&](double current, PowerBound by) {
    if (current < I) {
      I = current;
      bound = by;
    }
  };
  take((limits.voltage - e) / R, PowerBound::voltage);
  const double full = (V - e) / (R + Rb);
  if (V - Rb * full >= 0.5 * V) {
    take(full, PowerBound::rail);
  } else if (Rb > 0.0) {
    take(current_of_power(V * V / (4.0 * Rb), e, R), PowerBound::battery);
  }
  if (std::isfinite(limits.supply_current)) {
    // More than half of V_open/R_b is never the better way to draw.
    const double drawn =
        Rb > 0.0 ? std::min(limits.supply_current, 0.5 * V / Rb) : limits.supply_current;
    take(current_of_power(std::max(0.0, (V - Rb * drawn) * drawn), e, R), PowerBound::supply);
  }
  MotorPoint point = push_with(motor, limits, omega, direction, R, direction * I);
  point.bound = bound;
  return point;
}

MotorPoint push_with(const DcMotor& motor, const PowerLimits& limits, double omega, int direction,
                     double R, double current) noexcept {
  MotorPoint point;
  point.current = direction * std::max(0.0, direction * current);
  point.voltage = omega / motor.Kv + R * point.current;
  add_supply(point, idle_rail(limits.battery), limits.battery.resistance);
  return point;
}

double GearedLoad::weight(double position) const noexcept {
  return gravity_voltage(kind, gravity, position, angle_offset);
}

double GearedLoad::greatest_weight(double from, double to) const noexcept {
  if (kind != MechanismKind::arm) {
    return has_gravity(kind) ? std::abs(gravity) : 0.0;
  }
  const double low = std::min(from, to) + angle_offset;
  const double high = std::max(from, to) + angle_offset;
  // |cos| is one at whole half turns; without one in between it is greatest at an end.
  const bool passes = std::ceil(low / std::numbers::pi) <= std::floor(high / std::numbers::pi);
  return std::abs(gravity) *
         (passes ? 1.0 : std::max(std::abs(std::cos(low)), std::abs(std::cos(high))));
}

double GearedLoad::acceleration(double position, int direction, double current) const noexcept {
  const double k = ratio();
  const double shaft = motor.Kt * current - direction * motor_friction;
  const double outside = -weight(position) - direction * friction;
  // Which way the power goes through the gears does not depend on their losses: the sign of
  // K_t I - τ_f - J_r k a is that of M (K_t I - τ_f) - J_r k (outside).
  const double through = inertia * shaft - rotor_inertia * k * outside;
  const double eta = through * direction >= 0.0 ? efficiency : 1.0 / efficiency;
  return (eta * k * shaft + outside) / (inertia + eta * rotor_inertia * k * k);
}

double GearedLoad::slipping_current(int direction, int push) const noexcept {
  if (!std::isfinite(grip)) {
    return grip;
  }
  const double k = ratio();
  // F = ±grip through the gears gives the acceleration that the rotors follow.
  const double F = push * grip;
  const double a = (F - direction * friction) / inertia;
  const double eta = push == direction ? efficiency : 1.0 / efficiency;
  const double shaft = F / (eta * k) + rotor_inertia * k * a;
  return std::max(0.0, push * (shaft + direction * motor_friction) / motor.Kt);
}

Expected<void> check_load(const GearedLoad& load, std::string_view where) {
  FLYBALL_CHECK(check_drive(load.motor, load.gearing, where));
  FLYBALL_CHECK(Checks(where)
                    .positive(load.radius, "the radius", "m")
                    .positive(load.inertia, "the inertia")
                    .not_negative(load.rotor_inertia, "the rotors' inertia", "kg·m²")
                    .finite(load.gravity, "gravity")
                    .finite(load.angle_offset, "angle_offset")
                    .not_negative(load.friction, "friction")
                    .not_negative(load.motor_friction, "the motors' friction", "N·m")
                    .positive(load.efficiency, "efficiency"));
  if (load.efficiency > 1.0) {
    return refusal(ArgumentError::out_of_range, where, "efficiency")
        .got(format_number(load.efficiency))
        .expected("at most 1: gears lose power")
        .hint("90 % is 0.9");
  }
  if (!(load.grip > 0.0)) {
    return refusal(ArgumentError::not_positive, where, "grip")
        .got(format_number(load.grip) + " N")
        .expected("positive");
  }
  return {};
}

Expected<void> check_limits(const PowerLimits& limits, std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .positive(limits.voltage, "the voltage limit", "V")
                    .positive(limits.battery.open_circuit_voltage, "open_circuit_voltage", "V")
                    .not_negative(limits.battery.resistance, "the battery's resistance", "Ω")
                    .not_negative(limits.battery.other_current, "other_current", "A"));
  for (const auto& [value, name] : {std::pair{limits.stator_current, "the stator limit"},
                                    std::pair{limits.supply_current, "the supply limit"}}) {
    if (!(value > 0.0)) {
      return refusal(ArgumentError::not_positive, where, name)
          .got(format_number(value) + " A")
          .expected("positive");
    }
  }
  if (const double V = idle_rail(limits.battery); !(V > 0.0)) {
    return refusal(ArgumentError::out_of_range, where, "the battery")
        .got("left with " + format_number(V) + " V by what else is drawn")
        .expected("above 0 V")
        .hint("lower size.other_current or battery.resistance");
  }
  return {};
}

}  // namespace flyball::mechanisms
