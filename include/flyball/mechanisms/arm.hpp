#pragma once

#include <flyball/mechanisms/mechanism.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms {

/// What a single-jointed arm is made of.
struct ArmParameters {
  DcMotor motor{};
  double gearing = 1.0;                 ///< Motor turns per arm turn (> 1 is a reduction).
  MomentOfInertia moment_of_inertia{};  ///< J about the joint.
  Mass mass{};                          ///< For gravity; zero for an arm that is counterbalanced.
  Length center_of_mass{};              ///< Its distance from the joint.
};

/// x = [angle (rad), angular velocity (rad/s)], y = angle, u = voltage (V); zero is horizontal.
using Arm = Mechanism<2>;

/// A = [0 1; 0 -G² K_t/(K_v R J)], B = [0; G K_t/(R J)], C = [1 0], D = 0; gravity is the
/// disturbance -m g l cos θ / J, held by R m g l cos θ / (G K_t) volts (section 6.11.3).
/// @errors ArgumentError::not_positive, out_of_range or not_finite for a parameter that is not.
/// Source: book, Theorem 6.11.1.
[[nodiscard]] Expected<Arm> arm(const ArmParameters& parameters);

/// The same model from identified gains: A = [0 1; 0 -kV/kA], B = [0; 1/kA].
/// @param gains  kV in V·s/rad and kA in V·s²/rad, both positive; kS in V, not negative; kG in V.
/// @errors ArgumentError::not_positive, out_of_range, not_finite.
/// Source: book, Theorem 14.3.1.
[[nodiscard]] Expected<Arm> arm(const FeedforwardGains& gains);

}  // namespace flyball::mechanisms
