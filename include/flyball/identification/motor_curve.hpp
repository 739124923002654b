#pragma once

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/identification/feedforward_fit.hpp>
#include <flyball/mechanisms/motor.hpp>

namespace flyball::identification {

/// A dynamometer's rows at one voltage, between stall and free speed.
struct MotorCurve {
  double voltage = 0.0;     ///< V
  Eigen::VectorXd speed;    ///< rad/s
  Eigen::VectorXd torque;   ///< N m
  Eigen::VectorXd current;  ///< A
};

/// The rotor held while its windings heat.
struct LockedRotor {
  Eigen::VectorXd time;     ///< s
  Eigen::VectorXd voltage;  ///< V, at the motor.
  Eigen::VectorXd torque;   ///< N m
  Eigen::VectorXd current;  ///< A
};

/// What a motor curve says.
struct MotorConstants {
  mechanisms::DcMotor motor{};     ///< With R, K_t, K_v of (12.4) to (12.6).
  GainEstimate R{};                ///< Ω
  GainEstimate Kt{};               ///< N m/A
  GainEstimate Kv{};               ///< rad/s/V
  double torque_deviation = 0.0;   ///< Root mean square off the straight line, over stall torque.
  double current_deviation = 0.0;  ///< The same of the current, over stall current.
};

/// What a locked rotor says.
struct LockedRotorConstants {
  GainEstimate R{};       ///< Ω, at the first row, before the windings are warm.
  GainEstimate Kt{};      ///< N m/A, τ = K_t I (12.2).
  Eigen::Index rows = 0;  ///< Used: from the first until the current has changed by a fifth.
  double R_rise = 0.0;    ///< Of R from the first row to the last that is used, as a share.
  /// J/K, of the windings: all that the motor took warms them, and copper's R rises by 0.393 % a
  /// kelvin; not determined where R does not rise beyond its scatter.
  GainEstimate heat_capacity{};
};

/// The constants of a motor from its curve: torque and current are straight lines of the speed
/// (12.1, 12.2), fitted by ordinary least squares; stall is where they meet ω = 0, free speed where
/// the torque is zero. Intervals are of 95 %, from the rows' scatter about the lines.
/// @errors ArgumentError::wrong_shape, not_finite, not_positive (voltage); IdentificationError::
/// too_short (fewer than three rows), singular (one speed), unphysical_gains (no torque at stall,
/// none that falls, a free current not between zero and the stall current).
/// Cost: O(rows). Source: book, section 12.1.2, equations 12.4 to 12.6.
[[nodiscard]] Expected<MotorConstants> fit_motor_curve(std::string_view name,
                                                       const MotorCurve& curve);

/// K_t by least squares through the origin; R = V/I as a line of time, at the first row, both until
/// the current has changed by a fifth: then the windings are warm, or burn. The errors of rows that
/// follow each other are correlated (Newey and West). The windings' heat capacity C is that of
/// R = R_0 (1 + α/C ∫ V I dt), α = 0.00393/K, the energy by the trapezoidal rule.
/// @errors as fit_motor_curve; at least five rows.
/// Cost: O(rows). Source: book, equations 12.1, 12.2 and 12.5.
[[nodiscard]] Expected<LockedRotorConstants> fit_locked_rotor(const LockedRotor& run);

}  // namespace flyball::identification
