#pragma once

#include <array>
#include <memory>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/study/drive.hpp>

/// A drivetrain behind its controllers and battery, whatever its kind.
namespace flyball::study {

/// What it meets at an instant.
struct DriveInfluence {
  Eigen::Vector2d force = Eigen::Vector2d::Zero();  ///< N, in the field, on its middle.
  double grip = 1.0;                                ///< Share of the wheels' grip that is left.
};

/// What flows.
struct DriveFlow {
  Eigen::VectorXd voltage{}, current{};  ///< V and A, of each motor.
  double rail = 0.0;                     ///< V
  double battery_current = 0.0;          ///< A
};

class DrivePlant {
 public:
  virtual ~DrivePlant() = default;
  DrivePlant() = default;
  DrivePlant(const DrivePlant&) = delete;
  DrivePlant& operator=(const DrivePlant&) = delete;

  /// Of its first six: x, y, θ, vx, vy, ω (in its own frame).
  [[nodiscard]] virtual Eigen::Index states() const = 0;
  /// dx/dt. @param u  V, asked for, one a motor.
  virtual void derivative(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::VectorXd& u,
                          const DriveInfluence& influence,
                          Eigen::Ref<Eigen::VectorXd> rate) const = 0;
  [[nodiscard]] virtual DriveFlow flow(const Eigen::VectorXd& x,
                                       const Eigen::VectorXd& u) const = 0;
  /// m/s, of each shaft's wheels along the ground.
  [[nodiscard]] virtual Eigen::VectorXd wheel_speeds(const Eigen::VectorXd& x) const = 0;
  /// rad and rad/s, of a swerve drive's modules; else empty.
  [[nodiscard]] virtual Eigen::VectorXd module_angles(const Eigen::VectorXd& x) const = 0;
  [[nodiscard]] virtual Eigen::VectorXd module_rates(const Eigen::VectorXd& x) const = 0;
  /// m/s, the fastest of what the wheels' contacts slide along their rolling direction.
  [[nodiscard]] virtual double slip(const Eigen::VectorXd& x) const = 0;
  /// The state of a robot at a pose with a motion in its frame, wheels rolling without slip.
  /// @param angles  rad, of the modules.
  [[nodiscard]] virtual Eigen::VectorXd state_of(const Pose2d& pose,
                                                 const mechanisms::ChassisSpeeds& speeds,
                                                 const std::array<double, 4>& angles) const = 0;
};

/// @errors Those of the mechanisms' functions.
[[nodiscard]] Expected<std::unique_ptr<DrivePlant>> make_drive_plant(
    const DriveRobot& robot, const mechanisms::Battery& battery);

}  // namespace flyball::study
