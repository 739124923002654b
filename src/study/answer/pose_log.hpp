#pragma once

#include <span>
#include <string>

#include <flyball/core/answer.hpp>
#include <flyball/geometry/se3.hpp>
#include <flyball/io/wpilog.hpp>
#include <flyball/study/estimate.hpp>
#include <flyball/study/localize.hpp>

/// Poses in a WPILOG, as AdvantageScope shows them.
namespace flyball::study {

/// A pose at a time.
struct TimedPose {
  double time;  ///< s, not negative.
  Pose3d pose;
};

/// The poses as channels NAME of the plane (x, y and heading alone) and NAME_3d of space: which of
/// them is drawn is the viewer's choice.
void write_poses(WpilogWriter& writer, const std::string& name, std::span<const TimedPose> poses);

/// A pose that stands level on the floor.
[[nodiscard]] Pose3d on_the_floor(const Pose2d& pose);

/// x, y, heading and their standard deviations along the map's axes.
[[nodiscard]] std::string csv_of(const LocalizedPath& path);

/// "data/poses.wpilog": the paths, and where there is one the truth.
[[nodiscard]] AnswerFile localize_log_file(const LocalizeResult& result);

/// The poses of a model whose states say one, as channels flyball/filter_pose and
/// flyball/smoother_pose: x, y (m) and heading, yaw or theta (rad), where there are any z (m),
/// pitch and roll (rad; yaw, then pitch, then roll). Of other models nothing.
void write_estimated_poses(WpilogWriter& writer, const Estimation& result);

}  // namespace flyball::study
