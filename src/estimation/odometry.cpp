#include <flyball/estimation/odometry.hpp>

#include <flyball/core/signal.hpp>

namespace flyball {

bool Odometry::step(const Eigen::Vector3d& delta, const Eigen::Matrix3d& Q) noexcept {
  if (!is_signal(delta) || !is_signal(Q)) {
    return false;
  }
  const bool euler = rule_ == OdometryRule::forward_euler;
  const Pose2d E = euler ? Pose2d(delta.head<2>(), Rotation2d(delta(2))) : Pose2d::exp(delta);
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  if (euler) {
    J.topLeftCorner<2, 2>() = E.rotation().inverse().matrix();
  } else {
    J = Pose2d::right_jacobian(delta);
  }
  const Pose2d next = pose_ * E;
  const Eigen::Matrix3d Ad = E.inverse().adjoint();
  const Eigen::Matrix3d P = Ad * covariance_ * Ad.transpose() + J * Q * J.transpose();
  if (!is_signal(next.translation()) || !is_signal(P)) {
    return false;
  }
  pose_ = next;
  covariance_ = 0.5 * (P + P.transpose());
  return true;
}

bool Odometry::step(const Eigen::Vector3d& delta, const Rotation2d& gyro,
                    const Eigen::Matrix3d& Q) noexcept {
  if (!is_signal(gyro.cos()) || !is_signal(gyro.sin())) {
    return false;
  }
  Eigen::Vector3d turned = delta;
  if (knows_gyro_zero_) {
    turned(2) = (gyro_zero_ * gyro).minus(pose_.rotation())(0);
  }
  // A turn of the wheels that is no number does not count where the gyro gives it.
  if (!step(turned, Q)) {
    return false;
  }
  if (!knows_gyro_zero_) {
    gyro_zero_ = pose_.rotation() * gyro.inverse();
    knows_gyro_zero_ = true;
  }
  return true;
}

bool Odometry::reset(const Pose2d& pose, const Eigen::Matrix3d& covariance) noexcept {
  const Rotation2d& heading = pose.rotation();
  if (!is_signal(pose.translation()) || !is_signal(heading.cos()) || !is_signal(heading.sin()) ||
      !is_signal(covariance)) {
    return false;
  }
  pose_ = pose;
  covariance_ = covariance;
  knows_gyro_zero_ = false;
  return true;
}

}  // namespace flyball
