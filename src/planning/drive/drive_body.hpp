#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <flyball/planning/drive/drive_problem.hpp>

/// The rigid body on wheels, over a generic scalar: what is optimised is what is simulated.
namespace flyball::drive_body {

/// x = (x, y, θ, v_x, v_y, ω) in the field, of a differential drive (x, y, θ, v_l, v_r).
[[nodiscard]] constexpr int states(Drivetrain kind) noexcept {
  return kind == Drivetrain::differential ? 5 : 6;
}
/// u = forces over `DriveModel::force()`: (f_x, f_y) of each module in the field, or one of each
/// wheel or side along it.
[[nodiscard]] constexpr int inputs(Drivetrain kind) noexcept {
  return kind == Drivetrain::swerve ? 8 : kind == Drivetrain::mecanum ? 4 : 2;
}

/// How the middle moves in the field.
template <class S>
struct Motion {
  S vx{}, vy{}, omega{};
  S ax{}, ay{}, alpha{};
};

/// A wheel's speed along v_x, v_y and ω of the robot's frame: rows of the inverse kinematics.
[[nodiscard]] inline std::array<double, 3> mecanum_row(const DriveModel& model, std::size_t wheel) {
  const Eigen::Vector2d& at = model.wheels[wheel];
  return wheel == 0 || wheel == 3 ? std::array{1.0, -1.0, -(at(0) + at(1))}
                                  : std::array{1.0, 1.0, at(0) - at(1)};
}

template <class S, class X, class U>
[[nodiscard]] Motion<S> motion(const DriveModel& model, const X& x, const U& u) {
  using std::cos, std::sin;
  const double F = model.force();
  Motion<S> at;
  const S c = cos(x(2));
  const S s = sin(x(2));
  if (model.drivetrain == Drivetrain::differential) {
    const S v = (x(3) + x(4)) * 0.5;
    const S a = (u(0) + u(1)) * (F / model.mass);
    at.omega = (x(4) - x(3)) * (1.0 / model.trackwidth);
    at.vx = v * c;
    at.vy = v * s;
    at.ax = a * c - v * at.omega * s;
    at.ay = a * s + v * at.omega * c;
    at.alpha = (u(1) - u(0)) * (0.5 * model.trackwidth * F / model.moment_of_inertia);
    return at;
  }
  at.vx = x(3);
  at.vy = x(4);
  at.omega = x(5);
  S fx = S(0.0);
  S fy = S(0.0);
  S along = S(0.0);
  S across = S(0.0);
  if (model.drivetrain == Drivetrain::swerve) {
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector2d& r = model.wheels[static_cast<std::size_t>(i)];
      fx = fx + u(2 * i);
      fy = fy + u(2 * i + 1);
      // (R r) × F = cos θ (r_x F_y - r_y F_x) - sin θ (r_x F_x + r_y F_y)
      along = along + r(0) * u(2 * i + 1) - r(1) * u(2 * i);
      across = across + r(0) * u(2 * i) + r(1) * u(2 * i + 1);
    }
    at.ax = fx * (F / model.mass);
    at.ay = fy * (F / model.mass);
    at.alpha = (c * along - s * across) * (F / model.moment_of_inertia);
    return at;
  }
  for (int i = 0; i < 4; ++i) {
    const auto row = mecanum_row(model, static_cast<std::size_t>(i));
    fx = fx + row[0] * u(i);
    fy = fy + row[1] * u(i);
    along = along + row[2] * u(i);
  }
  at.ax = (c * fx - s * fy) * (F / model.mass);
  at.ay = (s * fx + c * fy) * (F / model.mass);
  at.alpha = along * (F / model.moment_of_inertia);
  return at;
}

/// ẋ, `states` entries.
template <class S, class X, class U>
[[nodiscard]] std::vector<S> derivative(const DriveModel& model, const X& x, const U& u) {
  const Motion<S> at = motion<S>(model, x, u);
  if (model.drivetrain == Drivetrain::differential) {
    const S a = (u(0) + u(1)) * (model.force() / model.mass);
    const S turn = at.alpha * (0.5 * model.trackwidth);
    return {at.vx, at.vy, at.omega, a - turn, a + turn};
  }
  return {at.vx, at.vy, at.omega, at.ax, at.ay, at.alpha};
}

/// The speed of a wheel over the floor, along and across (of what has no across: zero).
template <class S, class X>
[[nodiscard]] std::array<S, 2> wheel_velocity(const DriveModel& model, const X& x, int wheel) {
  using std::cos, std::sin;
  if (model.drivetrain == Drivetrain::differential) {
    return {x(3 + wheel), S(0.0)};
  }
  const S c = cos(x(2));
  const S s = sin(x(2));
  const auto w = static_cast<std::size_t>(wheel);
  if (model.drivetrain == Drivetrain::swerve) {
    const Eigen::Vector2d& r = model.wheels[w];
    return {x(3) - x(5) * (s * r(0) + c * r(1)), x(4) + x(5) * (c * r(0) - s * r(1))};
  }
  const auto row = mecanum_row(model, w);
  return {row[0] * (c * x(3) + s * x(4)) + row[1] * (c * x(4) - s * x(3)) + row[2] * x(5), S(0.0)};
}

/// A wheel's force over `force()`, along and across.
template <class S, class U>
[[nodiscard]] std::array<S, 2> wheel_force(const DriveModel& model, const U& u, int wheel) {
  if (model.drivetrain == Drivetrain::swerve) {
    return {u(2 * wheel), u(2 * wheel + 1)};
  }
  return {u(wheel), S(0.0)};
}

}  // namespace flyball::drive_body
