#pragma once

#include <flyball/mechanisms/mechanism.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms {

/// What a turret is made of, or what steers a swerve module.
struct TurretParameters {
  DcMotor motor{};
  double gearing = 1.0;                 ///< Motor turns per turret turn (> 1 is a reduction).
  MomentOfInertia moment_of_inertia{};  ///< J about its axis, which is vertical.
};

/// x = [angle (rad), angular velocity (rad/s)], y = angle, u = voltage (V).
using Turret = Mechanism<2>;

/// A = [0 1; 0 -G² K_t/(K_v R J)], B = [0; G K_t/(R J)], C = [1 0], D = 0: an arm's model without
/// its gravity.
/// @errors ArgumentError::not_positive or not_finite for a parameter that is not.
/// Source: book, Theorem 6.11.1.
[[nodiscard]] Expected<Turret> turret(const TurretParameters& parameters);

/// The same model from identified gains: A = [0 1; 0 -kV/kA], B = [0; 1/kA].
/// @param gains  kV in V·s/rad and kA in V·s²/rad, both positive; kS in V, not negative; kG is not
/// used. @errors ArgumentError::not_positive, out_of_range, not_finite.
/// Source: book, Theorem 14.3.1.
[[nodiscard]] Expected<Turret> turret(const FeedforwardGains& gains);

/// `turret` as what steers a swerve module. @errors The same.
[[nodiscard]] Expected<Turret> swerve_steer(const TurretParameters& parameters);
/// The same from identified gains. @errors The same.
[[nodiscard]] Expected<Turret> swerve_steer(const FeedforwardGains& gains);

}  // namespace flyball::mechanisms
