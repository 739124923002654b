#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>

#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/control/followers/ltv_unicycle.hpp>
#include <flyball/control/followers/ramsete.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/study/drive.hpp>

/// What a robot runs each period to follow a trajectory, down to its motors' voltages.
namespace flyball::study {

/// What it is told by its sensors.
struct DriveReading {
  Pose2d pose{};
  Eigen::VectorXd wheels{};  ///< m/s, of each shaft.
  Eigen::VectorXd module_angles{}, module_rates{};
};

/// What it asks for.
struct DriveOrder {
  Eigen::VectorXd volts{};             ///< One a motor, within the limit.
  mechanisms::ChassisSpeeds speeds{};  ///< That it wants, in the robot's frame.
  bool saturated = false;              ///< Whether it wanted more.
  std::optional<double> clock{};       ///< s, of the trajectory, of what follows its path alone.
  bool arrived = false;                ///< Of the same: at the path's end.
};

class DriveLaw {
 public:
  virtual ~DriveLaw() = default;
  DriveLaw() = default;
  DriveLaw(const DriveLaw&) = delete;
  DriveLaw& operator=(const DriveLaw&) = delete;

  /// @param now, next  Of the trajectory, now and a period later.
  virtual DriveOrder step(const DriveReading& reading, const MotionSample& now,
                          const MotionSample& next) = 0;
};

/// @errors Those of the followers and models.
[[nodiscard]] Expected<std::unique_ptr<DriveLaw>> make_drive_law(const DriveJob& job);

/// A differential drive as its follower knows it. @errors Those of the model.
[[nodiscard]] Expected<mechanisms::DifferentialDrive> differential_model(const DriveRobot& robot);
// What its follower and the tracker of its sides are tuned by.
[[nodiscard]] RamseteSettings ramsete_settings(const DriveJob& job);
[[nodiscard]] LtvUnicycleSettings ltv_unicycle_settings(const DriveJob& job);
[[nodiscard]] LtvDriveSettings ltv_drive_settings(const DriveJob& job);
[[nodiscard]] DriveTrackerSettings drive_tracker_settings(const DriveJob& job);

/// A sample as followers take it: its velocity in the robot's own frame.
[[nodiscard]] TrackingPoint tracking_point(const MotionSample& sample) noexcept;

}  // namespace flyball::study
