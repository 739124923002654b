#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include <flyball/mechanisms/kinematics/chassis_speeds.hpp>
#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

/// The second derivative of kinematics: how a robot's acceleration and its wheels' belong together
/// while it turns. Run-time functions: noexcept, allocation-free.
namespace flyball::mechanisms {

/// How a robot's motion changes: the acceleration of its origin over the field, written in the
/// robot's frame (what an accelerometer there shows), and that of its angle.
///
/// It is dv/dt + ω × v of the speeds in the robot's frame: a robot that holds its twist on an arc
/// accelerates.
struct ChassisAccelerations {
  double ax = 0.0;     ///< m/s²
  double ay = 0.0;     ///< m/s²
  double alpha = 0.0;  ///< rad/s²

  /// (ax, ay, α).
  [[nodiscard]] Eigen::Vector3d vector() const noexcept { return {ax, ay, alpha}; }
  /// Those of a change of the speeds, d(vx, vy, ω)/dt in the robot's frame.
  [[nodiscard]] static ChassisAccelerations from_rates(const ChassisSpeeds& speeds,
                                                       const Eigen::Vector3d& rates) noexcept {
    return {rates(0) - speeds.omega * speeds.vy, rates(1) + speeds.omega * speeds.vx, rates(2)};
  }
  /// d(vx, vy, ω)/dt, as the robot's frame sees them: the inverse of `from_rates`.
  [[nodiscard]] Eigen::Vector3d rates(const ChassisSpeeds& speeds) const noexcept {
    return {ax + speeds.omega * speeds.vy, ay - speeds.omega * speeds.vx, alpha};
  }
  /// a_B = a_A + α × r + ω × (ω × r): those of another point of the robot. @param r  m, from the
  /// point whose accelerations these are. @param omega  rad/s.
  [[nodiscard]] ChassisAccelerations at(const Eigen::Vector2d& r, double omega) const noexcept {
    return {ax - alpha * r(1) - omega * omega * r(0), ay + alpha * r(0) - omega * omega * r(1),
            alpha};
  }
};

/// How a module's motion changes.
struct SwerveModuleRates {
  double acceleration = 0.0;  ///< Of its speed along the ground, m/s².
  double steer_rate = 0.0;    ///< Of its direction in the robot's frame, rad/s.
};

/// Each module's acceleration along its direction and the rate at which it must steer, with
/// a_i = a + α × r_i + ω × (ω × r_i), the direction d_i and the speed s_i:
///
///     ds_i/dt = a_i·d_i,   dδ_i/dt = (d_i × a_i)/s_i - ω.
///
/// The second keeps a wheel from scrubbing; its -ω alone is what a drive needs that goes straight
/// while it turns. A module slower than `slow` (m/s) has no direction of its own: its steer rate is
/// zero, its acceleration that along the angle that it holds.
/// @param modules  Of `kinematics.modules(speeds)`, or with speeds of the other sign and angles
/// turned half round (`shortest_turn`).
template <std::size_t N>
[[nodiscard]] std::array<SwerveModuleRates, N> module_rates(
    const SwerveKinematics<N>& kinematics, const std::array<SwerveModule, N>& modules,
    const ChassisAccelerations& accelerations, double omega, double slow = 1e-6) noexcept {
  std::array<SwerveModuleRates, N> rates;
  for (std::size_t i = 0; i < N; ++i) {
    const ChassisAccelerations a = accelerations.at(kinematics.positions()[i], omega);
    const double c = modules[i].angle.cos();
    const double s = modules[i].angle.sin();
    const double speed = modules[i].speed;
    rates[i].acceleration = a.ax * c + a.ay * s;
    if (std::abs(speed) > slow) {
      rates[i].steer_rate = (c * a.ay - s * a.ax) / speed - omega;
    }
  }
  return rates;
}

/// The accelerations of a robot whose modules change so: the inverse, of least squares where they
/// contradict each other. @param omega  rad/s, of the robot.
template <std::size_t N>
[[nodiscard]] ChassisAccelerations chassis_accelerations(
    const SwerveKinematics<N>& kinematics, const std::array<SwerveModule, N>& modules,
    const std::array<SwerveModuleRates, N>& rates, double omega) noexcept {
  // a_i + ω² r_i = a + α × r_i is the map of speeds.
  std::array<Eigen::Vector2d, N> a;
  for (std::size_t i = 0; i < N; ++i) {
    const double c = modules[i].angle.cos();
    const double s = modules[i].angle.sin();
    const double across = modules[i].speed * (rates[i].steer_rate + omega);
    const Eigen::Vector2d& r = kinematics.positions()[i];
    a[i] = {rates[i].acceleration * c - across * s + omega * omega * r(0),
            rates[i].acceleration * s + across * c + omega * omega * r(1)};
  }
  const ChassisSpeeds least = kinematics.chassis(a);
  return {least.vx, least.vy, least.omega};
}

/// d(wheels)/dt = M d(vx, vy, ω)/dt, m/s²: the wheels' accelerations along the ground.
template <int W>
[[nodiscard]] Eigen::Matrix<double, W, 1> wheel_accelerations(
    const WheelKinematics<W>& kinematics, const ChassisAccelerations& accelerations,
    const ChassisSpeeds& speeds) noexcept {
  return kinematics.to_wheels() * accelerations.rates(speeds);
}

/// The inverse, of least squares. @param wheels  m/s². @param speeds  Of the robot; those that the
/// wheels do not see (vy of a differential drive) count as given.
template <int W>
[[nodiscard]] ChassisAccelerations chassis_accelerations(const WheelKinematics<W>& kinematics,
                                                         const Eigen::Matrix<double, W, 1>& wheels,
                                                         const ChassisSpeeds& speeds) noexcept {
  return ChassisAccelerations::from_rates(speeds, kinematics.to_chassis() * wheels);
}

}  // namespace flyball::mechanisms
