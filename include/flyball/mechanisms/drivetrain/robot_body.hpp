#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/drivetrain/tire.hpp>
#include <flyball/mechanisms/gravity.hpp>
#include <flyball/mechanisms/motor.hpp>
#include <flyball/systems/model.hpp>

namespace flyball::mechanisms {

/// A robot on the floor, without what turns in it.
struct RobotBody {
  Mass mass{};
  MomentOfInertia moment_of_inertia{};  ///< J, about the vertical axis through the centre of mass.
  Eigen::Vector2d center_of_mass = Eigen::Vector2d::Zero();  ///< m, in the robot's frame.
};

/// What turns one wheel, or several that are chained together.
struct DriveShaft {
  DcMotor motor{};       ///< All motors of the shaft together.
  double gearing = 1.0;  ///< Motor turns per wheel turn.
  MomentOfInertia
      moment_of_inertia{};  ///< At the wheel: wheels, gears and, times gearing², rotors.
  double friction = 0.0;    ///< N m at the wheel, Coulomb's, smooth about standstill.
  double damping = 0.0;     ///< N m s/rad at the wheel.
};

namespace detail {

/// A DriveShaft in plain numbers.
struct Shaft {
  double R = 0.0;        ///< Ω
  double Kt = 0.0;       ///< N m/A
  double Kv = 0.0;       ///< rad/s/V
  double gearing = 1.0;  ///< Motor turns per turn.
  double inertia = 0.0;  ///< kg m²
  double friction = 0.0;
  double damping = 0.0;

  /// rad/s, within which Coulomb's friction changes its sign: friction · tanh(Ω/this).
  static constexpr double friction_width = 0.5;

  /// Of the motor over the gearing less what friction takes, N m at the wheel.
  template <class Scalar>
  [[nodiscard]] Scalar torque(const Scalar& Omega, const Scalar& voltage) const {
    using std::tanh;
    const Scalar current = (voltage - gearing * Omega / Kv) / R;
    Scalar torque = gearing * Kt * current - damping * Omega;
    if (friction > 0.0) {
      torque -= friction * tanh(Scalar(Omega / friction_width));
    }
    return torque;
  }
};

/// @param may_be_massless  Whether an inertia of zero will do.
/// @errors ArgumentError: as `check_drive`; inertia not positive, friction or damping negative.
[[nodiscard]] Expected<Shaft> checked_shaft(const DriveShaft& shaft, std::string_view where,
                                            std::string_view name, bool may_be_massless = false);
/// @errors ArgumentError: mass or J not positive, the centre of mass not finite.
[[nodiscard]] Expected<void> check_body(const RobotBody& body, std::string_view where);
/// @errors ArgumentError: friction, stiffness, rest speed not positive, shape not in [1, 2].
[[nodiscard]] Expected<void> check_tire(const Tire& tire, std::string_view where);

/// How much of the weight each wheel carries: of all that balance the centre of mass the most even
/// (least squares). @errors ArgumentError::out_of_range where none is that presses every wheel to
/// the floor.
[[nodiscard]] Expected<std::vector<double>> load_shares(std::span<const Eigen::Vector2d> wheels,
                                                        const Eigen::Vector2d& center_of_mass,
                                                        std::string_view where);

/// The first six states' rates: of the pose (x, y, θ) and of (vx, vy, ω), those of the robot's
/// origin in its own frame, under a force (N) and a moment about the centre of mass c (N m):
///
///     J dω/dt = M,   m (dv/dt + ω × v + dω/dt × c + ω × (ω × c)) = F.
template <class Scalar, class X, class M, class J>
[[nodiscard]] Eigen::Vector<Scalar, 6> body_rates(const X& x, const Eigen::Vector<Scalar, 2>& force,
                                                  const Scalar& moment, const M& mass,
                                                  const J& inertia, const Eigen::Vector2d& c) {
  using std::cos;
  using std::sin;
  const Scalar cos_theta = cos(Scalar(x(2)));
  const Scalar sin_theta = sin(Scalar(x(2)));
  const Scalar vx = x(3);
  const Scalar vy = x(4);
  const Scalar omega = x(5);
  const Scalar alpha = moment / inertia;
  return {cos_theta * vx - sin_theta * vy,
          sin_theta * vx + cos_theta * vy,
          omega,
          force(0) / mass + omega * vy + alpha * c(1) + omega * omega * c(0),
          force(1) / mass - omega * vx - alpha * c(0) + omega * omega * c(1),
          alpha};
}

/// Names of those six.
[[nodiscard]] std::vector<Coordinate> body_coordinates();

}  // namespace detail

}  // namespace flyball::mechanisms
