#pragma once

#include <flyball/mechanisms/mechanism.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms {

/// What drives a swerve module's wheel over the floor.
struct SwerveDriveParameters {
  DcMotor motor{};
  double gearing = 1.0;   ///< Motor turns per wheel turn (> 1 is a reduction).
  Mass mass{};            ///< What this wheel moves: the robot's mass over the number of modules.
  Length wheel_radius{};  ///< r
};

/// x = y = speed over the floor (m/s), u = voltage (V).
using SwerveDrive = Mechanism<1>;

/// A = -G² K_t / (K_v R r² m), B = G K_t / (R r m), C = 1, D = 0: the velocity of an elevator whose
/// drum is the wheel, without its gravity.
/// @errors ArgumentError::not_positive or not_finite for a parameter that is not.
/// Source: book, Theorem 6.9.1.
[[nodiscard]] Expected<SwerveDrive> swerve_drive(const SwerveDriveParameters& parameters);

/// The same model from identified gains: A = -kV/kA, B = 1/kA.
/// @param gains  kV in V·s/m and kA in V·s²/m, both positive; kS in V, not negative.
/// @errors ArgumentError::not_positive, out_of_range, not_finite.
[[nodiscard]] Expected<SwerveDrive> swerve_drive(const FeedforwardGains& gains);

}  // namespace flyball::mechanisms
