#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/study/drive.hpp>

/// The velocity loop of one wheel, on the floor and off it.
namespace flyball::study {

constexpr double usual_voltage = 12.0;  ///< V, the largest acceptable one (Bryson's rule).

/// What the mass of the robot is to the wheels' shafts: the wheels turn, too.
[[nodiscard]] double rolling_mass(const DriveRobot& robot, int shafts);
/// V against the motors' own friction.
[[nodiscard]] double friction_volts(const mechanisms::DcMotor& motor);

/// The velocity of one wheel of four: LQR and plant inversion of dv/dt = (V - kV v)/kA.
struct WheelLaw {
  double A = 0.0, B = 1.0;  ///< v_{k+1} = A v_k + B V
  double K = 0.0;           ///< V/(m/s)
  double kS = 0.0;          ///< V
  double limit = 12.0;      ///< V

  /// @errors Those of the model and of `lqr`.
  [[nodiscard]] static Expected<WheelLaw> create(const DriveJob& job);
  /// @param v, next  m/s, wanted now and a period later. @param saturated  Set where it wants more.
  [[nodiscard]] double volts(double measured, double v, double next,
                             bool& saturated) const noexcept;
};

/// A wheel that the floor no longer holds is lighter by far than the robot's share that its loop is
/// designed for: with v the wheel's surface, v_{k+1} = a v_k + b V, and the loop's pole is a - b k.
struct SpinningWheel {
  double a = 0.0, b = 1.0;

  [[nodiscard]] static SpinningWheel of(const DriveRobot& robot, double period) noexcept;
  /// Of the loop with a gain. @param k  V/(m/s).
  [[nodiscard]] double pole(double k) const noexcept { return a - b * k; }
};

/// V/(m/s), the most that the job's loops answer to the error of a wheel's speed.
/// @errors Those of the loops.
[[nodiscard]] Expected<double> wheel_gain(const DriveJob& job);

/// The least velocity tolerance from `least` on with which a spinning wheel's error at most halves
/// and alternates a period (its pole is at -1/2 or above). m/s, rounded up.
/// @errors Those of the loops.
[[nodiscard]] Expected<double> calm_velocity_tolerance(DriveJob job, double least);

}  // namespace flyball::study
