#pragma once

#include <cmath>

#include <flyball/mechanisms/mechanism_kind.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::mechanisms {

/// g, standard gravity, m/s². The book's figures use 9.81.
inline constexpr double standard_gravity = 9.80665;

/// The feedforward model of section 14.2, in volts:
/// V = kS sgn(v) + kV v + kA a + gravity, where gravity is kG for an elevator and
/// kG cos(θ + angle_offset) for an arm. Units are V, V·s/unit, V·s²/unit, V with the unit m or rad.
struct FeedforwardGains {
  double kS = 0.0;            ///< V, against static friction.
  double kV = 0.0;            ///< V·s/unit, to hold a velocity.
  double kA = 0.0;            ///< V·s²/unit, to hold an acceleration; 0 if not determined.
  double kG = 0.0;            ///< V, to hold against gravity (an arm: when horizontal).
  double angle_offset = 0.0;  ///< rad, true angle from horizontal less the measured one (arms).

  /// The gravity term at a position, V. @param kind  Decides its form. @param position  m or rad.
  [[nodiscard]] double gravity_voltage(MechanismKind kind, double position) const noexcept {
    switch (kind) {
      case MechanismKind::flywheel:
        return 0.0;
      case MechanismKind::elevator:
        return kG;
      case MechanismKind::arm:
        return kG * std::cos(position + angle_offset);
    }
    return 0.0;
  }
};

/// A mechanism's linear model together with what is not linear in it.
///
/// As a ContinuousSystem it is the theorem's model, without gravity and static friction; they are a
/// disturbance that a feedforward cancels (6.9.3, 6.11.3).
template <int States>
struct Mechanism : ContinuousSystem<States, 1, 1> {
  MechanismKind kind = MechanismKind::flywheel;
  FeedforwardGains gains;         ///< The same model as voltages.
  double nominal_voltage = 12.0;  ///< V, what the motor is rated for.

  /// The acceleration that gravity and static friction add to the linear model, m/s² or rad/s²:
  /// -(kS sgn(v) + gravity(x)) / kA. At rest friction holds as much as it can and is left out.
  [[nodiscard]] double disturbance(double position, double velocity) const noexcept {
    const double friction = velocity > 0.0 ? gains.kS : velocity < 0.0 ? -gains.kS : 0.0;
    return -(friction + gains.gravity_voltage(kind, position)) / gains.kA;
  }
};

}  // namespace flyball::mechanisms
