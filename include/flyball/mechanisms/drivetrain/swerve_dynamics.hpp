#pragma once

#include <array>
#include <cstddef>
#include <string>

#include <flyball/mechanisms/drivetrain/robot_body.hpp>

namespace flyball::mechanisms {

/// What a swerve drive of N modules is made of.
template <std::size_t N>
struct SwerveDynamicsParameters {
  RobotBody body{};  ///< J without the steering's inertias, the mass with everything.
  std::array<Eigen::Vector2d, N> positions{};  ///< m, of the modules in the robot's frame.
  Length wheel_radius{};
  DriveShaft drive{};  ///< Each module's; inertia at the wheel.
  DriveShaft steer{};  ///< Each module's; gearing and inertia at the steering axis.
  Tire tire{};
  Length patch_radius{};  ///< ρ, of the contact; zero for a wheel that steers on the spot freely.
};

/// A swerve drive with its modules' motors and what the floor does to its wheels. Made by
/// `swerve_dynamics`.
///
///     x = [x, y (m), θ (rad), vx, vy (m/s), ω (rad/s); δ_i (rad), dδ_i/dt (rad/s), Ω_i (rad/s),
///     …], u = [drive voltages V_1 … V_N, steer voltages V_1 … V_N] (V),
///
/// v and ω those of the robot's origin in its own frame, δ_i the module's direction in it. A
/// contact slides with v + ω × r_i - r Ω_i d(δ_i); the floor holds it by `Tire` with F_i, and a
/// contact of radius ρ that turns by ω + dδ_i/dt with M_i = ρ · the tire's force at a sliding of
/// ρ (ω + dδ_i/dt) (not counted within the friction circle of F_i). With τ_i the steering torques
/// between the robot and its modules
///
///     m dV_c/dt = Σ F_i,   J dω/dt = Σ (r_i - c) × F_i - Σ τ_i,
///     J_s (d²δ_i/dt² + dω/dt) = τ_i + M_i,   J_w dΩ_i/dt = τ_drive,i - r F_i·d(δ_i),
///     τ = G K_t (V - G Ω/K_v)/R - friction.
///
/// The loads are those of the robot at rest. Its parameters are the mass, J, the tire's friction
/// and stiffness.
/// Source: book, sections 11.7 and 12.1; the tire's, `Tire`.
template <std::size_t N>
class SwerveDynamics {
 public:
  static constexpr int modules = static_cast<int>(N);  ///< How many.
  /// The size of x.
  static constexpr int states() { return 6 + 3 * modules; }
  /// The size of u, and how many motors it has.
  static constexpr int inputs() { return 2 * modules; }
  /// Where a module's direction is among the states. @param i  From 0.
  static constexpr int angle_at(int i) { return 6 + 3 * i; }
  /// Where the rate of its direction is.
  static constexpr int steer_rate_at(int i) { return 7 + 3 * i; }
  /// Where its wheel's speed is.
  static constexpr int wheel_speed_at(int i) { return 8 + 3 * i; }

  /// Of numbers that are known to be good; `swerve_dynamics` checks them.
  SwerveDynamics(const SwerveDynamicsParameters<N>& parameters, const detail::Shaft& drive,
                 const detail::Shaft& steer, const std::array<double, N>& shares) noexcept
      : positions_(parameters.positions),
        shares_(shares),
        drive_(drive),
        steer_(steer),
        tire_(parameters.tire),
        center_(parameters.body.center_of_mass),
        radius_(parameters.wheel_radius.si()),
        patch_radius_(parameters.patch_radius.si()),
        p_(parameters.body.mass.si(), parameters.body.moment_of_inertia.si(),
           parameters.tire.friction, parameters.tire.stiffness) {}

  /// [mass, moment of inertia, tire's friction, tire's stiffness].
  [[nodiscard]] const Eigen::Vector4d& parameters() const noexcept { return p_; }
  /// m.
  [[nodiscard]] double wheel_radius() const noexcept { return radius_; }
  /// m, in the robot's frame.
  [[nodiscard]] const std::array<Eigen::Vector2d, N>& positions() const noexcept {
    return positions_;
  }
  /// The shafts' numbers. @param motor  From 0: the drive motors, then the steer motors.
  [[nodiscard]] const detail::Shaft& shaft(int motor) const noexcept {
    return motor < modules ? drive_ : steer_;
  }
  /// Of a motor, rad/s, over a generic scalar. @param motor  As above.
  template <class X>
  [[nodiscard]] typename X::Scalar motor_speed(const X& x, int motor) const {
    return motor < modules ? shaft(motor).gearing * x(wheel_speed_at(motor))
                           : shaft(motor).gearing * x(steer_rate_at(motor - modules));
  }
  /// dx/dt over a generic scalar. @param x  6 + 3N. @param u  2N. @param p  The parameters.
  /// No allocation.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using std::cos;
    using std::sin;
    using Scalar = ScalarOf<X, U, P>;
    Eigen::Vector<Scalar, 6 + 3 * modules> rate;
    Eigen::Vector<Scalar, 2> force(Scalar(0.0), Scalar(0.0));
    Scalar moment(0.0);
    std::array<Scalar, N> turning;  // τ_i + M_i
    for (int i = 0; i < modules; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Eigen::Vector2d& r = positions_[k];
      const Scalar cos_delta = cos(Scalar(x(angle_at(i))));
      const Scalar sin_delta = sin(Scalar(x(angle_at(i))));
      const Scalar rolling = radius_ * x(wheel_speed_at(i));
      const Scalar load = shares_[k] * standard_gravity * p(0);
      const Eigen::Vector<Scalar, 2> sliding{x(3) - x(5) * r(1) - rolling * cos_delta,
                                             x(4) + x(5) * r(0) - rolling * sin_delta};
      const Eigen::Vector<Scalar, 2> F =
          tire_.force(sliding, rolling, load, Scalar(p(2)), Scalar(p(3)));
      const Scalar steering = steer_.torque(Scalar(x(steer_rate_at(i))), Scalar(u(modules + i)));
      turning[k] = steering;
      if (patch_radius_ > 0.0) {
        const Scalar edge = patch_radius_ * (x(5) + x(steer_rate_at(i)));
        turning[k] +=
            patch_radius_ * tire_.force_along(edge, rolling, load, Scalar(p(2)), Scalar(p(3)));
      }
      force(0) += F(0);
      force(1) += F(1);
      moment += (r(0) - center_(0)) * F(1) - (r(1) - center_(1)) * F(0) - steering;
      rate(angle_at(i)) = x(steer_rate_at(i));
      rate(wheel_speed_at(i)) = (drive_.torque(Scalar(x(wheel_speed_at(i))), Scalar(u(i))) -
                                 radius_ * (F(0) * cos_delta + F(1) * sin_delta)) /
                                drive_.inertia;
    }
    rate.template head<6>() =
        detail::body_rates(x, force, moment, Scalar(p(0)), Scalar(p(1)), center_);
    for (int i = 0; i < modules; ++i) {
      rate(steer_rate_at(i)) = turning[static_cast<std::size_t>(i)] / steer_.inertia - rate(5);
    }
    return rate;
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, p_);
  }
  /// Names and units; θ and the modules' directions are angles.
  [[nodiscard]] ModelDescription description() const {
    ModelDescription description{.name = "swerve drive",
                                 .states = detail::body_coordinates(),
                                 .parameters = {{"mass", "kg", p_(0)},
                                                {"moment_of_inertia", "kg·m²", p_(1)},
                                                {"friction", "", p_(2)},
                                                {"stiffness", "", p_(3)}}};
    for (std::size_t i = 1; i <= N; ++i) {
      const std::string number = " " + std::to_string(i);
      description.states.push_back({"module angle" + number, "rad", true});
      description.states.push_back({"steer rate" + number, "rad/s"});
      description.states.push_back({"wheel speed" + number, "rad/s"});
      description.inputs.push_back({"drive voltage" + number, "V"});
    }
    for (std::size_t i = 1; i <= N; ++i) {
      description.inputs.push_back({"steer voltage " + std::to_string(i), "V"});
    }
    description.outputs = description.states;
    return description;
  }

 private:
  std::array<Eigen::Vector2d, N> positions_;
  std::array<double, N> shares_;
  detail::Shaft drive_;
  detail::Shaft steer_;
  Tire tire_;
  Eigen::Vector2d center_;
  double radius_;
  double patch_radius_;
  Eigen::Vector4d p_;
};

namespace detail {

/// A swerve drive's parts in plain numbers.
struct SwerveParts {
  Shaft drive;
  Shaft steer;
  std::vector<double> shares;
};
/// What `swerve_dynamics` checks. @errors As there.
[[nodiscard]] Expected<SwerveParts> check_swerve_dynamics(
    const RobotBody& body, std::span<const Eigen::Vector2d> positions, const DriveShaft& drive,
    const DriveShaft& steer, const Tire& tire, Length wheel_radius, Length patch_radius);

}  // namespace detail

/// @errors ArgumentError::not_positive, not_finite for numbers that are not; out_of_range for
///         modules in one place, and a centre of mass that lifts a wheel.
template <std::size_t N>
[[nodiscard]] Expected<SwerveDynamics<N>> swerve_dynamics(
    const SwerveDynamicsParameters<N>& parameters) {
  return detail::check_swerve_dynamics(parameters.body, parameters.positions, parameters.drive,
                                       parameters.steer, parameters.tire, parameters.wheel_radius,
                                       parameters.patch_radius)
      .map([&](const detail::SwerveParts& parts) {
        std::array<double, N> shares;
        for (std::size_t i = 0; i < N; ++i) {
          shares[i] = parts.shares[i];
        }
        return SwerveDynamics<N>(parameters, parts.drive, parts.steer, shares);
      });
}

}  // namespace flyball::mechanisms
