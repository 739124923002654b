#pragma once

#include <array>
#include <cstddef>

#include <flyball/mechanisms/drivetrain/robot_body.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

namespace flyball::mechanisms {

/// A wheel of a drive whose wheels do not steer.
struct SlippingWheel {
  WheelMount mount{};        ///< Where it stands, and how it rolls; the rollers' angle too.
  bool has_rollers = false;  ///< Holds along its rollers' axis only (mecanum, omni).
  Length radius{};           ///< r
  std::size_t shaft = 0;     ///< Which shaft turns it, from 0.
};

/// What a drive of W wheels on S shafts is made of.
template <std::size_t W, std::size_t S>
struct WheeledDriveParameters {
  RobotBody body{};
  std::array<SlippingWheel, W> wheels{};
  std::array<DriveShaft, S> shafts{};
  Tire tire{};
};

/// A robot that slips: W wheels that do not steer, on S shafts that motors turn. A differential
/// drive of four or six wheels, a mecanum or an omni drive. Made by `wheeled_drive`,
/// `slipping_differential_drive`, `slipping_mecanum_drive`.
///
///     x = [x, y (m), θ (rad), vx, vy (m/s), ω (rad/s), Ω_1 … Ω_S (rad/s)],  u = [V_1 … V_S] (V),
///
/// v and ω those of the robot's origin in its own frame. The contact of the wheel at r_i moves with
/// v + ω × r_i, slides with that less r Ω d_i, and the floor holds it by `Tire`, a wheel with
/// rollers along their axis a_i only; with the loads N_i = share_i m g of the robot at rest (none
/// is moved by accelerations)
///
///     m dV_c/dt = Σ F_i,  J dω/dt = Σ (r_i - c) × F_i,
///     J_s dΩ_s/dt = G_s K_t (V_s - G_s Ω_s/K_v)/R - friction - Σ r F_i·d_i.
///
/// Its parameters are the mass, J, the tire's friction and stiffness.
/// Source: book, sections 11.4 to 11.6 and 12.1; the tire's, `Tire`.
template <std::size_t W, std::size_t S>
class WheeledDrive {
 public:
  /// The size of x.
  static constexpr int states() { return 6 + static_cast<int>(S); }
  /// The size of u, and how many motors it has.
  static constexpr int inputs() { return static_cast<int>(S); }

  /// A wheel in plain numbers.
  struct Contact {
    Eigen::Vector2d position;   ///< m
    Eigen::Vector2d direction;  ///< d
    Eigen::Vector2d axis;       ///< a, of the rollers.
    bool has_rollers;
    double radius;  ///< m
    double share;   ///< Of the weight.
    int shaft;
  };

  /// Of numbers that are known to be good; `wheeled_drive` checks them.
  WheeledDrive(const std::array<Contact, W>& contacts, const std::array<detail::Shaft, S>& shafts,
               const RobotBody& body, const Tire& tire) noexcept
      : contacts_(contacts),
        shafts_(shafts),
        tire_(tire),
        center_(body.center_of_mass),
        p_(body.mass.si(), body.moment_of_inertia.si(), tire.friction, tire.stiffness) {}

  /// [mass, moment of inertia, tire's friction, tire's stiffness].
  [[nodiscard]] const Eigen::Vector4d& parameters() const noexcept { return p_; }
  /// The shafts' numbers. @param motor  From 0.
  [[nodiscard]] const detail::Shaft& shaft(int motor) const noexcept {
    return shafts_[static_cast<std::size_t>(motor)];
  }
  /// G Ω, rad/s, over a generic scalar. @param motor  From 0.
  template <class X>
  [[nodiscard]] typename X::Scalar motor_speed(const X& x, int motor) const {
    return shaft(motor).gearing * x(6 + motor);
  }
  /// The floor's force on a wheel in the robot's frame, N, over a generic scalar.
  template <class X, class P>
  [[nodiscard]] auto wheel_force(const X& x, std::size_t wheel, const P& p) const {
    using Scalar = ScalarOf<X, P>;
    const Contact& at = contacts_[wheel];
    const Scalar rolling = at.radius * x(6 + at.shaft);
    const Eigen::Vector<Scalar, 2> sliding{
        x(3) - x(5) * at.position(1) - rolling * at.direction(0),
        x(4) + x(5) * at.position(0) - rolling * at.direction(1)};
    const Scalar load = at.share * standard_gravity * p(0);
    if (at.has_rollers) {
      const Scalar along = sliding(0) * at.axis(0) + sliding(1) * at.axis(1);
      const Scalar force = tire_.force_along(along, rolling, load, Scalar(p(2)), Scalar(p(3)));
      return Eigen::Vector<Scalar, 2>{force * at.axis(0), force * at.axis(1)};
    }
    return tire_.force(sliding, rolling, load, Scalar(p(2)), Scalar(p(3)));
  }
  /// dx/dt over a generic scalar. @param x  6 + S. @param u  S motors' voltages. @param p  The
  /// parameters. No allocation.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using Scalar = ScalarOf<X, U, P>;
    Eigen::Vector<Scalar, 2> force(Scalar(0.0), Scalar(0.0));
    Scalar moment(0.0);
    std::array<Scalar, S> torque;
    for (std::size_t s = 0; s < S; ++s) {
      const auto k = static_cast<Eigen::Index>(s);
      torque[s] = shafts_[s].torque(Scalar(x(6 + k)), Scalar(u(k)));
    }
    for (std::size_t i = 0; i < W; ++i) {
      const Contact& at = contacts_[i];
      const Eigen::Vector<Scalar, 2> F = wheel_force(x, i, p);
      force(0) += F(0);
      force(1) += F(1);
      moment += (at.position(0) - center_(0)) * F(1) - (at.position(1) - center_(1)) * F(0);
      torque[static_cast<std::size_t>(at.shaft)] -=
          at.radius * (F(0) * at.direction(0) + F(1) * at.direction(1));
    }
    Eigen::Vector<Scalar, 6 + static_cast<int>(S)> rate;
    rate.template head<6>() =
        detail::body_rates(x, force, moment, Scalar(p(0)), Scalar(p(1)), center_);
    for (std::size_t s = 0; s < S; ++s) {
      rate(6 + static_cast<Eigen::Index>(s)) = torque[s] / shafts_[s].inertia;
    }
    return rate;
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, p_);
  }
  /// Names and units; θ is an angle.
  [[nodiscard]] ModelDescription description() const {
    ModelDescription description{.name = "drive with slipping wheels",
                                 .states = detail::body_coordinates(),
                                 .parameters = {{"mass", "kg", p_(0)},
                                                {"moment_of_inertia", "kg·m²", p_(1)},
                                                {"friction", "", p_(2)},
                                                {"stiffness", "", p_(3)}}};
    for (std::size_t s = 1; s <= S; ++s) {
      description.states.push_back({"wheel speed " + std::to_string(s), "rad/s"});
      description.inputs.push_back({"voltage " + std::to_string(s), "V"});
    }
    description.outputs = description.states;
    return description;
  }

 private:
  std::array<Contact, W> contacts_;
  std::array<detail::Shaft, S> shafts_;
  Tire tire_;
  Eigen::Vector2d center_;
  Eigen::Vector4d p_;
};

namespace detail {

/// What `wheeled_drive` checks that does not need its sizes; the loads' shares.
/// @errors As `wheeled_drive`.
[[nodiscard]] Expected<std::vector<double>> check_wheeled_drive(
    const RobotBody& body, std::span<const SlippingWheel> wheels,
    std::span<const DriveShaft> shafts, const Tire& tire, std::string_view where);

}  // namespace detail

/// @errors ArgumentError::not_positive, not_finite for numbers that are not; out_of_range for a
///         wheel on no shaft, a shaft without wheels, rollers across the rolling direction, a
///         centre of mass that lifts a wheel.
template <std::size_t W, std::size_t S>
[[nodiscard]] Expected<WheeledDrive<W, S>> wheeled_drive(
    const WheeledDriveParameters<W, S>& parameters, std::string_view where = "wheeled_drive") {
  using Drive = WheeledDrive<W, S>;
  auto shares = detail::check_wheeled_drive(parameters.body, parameters.wheels, parameters.shafts,
                                            parameters.tire, where);
  if (!shares) {
    return tl::unexpected(std::move(shares).error());
  }
  std::array<detail::Shaft, S> shafts;
  for (std::size_t s = 0; s < S; ++s) {
    const DriveShaft& of = parameters.shafts[s];
    shafts[s] = {of.motor.R,  of.motor.Kt, of.motor.Kv, of.gearing, of.moment_of_inertia.si(),
                 of.friction, of.damping};
  }
  std::array<typename Drive::Contact, W> contacts;
  for (std::size_t i = 0; i < W; ++i) {
    const SlippingWheel& wheel = parameters.wheels[i];
    const Rotation2d rolling(wheel.mount.direction);
    const Rotation2d rollers(wheel.mount.direction + wheel.mount.roller_angle);
    contacts[i] = {wheel.mount.position,
                   {rolling.cos(), rolling.sin()},
                   {rollers.cos(), rollers.sin()},
                   wheel.has_rollers,
                   wheel.radius.si(),
                   (*shares)[i],
                   static_cast<int>(wheel.shaft)};
  }
  return Drive(contacts, shafts, parameters.body, parameters.tire);
}

/// Two sides of W/2 wheels each, chained together, at equal distances along the wheelbase.
struct SlippingDifferentialParameters {
  RobotBody body{};
  DriveShaft side{};  ///< Each side's; its inertia that of all its wheels.
  Length wheel_radius{};
  Length trackwidth{};
  Length wheelbase{};  ///< From the first to the last wheel of a side; zero for two wheels.
  Tire tire{};
};

/// A differential drive of W wheels (2, 4, 6, …) that slip: turning, all but the middle ones slide
/// across. Shafts: left, right. @errors As `wheeled_drive`; trackwidth or wheel radius not
/// positive, a wheelbase that is not where there are more than two wheels.
template <std::size_t W>
[[nodiscard]] Expected<WheeledDrive<W, 2>> slipping_differential_drive(
    const SlippingDifferentialParameters& parameters) {
  static_assert(W >= 2 && W % 2 == 0, "each side has as many wheels");
  constexpr std::string_view where = "slipping_differential_drive";
  const double length = parameters.wheelbase.si();
  if (Expected<void> checked = W > 2 ? check_positive(length, where, "wheelbase", "m")
                                     : check_not_negative(length, where, "wheelbase", "m");
      !checked) {
    return tl::unexpected(std::move(checked).error());
  }
  if (Expected<void> checked = check_positive(parameters.trackwidth.si(), where, "trackwidth", "m");
      !checked) {
    return tl::unexpected(std::move(checked).error());
  }
  WheeledDriveParameters<W, 2> made{.body = parameters.body,
                                    .shafts = {parameters.side, parameters.side},
                                    .tire = parameters.tire};
  for (std::size_t i = 0; i < W; ++i) {
    const auto along = static_cast<double>(i / 2);
    const double x = W > 2 ? length * (0.5 - along / static_cast<double>(W / 2 - 1)) : 0.0;
    const double y = (i % 2 == 0 ? 0.5 : -0.5) * parameters.trackwidth.si();
    made.wheels[i] = {
        .mount = {.position = {x, y}}, .radius = parameters.wheel_radius, .shaft = i % 2};
  }
  return wheeled_drive(made, where);
}

/// What a mecanum drive that slips is made of.
struct SlippingMecanumParameters {
  RobotBody body{};
  DriveShaft wheel{};  ///< Each wheel's.
  Length wheel_radius{};
  std::array<Eigen::Vector2d, 4>
      positions{};  ///< m: front left, front right, back left, back right.
  Tire tire{};
};

/// Four mecanum wheels whose rollers, seen from above, form an X, as `mecanum_kinematics`.
/// Shafts: front left, front right, back left, back right. @errors As `wheeled_drive`.
[[nodiscard]] Expected<WheeledDrive<4, 4>> slipping_mecanum_drive(
    const SlippingMecanumParameters& parameters);

}  // namespace flyball::mechanisms
