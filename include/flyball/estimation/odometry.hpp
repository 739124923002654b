#pragma once

#include <Eigen/Core>

#include <flyball/geometry/se2.hpp>

namespace flyball {

/// How a period's motion is added to a pose.
enum class OdometryRule {
  pose_exponential,  ///< Along the arc of a constant twist: x ⊕ δ.
  forward_euler,     ///< Straight in the direction of the period's begin, then the turn.
};

/// Dead reckoning: the pose of a robot from the twists that its wheels (and a gyro) measure, with
/// the covariance of its error.
///
/// A twist δ = (Δx, Δy, Δθ), m and rad, in the robot's frame comes from the wheels' distances by
/// `twist` of the drive's kinematics (`mechanisms/kinematics`): differential, mecanum, omni,
/// swerve.
///
///     pose exponential:  x_{k+1} = x_k Exp(δ)
///     forward Euler:     (x, y)_{k+1} = (x, y)_k + R(θ_k) (Δx, Δy),  θ_{k+1} = θ_k + Δθ
///
/// With E = x_k⁻¹ x_{k+1}, the covariance Q of δ and J of E by δ (Jr(δ), or R(-Δθ) beside 1), the
/// covariance of the error ξ, x = x̄ Exp(ξ), is to first order
///
///     P_{k+1} = Ad(E)⁻¹ P_k Ad(E)⁻ᵀ + J Q Jᵀ.
///
/// Run-time object: noexcept, allocation-free. A step with a number that is none
/// (`core/signal.hpp`), or that would take the pose or the covariance beyond all numbers, is left
/// out: nothing changes, and the answer is false.
/// Source: book, 10.1, (10.2), Theorem 10.2.1; Sola, Deray, Atchuthan, "A micro Lie theory for
/// state estimation in robotics" (2018), section V.
class Odometry {
 public:
  /// At the origin, and sure of it.
  explicit Odometry(OdometryRule rule = OdometryRule::pose_exponential) noexcept : rule_(rule) {}
  /// A pose or covariance that `reset` would not take counts as the origin, known for sure.
  /// @param covariance  Of the pose's error in its own frame: m², m rad, rad².
  Odometry(OdometryRule rule, const Pose2d& pose,
           const Eigen::Matrix3d& covariance = Eigen::Matrix3d::Zero()) noexcept
      : rule_(rule) {
    reset(pose, covariance);
  }

  /// A period without a gyro. @param delta  The twist. @param Q  Its covariance.
  bool step(const Eigen::Vector3d& delta,
            const Eigen::Matrix3d& Q = Eigen::Matrix3d::Zero()) noexcept;
  /// A period whose turn the gyro measures; the wheels give the rest. The first reading says where
  /// the gyro's zero is (the wheels give that period's turn), later ones the heading; so nothing is
  /// lost if it was silent in between.
  /// @param gyro  Its absolute heading, wrapped or not: only differences within a half turn count.
  bool step(const Eigen::Vector3d& delta, const Rotation2d& gyro,
            const Eigen::Matrix3d& Q = Eigen::Matrix3d::Zero()) noexcept;
  /// Somewhere else; the gyro's zero is found anew. @return  Whether it was taken: one with a
  /// number that is none is not, and nothing changes.
  bool reset(const Pose2d& pose,
             const Eigen::Matrix3d& covariance = Eigen::Matrix3d::Zero()) noexcept;

  [[nodiscard]] const Pose2d& pose() const noexcept { return pose_; }
  [[nodiscard]] const Eigen::Matrix3d& covariance() const noexcept { return covariance_; }

 private:
  OdometryRule rule_;
  Pose2d pose_{};
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
  Rotation2d gyro_zero_{};  ///< heading = gyro_zero gyro
  bool knows_gyro_zero_ = false;
};

}  // namespace flyball
