#pragma once

#include <flyball/mechanisms/mechanism.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms {

/// What a flywheel is made of.
struct FlywheelParameters {
  DcMotor motor{};
  double gearing = 1.0;                 ///< Motor turns per flywheel turn (> 1 is a reduction).
  MomentOfInertia moment_of_inertia{};  ///< J at the flywheel.
};

/// x = y = angular velocity (rad/s), u = voltage (V).
using Flywheel = Mechanism<1>;

/// A = -G² K_t / (K_v R J), B = G K_t / (R J), C = 1, D = 0.
/// @errors ArgumentError::not_positive or not_finite for a motor count, gearing or inertia that is
/// not. Source: book, Theorem 6.10.1.
[[nodiscard]] Expected<Flywheel> flywheel(const FlywheelParameters& parameters);

/// The flywheel whose current is measured and whose speed is not: x = angular velocity (rad/s),
/// y = current of all motors (A), u = voltage (V). A and B as above, C = -G/(K_v R), D = 1/R: the
/// speed can be estimated from it. The book's C has no G, as if the flywheel were on the motor's
/// shaft. @errors As above. Source: book, Theorem 6.10.2.
[[nodiscard]] Expected<ContinuousSystem<1, 1, 1>> flywheel_without_encoder(
    const FlywheelParameters& parameters);

/// The same model from identified gains: A = -kV/kA, B = 1/kA (section 14.3).
/// @param gains  kV in V·s/rad and kA in V·s²/rad, both positive; kS in V, not negative.
/// @errors ArgumentError::not_positive, out_of_range, not_finite.
[[nodiscard]] Expected<Flywheel> flywheel(const FeedforwardGains& gains);

/// `flywheel` as a roller of an intake or an indexer. @errors The same.
[[nodiscard]] Expected<Flywheel> roller(const FlywheelParameters& parameters);
/// The same from identified gains. @errors The same.
[[nodiscard]] Expected<Flywheel> roller(const FeedforwardGains& gains);

}  // namespace flyball::mechanisms
