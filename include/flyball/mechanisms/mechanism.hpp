#pragma once

#include <flyball/mechanisms/friction.hpp>
#include <flyball/mechanisms/gravity.hpp>
#include <flyball/mechanisms/mechanism_kind.hpp>
#include <flyball/systems/model.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::mechanisms {

/// The feedforward model of section 14.2, in volts:
/// V = kS sgn(v) + kV v + kA a + gravity, where gravity is kG for an elevator and
/// kG cos(θ + angle_offset) for an arm. Units are V, V·s/unit, V·s²/unit, V with the unit m or rad.
struct FeedforwardGains {
  double kS = 0.0;            ///< V, against static friction.
  double kV = 0.0;            ///< V·s/unit, to hold a velocity.
  double kA = 0.0;            ///< V·s²/unit, to hold an acceleration; 0 if not determined.
  double kG = 0.0;            ///< V, to hold against gravity (an arm: when horizontal).
  double angle_offset = 0.0;  ///< rad, true angle from horizontal less the measured one (arms).

  /// The gravity term at a position, V. @param kind  Decides its form. @param position  m or rad,
  /// over a generic scalar.
  template <class Position>
  [[nodiscard]] Position gravity_voltage(MechanismKind kind, const Position& position) const {
    return mechanisms::gravity_voltage(kind, kG, position, angle_offset);
  }
};

/// Names and units of a mechanism's states, input, output and gains.
[[nodiscard]] ModelDescription description_of(MechanismKind kind, const FeedforwardGains& gains);

/// A mechanism's linear model together with what is not linear in it.
///
/// As a ContinuousSystem it is the theorem's model, without gravity and static friction; they are a
/// disturbance that a feedforward cancels (6.9.3, 6.11.3). As a model (`model.hpp`) its derivative
/// holds them too: kA dv/dt = u - kS sgn(v) - kV v - gravity(x), with the gains as parameters. What
/// sticks is not a derivative; `FrictionMotion` and `MechanismPlant` hold it.
template <int States>
struct Mechanism : ContinuousSystem<States, 1, 1> {
  MechanismKind kind = MechanismKind::flywheel;
  FeedforwardGains gains;         ///< The same model as voltages.
  double nominal_voltage = 12.0;  ///< V, what the motor is rated for.

  /// The acceleration that gravity and static friction add to the linear model, m/s² or rad/s²:
  /// -(kS sgn(v) + gravity(x)) / kA. At rest friction holds as much as it can and is left out.
  [[nodiscard]] double disturbance(double position, double velocity) const noexcept {
    return -(friction_voltage(gains.kS, velocity) + gains.gravity_voltage(kind, position)) /
           gains.kA;
  }

  /// [kS, kV, kA, kG, angle_offset], as in the gains.
  [[nodiscard]] Eigen::Vector<double, 5> parameters() const {
    return {gains.kS, gains.kV, gains.kA, gains.kG, gains.angle_offset};
  }
  /// dx/dt with gravity and sliding friction, over a generic scalar. @param x  [velocity] of a
  /// flywheel, [position, velocity]. @param u  V. @param p  The parameters.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using Scalar = ScalarOf<X, U, P>;
    const Scalar v = x(States - 1);
    const Scalar gravity = mechanisms::gravity_voltage(kind, p(3), x(0), p(4));
    const Scalar acceleration = (u(0) - friction_voltage(p(0), v) - p(1) * v - gravity) / p(2);
    if constexpr (States == 1) {
      return Eigen::Vector<Scalar, 1>{acceleration};
    } else {
      return Eigen::Vector<Scalar, 2>{v, acceleration};
    }
  }
  /// The same with its own gains.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, parameters());
  }
  [[nodiscard]] ModelDescription description() const { return description_of(kind, gains); }
};

}  // namespace flyball::mechanisms
