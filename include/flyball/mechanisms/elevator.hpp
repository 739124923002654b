#pragma once

#include <flyball/mechanisms/mechanism.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::mechanisms {

/// What an elevator is made of.
struct ElevatorParameters {
  DcMotor motor{};
  double gearing = 1.0;  ///< Motor turns per drum turn (> 1 is a reduction).
  Mass mass{};           ///< The carriage and what it carries.
  Length drum_radius{};
};

/// x = [position (m), velocity (m/s)], y = position, u = voltage (V).
using Elevator = Mechanism<2>;

/// A = [0 1; 0 -G² K_t/(R r² m K_v)], B = [0; G K_t/(R r m)], C = [1 0], D = 0; gravity is the
/// disturbance -g, held by R r m g/(G K_t) volts (section 6.9.3).
/// @errors ArgumentError::not_positive or not_finite for a motor count, gearing, mass or radius
/// that
///         is not.
/// Source: book, Theorem 6.9.1.
[[nodiscard]] Expected<Elevator> elevator(const ElevatorParameters& parameters);

/// The same model from identified gains: A = [0 1; 0 -kV/kA], B = [0; 1/kA].
/// @param gains  kV in V·s/m and kA in V·s²/m, both positive; kS in V, not negative; kG in V.
/// @errors ArgumentError::not_positive, out_of_range, not_finite.
/// Source: book, Theorem 14.3.1.
[[nodiscard]] Expected<Elevator> elevator(const FeedforwardGains& gains);

}  // namespace flyball::mechanisms
