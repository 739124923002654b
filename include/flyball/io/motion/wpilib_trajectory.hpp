#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/errors.hpp>
#include <flyball/io/motion/json_parts.hpp>

/// WPILib's trajectory JSON: the list of states of PathWeaver and PathPlanner 2023, and the object
/// of samples of WPILib 2027. All structs keep what else stood in their file.
namespace flyball {

/// Speeds of a chassis.
struct WpilibSpeeds {
  double vx = 0.0;     ///< m/s
  double vy = 0.0;     ///< m/s
  double omega = 0.0;  ///< rad/s
  JsonOrigin origin{};
};

/// Accelerations of a chassis.
struct WpilibAccelerations {
  double ax = 0.0;     ///< m/s²
  double ay = 0.0;     ///< m/s²
  double alpha = 0.0;  ///< rad/s²
  JsonOrigin origin{};
};

/// Where a robot is at a time. The older layout has velocity, acceleration and curvature along the
/// path, the newer one speeds.
struct WpilibState {
  double time = 0.0;          ///< s
  double x = 0.0;             ///< m
  double y = 0.0;             ///< m
  double angle = 0.0;         ///< rad, along the path; of the newer layout the robot's heading.
  double velocity = 0.0;      ///< m/s
  double acceleration = 0.0;  ///< m/s²
  double curvature = 0.0;     ///< rad/m
  std::optional<double> holonomic_rotation{};  ///< °, of PathPlanner 2023: the way that it looks.
  std::optional<double> holonomic_angular_velocity{};  ///< °/s
  std::optional<double> angular_velocity{};  ///< rad/s, of PathPlanner 2023: the path's turning.
  WpilibSpeeds speeds{};
  std::optional<WpilibAccelerations> accelerations{};
  std::optional<double> left_velocity{}, right_velocity{};  ///< m/s, of a differential drive.
  JsonOrigin origin{};
};

/// A trajectory file.
struct WpilibTrajectory {
  bool is_object = false;  ///< {"samples": […]} of 2027; else the list.
  std::vector<WpilibState> states{};
  JsonOrigin origin{};
};

/// Reads one of either layout. Nothing is said of the motion itself: times may go back.
/// @param text  The file. @param source  Its name for messages.
/// @errors MotionFileError with line, column and caret. Cost: O(size); at most 64 MiB and half a
/// million values. Source: WPILib, TrajectoryUtil.
[[nodiscard]] ExpectedAll<WpilibTrajectory> parse_wpilib_trajectory(std::string_view text,
                                                                    const std::string& source);

/// The file as text: what was read and not changed byte by byte as it stood, what is new as WPILib
/// would. @errors MotionFileError::wrong_field for a number that is not finite. Cost: O(size).
[[nodiscard]] Expected<std::string> to_wpilib(const WpilibTrajectory& trajectory);
/// The same into a file, which is replaced whole. @errors FileError, too.
[[nodiscard]] Expected<void> write_wpilib(const std::string& path,
                                          const WpilibTrajectory& trajectory);

}  // namespace flyball
