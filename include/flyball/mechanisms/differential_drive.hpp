#pragma once

#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/friction.hpp>
#include <flyball/mechanisms/motor.hpp>
#include <flyball/systems/model.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::mechanisms {

/// A drivetrain of two like sides as voltages (section 14.4): half the sum of the sides' voltages
/// drives it straight, half their difference (right less left) turns it,
///
///   (Vr + Vl)/2 = friction + kV_linear v + kA_linear dv/dt,    v = (vr + vl)/2,
///   (Vr − Vl)/2 = friction + kV_angular w + kA_angular dw/dt,  w = (vr − vl)/2.
///
/// The angular gains are those of a wheel's speed along the ground, w, as in Theorem 14.4.1; times
/// half the trackwidth they are those of the angular velocity ω = 2 w/trackwidth, as in Theorem
/// 14.5.1.
struct DriveGains {
  double kS_left = 0.0;     ///< V, against the left side's friction.
  double kS_right = 0.0;    ///< V
  double kV_linear = 0.0;   ///< V·s/m
  double kA_linear = 0.0;   ///< V·s²/m
  double kV_angular = 0.0;  ///< V·s/m
  double kA_angular = 0.0;  ///< V·s²/m
};

/// A differential drive in its sides' velocities: x = y = [vl, vr] (m/s), u = [Vl, Vr] (V).
///
/// As a ContinuousSystem it is the theorem's linear model; its derivative as a model
/// (`model.hpp`) holds the sides' friction too, dx/dt = A x + B (u - kS sgn(x)).
struct DifferentialDrive : ContinuousSystem<2, 2, 2> {
  double kS_left = 0.0;           ///< V
  double kS_right = 0.0;          ///< V
  double nominal_voltage = 12.0;  ///< V, what the motors are rated for.

  /// dx/dt with sliding friction, over a generic scalar. @param x  2 x 1. @param u  2 x 1.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    const Scalar vl = x(0);
    const Scalar vr = x(1);
    const Scalar left = u(0) - friction_voltage(kS_left, vl);
    const Scalar right = u(1) - friction_voltage(kS_right, vr);
    return Eigen::Vector<Scalar, 2>{A(0, 0) * vl + A(0, 1) * vr + B(0, 0) * left + B(0, 1) * right,
                                    A(1, 0) * vl + A(1, 1) * vr + B(1, 0) * left + B(1, 1) * right};
  }
  [[nodiscard]] ModelDescription description() const;
};

/// What a differential drive is made of. Wheels have no mass and do not slip.
struct DifferentialDriveParameters {
  DcMotor motor{};                      ///< Of one side, all its motors together.
  double left_gearing = 1.0;            ///< G_l, motor turns per wheel turn.
  double right_gearing = 1.0;           ///< G_r
  Mass mass{};                          ///< m, of the robot.
  Length wheel_radius{};                ///< r
  Length trackwidth{};                  ///< 2 r_b, between the sides' wheels.
  MomentOfInertia moment_of_inertia{};  ///< J, of the robot about the vertical axis.
};

/// C_1 = -G_l² K_t/(K_v R r²), C_2 = G_l K_t/(R r), C_3 and C_4 the same of the right side; with
/// the same p = 1/m + r_b²/J and q = 1/m - r_b²/J
///
///   A = [p C_1, q C_3; q C_1, p C_3],  B = [p C_2, q C_4; q C_2, p C_4].
///
/// @errors ArgumentError::not_positive, not_finite, out_of_range (motor count).
/// Source: book, Theorem 8.7.1, equations (12.28) to (12.36).
[[nodiscard]] Expected<DifferentialDrive> differential_drive(
    const DifferentialDriveParameters& parameters);

/// The same from identified gains: A = [A1, A2; A2, A1], B = [B1, B2; B2, B1] with
/// A1, A2 = -(kV_lin/kA_lin ± kV_ang/kA_ang)/2 and B1, B2 = (1/kA_lin ± 1/kA_ang)/2.
/// @errors ArgumentError::not_positive (kV, kA), out_of_range (kS), not_finite.
/// Source: book, Theorem 14.4.1.
[[nodiscard]] Expected<DifferentialDrive> differential_drive(const DriveGains& gains);

/// The gains of a drive, the inverse of the function above.
/// @errors ArgumentError::out_of_range for sides that are not alike (to 1e-9) and for what no gains
///         have (kA or kV not positive).
[[nodiscard]] Expected<DriveGains> drive_gains(const DifferentialDrive& drive);

/// The drive with its heading: x = y = [θ (rad, counter-clockwise), vl, vr], dθ/dt = (vr - vl)/
/// trackwidth. @errors ArgumentError::not_positive, not_finite for the trackwidth.
/// Source: book, Theorem 8.7.2.
[[nodiscard]] Expected<ContinuousSystem<3, 2, 3>> heading_drive(const DifferentialDrive& drive,
                                                                Length trackwidth);

/// The drive in the velocity of its middle and its angular velocity: x = y = [v (m/s), ω (rad/s)],
/// u = [Vl, Vr]. @errors As `differential_drive`, and for the trackwidth.
/// Source: book, Theorem 14.5.1, with the angular gains times half the trackwidth.
[[nodiscard]] Expected<ContinuousSystem<2, 2, 2>> linear_angular_drive(const DriveGains& gains,
                                                                       Length trackwidth);

/// The moment of inertia about the vertical axis that a drive's gains show,
/// J = m r_b² kA_angular/kA_linear: the same force at the wheels that gives the robot its
/// acceleration gives it, at r_b, its angular one.
/// @param mass  kg. @param trackwidth  2 r_b.
/// @errors ArgumentError::not_positive, not_finite.
/// Source: book, section 12.6.2, with the wheels' distance r_b from the centre where the print has
/// the wheels' radius.
[[nodiscard]] Expected<MomentOfInertia> moment_of_inertia(const DriveGains& gains, Mass mass,
                                                          Length trackwidth);

}  // namespace flyball::mechanisms
