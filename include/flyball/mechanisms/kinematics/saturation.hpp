#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include <flyball/core/signal.hpp>
#include <flyball/geometry/se2.hpp>
#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

/// What is between a wanted motion and what wheels can do in a period. Run-time functions:
/// noexcept, allocation-free.
namespace flyball::mechanisms {

/// The same motion of a module with the shorter turn from where it points: what lies more than a
/// quarter turn away is driven backward.
/// @param wanted  Its speed may have either sign. @param angle  Of the module now.
[[nodiscard]] inline SwerveModule shortest_turn(const SwerveModule& wanted,
                                                const Rotation2d& angle) noexcept {
  const double ahead =
      wanted.angle.cos() * angle.cos() + wanted.angle.sin() * angle.sin();  // cos of the turn
  if (ahead >= 0.0) {
    return wanted;
  }
  return {-wanted.speed, Rotation2d::from_unit(-wanted.angle.cos(), -wanted.angle.sin())};
}

/// A module's speed times the cosine of what it still has to turn, so that it does not push across
/// the way that is wanted before it has turned; never backward.
/// @param wanted  After `shortest_turn`. @param angle  Of the module now.
[[nodiscard]] inline SwerveModule cosine_scaled(const SwerveModule& wanted,
                                                const Rotation2d& angle) noexcept {
  const double ahead = wanted.angle.cos() * angle.cos() + wanted.angle.sin() * angle.sin();
  return {wanted.speed * std::max(ahead, 0.0), wanted.angle};
}

/// In which frame a velocity stays what it is while the robot turns for a period.
enum class HeldFrame {
  robot,  ///< A twist: the robot goes along an arc.
  field,  ///< The velocity keeps its direction in the field: the robot goes straight, turning.
};

/// The twist that a robot holds over a period to come to where the motion leads: `speeds` itself in
/// the robot's frame; of a velocity that keeps its direction in the field log(pose)/dt of the pose
/// (vx dt, vy dt, ω dt), since wheels whose states are held make an arc.
/// @param speeds  In the robot's frame at the period's beginning. @param dt  s, > 0.
/// Source: book, Theorem 10.2.1, inverted; Sola, Deray, Atchuthan (2018), appendix C.
[[nodiscard]] inline ChassisSpeeds held_twist(const ChassisSpeeds& speeds, HeldFrame frame,
                                              double dt) noexcept {
  if (frame == HeldFrame::robot) {
    return speeds;
  }
  // V⁻¹(θ) = (θ/2) cot(θ/2) I + (θ/2) [0 1; -1 0]; x cot x by its series where x is small.
  const double half = 0.5 * speeds.omega * dt;
  const double x = half * half;
  const double a =
      x < 0.0625
          ? 1.0 - x * (1.0 / 3 +
                       x * (1.0 / 45 +
                            x * (2.0 / 945 + x * (1.0 / 4725 +
                                                  x * (2.0 / 93555 + x * (1382.0 / 638512875 +
                                                                          x * (4.0 / 18243225)))))))
          : half / std::tan(half);
  return {a * speeds.vx + half * speeds.vy, a * speeds.vy - half * speeds.vx, speeds.omega};
}

/// What of a motion wheels can do.
struct SaturatedMotion {
  ChassisSpeeds twist{};  ///< To hold over the period, in the robot's frame.
  double scale = 1.0;     ///< In [0, 1]: the motion that the twist makes is this times the wanted.
};

namespace detail {

/// The largest scale at which `fastest(held twist of scale · speeds)` is within the limit.
template <class Fastest>
[[nodiscard]] SaturatedMotion saturate(const ChassisSpeeds& speeds, HeldFrame frame, double dt,
                                       double max_speed, const Fastest& fastest) noexcept {
  using flyball::detail::signal_or_zero;
  const ChassisSpeeds wanted{signal_or_zero(speeds.vx), signal_or_zero(speeds.vy),
                             signal_or_zero(speeds.omega)};
  const double limit = std::max(signal_or_zero(max_speed), 0.0);
  // A twist's speeds are proportional to its scale; those of a direction in the field nearly, which
  // makes this a contraction by about (ω dt)²/12. It aims a little low, not to end a little high.
  const double aim = frame == HeldFrame::robot ? limit : limit * (1.0 - 5e-10);
  double scale = 1.0;
  SaturatedMotion result{held_twist(wanted, frame, dt), 1.0};
  for (int iteration = 0; iteration < 8; ++iteration) {
    const double speed = fastest(result.twist);
    if (speed <= limit * (1.0 + 4e-16) && (iteration == 0 || speed >= limit * (1.0 - 1e-9))) {
      return result;
    }
    scale = speed > 0.0 ? std::min(scale * (aim / speed), 1.0) : 0.0;
    result = {held_twist({scale * wanted.vx, scale * wanted.vy, scale * wanted.omega}, frame, dt),
              scale};
  }
  // Turns of half a turn a period and more: the limit holds, whatever comes of the direction.
  const double speed = fastest(result.twist);
  if (speed > limit) {
    const double by = limit / speed;
    result.twist = {by * result.twist.vx, by * result.twist.vy, by * result.twist.omega};
  }
  return result;
}

}  // namespace detail

/// Discretises and desaturates at once: the twist over a period with which no module is faster than
/// `max_speed`, and which leads along the wanted motion, made slower: its direction is kept and the
/// ratio of its turning to its moving too. Desaturating the modules of a twist that was discretised
/// before does not: the arc that it takes is another one's.
/// @param speeds     In the robot's frame at the period's beginning; what is not finite is zero.
/// @param frame      What the motion keeps while it turns. @param dt  s, > 0.
/// @param max_speed  m/s, of a module.
/// Cost: two or three inverse kinematics; one where nothing saturates.
template <std::size_t N>
[[nodiscard]] SaturatedMotion saturated(const SwerveKinematics<N>& kinematics,
                                        const ChassisSpeeds& speeds, HeldFrame frame, double dt,
                                        double max_speed) noexcept {
  return detail::saturate(speeds, frame, dt, max_speed, [&](const ChassisSpeeds& twist) {
    double square = 0.0;
    for (const Eigen::Vector2d& r : kinematics.positions()) {
      const ChassisSpeeds there = twist.at(r);
      square = std::max(square, there.vx * there.vx + there.vy * there.vy);
    }
    return std::sqrt(square);
  });
}
/// The same of wheels that are fixed to the robot: differential, mecanum, omni.
template <int W>
[[nodiscard]] SaturatedMotion saturated(const WheelKinematics<W>& kinematics,
                                        const ChassisSpeeds& speeds, HeldFrame frame, double dt,
                                        double max_speed) noexcept {
  return detail::saturate(speeds, frame, dt, max_speed, [&](const ChassisSpeeds& twist) {
    return kinematics.wheels(twist).cwiseAbs().maxCoeff();
  });
}

/// Modules slowed down together, so that none is faster than `max_speed`.
template <std::size_t N>
struct DesaturatedModules {
  std::array<SwerveModule, N> modules{};
  double scale = 1.0;  ///< Of all speeds; the robot's motion is this times the wanted.
};

/// All speeds times the same scale: the robot's twist keeps its direction. For a twist that is held
/// over the period (`HeldFrame::robot`), or modules that come from elsewhere; else `saturated`.
/// @param max_speed  m/s. What is not finite is zero.
template <std::size_t N>
[[nodiscard]] DesaturatedModules<N> desaturated(std::array<SwerveModule, N> modules,
                                                double max_speed) noexcept {
  double fastest = 0.0;
  for (SwerveModule& module : modules) {
    module.speed = flyball::detail::signal_or_zero(module.speed);
    fastest = std::max(fastest, std::abs(module.speed));
  }
  const double limit = std::max(flyball::detail::signal_or_zero(max_speed), 0.0);
  if (!(fastest > limit)) {
    return {modules, 1.0};
  }
  const double scale = limit / fastest;
  for (SwerveModule& module : modules) {
    // A product can be above the limit by its rounding.
    module.speed = std::clamp(module.speed * scale, -limit, limit);
  }
  return {modules, scale};
}

/// Fixed wheels likewise. @param wheels  m/s. @return They, and the scale.
template <int W>
[[nodiscard]] std::pair<Eigen::Matrix<double, W, 1>, double> desaturated(
    Eigen::Matrix<double, W, 1> wheels, double max_speed) noexcept {
  flyball::detail::keep_signals(wheels);
  const double limit = std::max(flyball::detail::signal_or_zero(max_speed), 0.0);
  const double fastest = wheels.cwiseAbs().maxCoeff();
  if (!(fastest > limit)) {
    return {wheels, 1.0};
  }
  const double scale = limit / fastest;
  wheels = (wheels * scale).cwiseMin(limit).cwiseMax(-limit);
  return {wheels, scale};
}

}  // namespace flyball::mechanisms
