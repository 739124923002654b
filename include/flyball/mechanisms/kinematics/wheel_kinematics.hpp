#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/kinematics/chassis_speeds.hpp>

/// Between the motion of a robot and that of wheels that are fixed to it: differential, mecanum,
/// omni drives. Swerve drives are in `swerve_kinematics.hpp`.
namespace flyball::mechanisms {

/// The linear map between the robot's motion and the speeds of W wheels,
///
///     wheels = M (vx, vy, ω),    (vx, vy, ω) = M⁺ wheels,
///
/// M⁺ the pseudo-inverse: the least-squares motion where the wheels contradict each other. Speeds
/// (m/s) and rates go as distances (m) and twists do. Run-time object: noexcept, allocation-free.
template <int W>
class WheelKinematics {
 public:
  static constexpr int wheel_count = W;
  /// One entry a wheel: its speed along the ground in its rolling direction, m/s, or a distance, m.
  using Wheels = Eigen::Matrix<double, W, 1>;

  /// @param to_wheels  M, W x 3. @param to_chassis  M⁺, 3 x W.
  WheelKinematics(const Eigen::Matrix<double, W, 3>& to_wheels,
                  const Eigen::Matrix<double, 3, W>& to_chassis) noexcept
      : to_wheels_(to_wheels), to_chassis_(to_chassis) {}

  /// Inverse kinematics. @param centre  Of the rotation, m, in the robot's frame: the point whose
  /// speeds are given.
  [[nodiscard]] Wheels wheels(
      const ChassisSpeeds& speeds,
      const Eigen::Vector2d& centre = Eigen::Vector2d::Zero()) const noexcept {
    return to_wheels_ * speeds.at(-centre).vector();
  }
  /// Forward kinematics.
  [[nodiscard]] ChassisSpeeds chassis(const Wheels& speeds) const noexcept {
    return ChassisSpeeds::from(to_chassis_ * speeds);
  }
  /// The twist (m, m, rad) in which the wheels came a distance each: what odometry adds up.
  [[nodiscard]] Eigen::Vector3d twist(const Wheels& distances) const noexcept {
    return to_chassis_ * distances;
  }
  /// The covariance of that twist, M⁺ diag(σ²) M⁺ᵀ. @param variances  Of the distances, m².
  [[nodiscard]] Eigen::Matrix3d twist_covariance(const Wheels& variances) const noexcept {
    return to_chassis_ * variances.asDiagonal() * to_chassis_.transpose();
  }

  [[nodiscard]] const Eigen::Matrix<double, W, 3>& to_wheels() const noexcept { return to_wheels_; }
  [[nodiscard]] const Eigen::Matrix<double, 3, W>& to_chassis() const noexcept {
    return to_chassis_;
  }

 private:
  Eigen::Matrix<double, W, 3> to_wheels_;
  Eigen::Matrix<double, 3, W> to_chassis_;
};

/// Left, right.
using DifferentialKinematics = WheelKinematics<2>;
/// Front left, front right, back left, back right.
using MecanumKinematics = WheelKinematics<4>;

/// vl = v - ω r_b, vr = v + ω r_b; v = (vr + vl)/2, ω = (vr - vl)/(2 r_b), and vy is nothing.
/// @param trackwidth  2 r_b. @errors ArgumentError::not_positive, not_finite.
/// Source: book, equations (11.3), (11.4), (11.6), (11.7).
[[nodiscard]] Expected<DifferentialKinematics> differential_kinematics(Length trackwidth);

/// A wheel with rollers, fixed to the robot.
struct WheelMount {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m, of its contact in the robot's frame.
  double direction = 0.0;                              ///< rad, in which it rolls; 0 is forward.
  double roller_angle = 0.0;  ///< rad, from that direction to the rollers' axis: what moves across
                              ///< the axis the rollers give way to. An omni wheel has 0, a
                              ///< mecanum wheel ±π/4.
};

namespace detail {

/// M (W x 3), of full rank. @errors ArgumentError::not_finite, out_of_range.
[[nodiscard]] Expected<Eigen::MatrixXd> wheel_matrix(std::span<const WheelMount> mounts,
                                                     std::string_view where);
/// M⁺ of such a matrix.
[[nodiscard]] Eigen::MatrixXd wheel_pseudo_inverse(const MatrixRef& M);

}  // namespace detail

/// Three or more wheels with rollers, omni or mecanum, anywhere. The contact moves with
/// v + ω × r, of which the ground holds the part along the rollers' axis a; so with the rolling
/// direction d the wheel's speed is (v + ω × r)·a/(d·a).
/// @errors ArgumentError::not_finite; out_of_range for two wheels in one place, for a layout that
///         leaves a motion without an answer (all directions parallel, all wheels about one point),
///         and for rollers across the rolling direction.
/// Cost: allocates. Source: book, section 11.4; (11.13).
template <std::size_t W>
[[nodiscard]] Expected<WheelKinematics<static_cast<int>(W)>> wheel_kinematics(
    const std::array<WheelMount, W>& mounts) {
  return detail::wheel_matrix(mounts, "wheel_kinematics").map([](const Eigen::MatrixXd& M) {
    return WheelKinematics<static_cast<int>(W)>(M, detail::wheel_pseudo_inverse(M));
  });
}

/// Mecanum wheels whose rollers, seen from above, form an X:
///
///     [fl; fr; bl; br] = [1 -1 -(x + y); 1 1 x - y; 1 1 x - y; 1 -1 -(x + y)] [vx; vy; ω].
///
/// These are the wheels' speeds as encoders measure them; the book's rows (11.12) are 1/√2 of them,
/// the speeds of the contacts along the rollers' axes.
/// @param positions  m: front left, front right, back left, back right.
/// @errors As `wheel_kinematics`. Source: book, section 11.6; (11.8) to (11.13).
[[nodiscard]] Expected<MecanumKinematics> mecanum_kinematics(
    const std::array<Eigen::Vector2d, 4>& positions);

}  // namespace flyball::mechanisms
