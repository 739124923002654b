#pragma once

#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball::mechanisms {

/// The five numbers of a motor's datasheet, for one motor.
struct MotorDatasheet {
  Voltage nominal_voltage{};
  Torque stall_torque{};
  Current stall_current{};
  Current free_current{};
  AngularVelocity free_speed{};
};

/// A DC brushed motor (or a brushless one behind its controller), or n of them in one gearbox.
///
/// V = I R + ω/K_v (12.1) and τ = K_t I (12.2). Identical motors in one gearbox share the speed and
/// add torque and current, so R is divided by n while K_t and K_v stay.
/// Source: book, section 12.1.
struct DcMotor {
  std::string name{};
  int count = 1;
  double nominal_voltage = 0.0;  ///< V
  double stall_torque = 0.0;     ///< N m, all motors together.
  double stall_current = 0.0;    ///< A, all motors together.
  double free_current = 0.0;     ///< A, all motors together.
  double free_speed = 0.0;       ///< rad/s

  double R = 0.0;   ///< Ω, of all motors in parallel: V/I_stall (12.5).
  double Kt = 0.0;  ///< N m/A: τ_stall/I_stall (12.4).
  double Kv = 0.0;  ///< rad/s/V: ω_free/(V - I_free R) (12.6).

  /// I = V/R - ω/(K_v R), amperes of all motors together (12.1), over a generic scalar.
  /// @param omega  rad/s
  template <class Omega, class Volts>
  [[nodiscard]] std::common_type_t<Omega, Volts> current(const Omega& omega,
                                                         const Volts& voltage) const {
    return voltage / R - omega / (Kv * R);
  }
  /// τ = K_t I, N m of all motors together (12.2), over a generic scalar.
  template <class Omega, class Volts>
  [[nodiscard]] std::common_type_t<Omega, Volts> torque(const Omega& omega,
                                                        const Volts& voltage) const {
    return Kt * current(omega, voltage);
  }
};

/// A motor from its datasheet. @param name  For messages. @param count  Motors in the gearbox.
/// @errors ArgumentError::not_positive, not_finite (a number, or R, K_t or K_v from them),
///         out_of_range (count < 1, a free current not below the stall current).
/// Source: book, equations 12.4 to 12.6.
[[nodiscard]] Expected<DcMotor> motor(std::string_view name, const MotorDatasheet& datasheet,
                                      int count = 1);

/// The table's motors of whose name, or one of its other names, the text is a part ("kraken").
[[nodiscard]] std::vector<std::string_view> motors_like(std::string_view part);

/// A motor of the table by name; case, spaces and punctuation do not matter ("krakenX60foc"). Words
/// that only one motor has are enough ("vortex"), parts of words are not: "NEO 5" is no NEO 550.
/// @errors ArgumentError::unknown_name with the nearest name, ambiguous_name with the candidates
///         ("kraken" fits four), out_of_range (count < 1).
[[nodiscard]] Expected<DcMotor> motor(std::string_view name, int count = 1);

/// A row of the motor table.
struct MotorTableEntry {
  std::string_view name;
  std::string_view aliases;  ///< Other names, separated by commas.
  double nominal_voltage;    ///< V
  double stall_torque;       ///< N m
  double stall_current;      ///< A
  double free_current;       ///< A
  double free_speed_rpm;     ///< rpm
};

/// Every motor that Flyball knows, by the manufacturers' datasheet numbers.
[[nodiscard]] std::span<const MotorTableEntry> motor_table();

// The motors of the table by function, for code that names them. A count below one gives a motor
// that every mechanism refuses.
[[nodiscard]] DcMotor cim(int count = 1);             ///< CIM
[[nodiscard]] DcMotor mini_cim(int count = 1);        ///< MiniCIM
[[nodiscard]] DcMotor bag(int count = 1);             ///< BAG
[[nodiscard]] DcMotor vex_775pro(int count = 1);      ///< VEX 775pro
[[nodiscard]] DcMotor neo(int count = 1);             ///< REV NEO
[[nodiscard]] DcMotor neo_550(int count = 1);         ///< REV NEO 550
[[nodiscard]] DcMotor neo_vortex(int count = 1);      ///< REV NEO Vortex
[[nodiscard]] DcMotor falcon_500(int count = 1);      ///< Falcon 500
[[nodiscard]] DcMotor falcon_500_foc(int count = 1);  ///< Falcon 500, field-oriented control
[[nodiscard]] DcMotor kraken_x60(int count = 1);      ///< Kraken X60
[[nodiscard]] DcMotor kraken_x60_foc(int count = 1);  ///< Kraken X60, field-oriented control
[[nodiscard]] DcMotor kraken_x44(int count = 1);      ///< Kraken X44
[[nodiscard]] DcMotor kraken_x44_foc(int count = 1);  ///< Kraken X44, field-oriented control
[[nodiscard]] DcMotor minion(int count = 1);          ///< CTRE Minion

}  // namespace flyball::mechanisms
