#pragma once

#include <limits>

namespace flyball::mechanisms {

/// A battery behind its resistance, feeding a motor through a switching controller.
///
/// A duty cycle D puts D V_rail on the motor, whose current is (D V_rail - e)/R; the controller
/// draws D times that, so that V_rail = V_open - R_battery D (D V_rail - e)/R is linear in V_rail.
struct Battery {
  double open_circuit_voltage = 12.0;  ///< V
  double resistance = 0.0;             ///< Ω of battery and wiring; 0 does not sag.
  double other_current = 0.0;          ///< A that the rest of the robot draws.

  /// @param duty  In [-1, 1]. @param back_emf  V, at the motor. @param motor_resistance  Ω, all
  /// motors in parallel; infinite for a motor that draws nothing.
  /// @return V_rail, V, not negative, at most the largest double.
  [[nodiscard]] double rail_voltage(
      double duty, double back_emf,
      double motor_resistance = std::numeric_limits<double>::infinity()) const noexcept {
    const double share = resistance / motor_resistance;
    const double rail =
        (open_circuit_voltage - resistance * other_current + share * duty * back_emf) /
        (1.0 + share * duty * duty);
    constexpr double largest = std::numeric_limits<double>::max();
    return rail > 0.0 ? (rail < largest ? rail : largest) : 0.0;
  }
};

}  // namespace flyball::mechanisms
