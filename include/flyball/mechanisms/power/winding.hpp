#pragma once

#include <limits>

namespace flyball::mechanisms {

/// The windings of a motor as one warm body: C dT/dt = I² R(T) - (T - T_ambient)/R_th with
/// R(T) = R (1 + α (T - T_ambient)), all of one motor.
struct Winding {
  double heat_capacity = std::numeric_limits<double>::infinity();       ///< C, J/K.
  double thermal_resistance = std::numeric_limits<double>::infinity();  ///< R_th, K/W.
  double ambient = 25.0;    ///< °C, where it starts and the datasheet's R holds.
  double copper = 0.00393;  ///< α, 1/K.

  /// Whether anything is known of how warm it gets.
  [[nodiscard]] bool is_known() const noexcept {
    return heat_capacity < std::numeric_limits<double>::infinity();
  }
  /// R(T)/R, not below a tenth, over a generic scalar. @param temperature  °C
  template <class Scalar>
  [[nodiscard]] Scalar warmth(const Scalar& temperature) const {
    const Scalar by = 1.0 + copper * (temperature - ambient);
    return by > 0.1 ? by : Scalar(0.1);
  }
  /// dT/dt, K/s, over a generic scalar. @param temperature  °C. @param heat  I² R(T) of one motor,
  /// W.
  template <class Scalar>
  [[nodiscard]] Scalar rate(const Scalar& temperature, const Scalar& heat) const {
    return (heat - (temperature - ambient) / thermal_resistance) / heat_capacity;
  }
};

}  // namespace flyball::mechanisms
