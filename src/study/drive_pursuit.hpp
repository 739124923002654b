#pragma once

#include <vector>

#include <flyball/control/followers/pure_pursuit.hpp>
#include <flyball/study/drive.hpp>

/// Pure pursuit of a trajectory's path.
namespace flyball::study {

/// A trajectory's path as pure pursuit takes it, and its times.
struct PursuedPath {
  std::vector<PathPoint> points{};  ///< On arcs with headings along the path; else as it looks.
  std::vector<double> stations{};   ///< m along the path of each point.
  std::vector<double> times{};      ///< s, of the trajectory.
  bool backs = false;               ///< Whether a robot on arcs backs along it.

  /// s, when the trajectory is there. @param station  m along the path.
  [[nodiscard]] double time_at(double station) const noexcept;
};

/// Drops what stands still or turns in place. @errors ProjectError::wrong_value for a trajectory
/// without a way, and for one of a drivetrain without sideways motion that goes both forward and
/// back.
[[nodiscard]] Expected<PursuedPath> pursued_path(const DriveJob& job);

/// As fast as the trajectory is anywhere, with its largest acceleration and bends, within the
/// wheels' speed.
[[nodiscard]] PurePursuitSettings pure_pursuit_settings(const DriveJob& job,
                                                        const PursuedPath& path);

/// The pursuit of a job: each period what the robot is to do now and a period later.
class Pursuit {
 public:
  struct Asked {
    mechanisms::ChassisSpeeds now{}, next{};
    bool saturated = false;
    bool arrived = false;
    double clock = 0.0;  ///< s, when the trajectory is where the robot is.
  };
  /// @errors As `pursued_path` and PurePursuitFollower::create.
  [[nodiscard]] static Expected<Pursuit> create(const DriveJob& job);
  Asked step(const Pose2d& pose) noexcept;

 private:
  Pursuit(PurePursuitFollower follower, PursuedPath path, double most_gain)
      : follower_(std::move(follower)), path_(std::move(path)), most_gain_(most_gain) {}

  PurePursuitFollower follower_;
  PursuedPath path_;
  double most_gain_;     ///< m/s, that the speed changes by in a period.
  double before_ = 0.0;  ///< m/s, of the last command.
};

}  // namespace flyball::study
