// A drive's paths as tables, and as a WPILOG, which AdvantageScope shows on its fields.
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <flyball/core/time_series.hpp>
#include <flyball/io/csv.hpp>

#include "study/answer/pose_log.hpp"

namespace flyball::study {

void write_poses(WpilogWriter& writer, const std::string& name, std::span<const TimedPose> poses) {
  const auto plane = writer.start_pose(name);
  const auto space = writer.start_pose3(name + "_3d");
  for (const auto& [time, pose] : poses) {
    const Eigen::Vector3d& at = pose.translation();
    const Eigen::Vector4d& q = pose.rotation().quaternion();
    // The heading is that of the robot's forward axis.
    const Eigen::Vector3d forward = pose.rotation() * Eigen::Vector3d(Eigen::Vector3d::UnitX());
    const std::array<double, 3> flat{at(0), at(1), std::atan2(forward(1), forward(0))};
    const std::array<double, 7> full{at(0), at(1), at(2), q(0), q(1), q(2), q(3)};
    writer.append(plane, time, std::span<const double>(flat));
    writer.append(space, time, std::span<const double>(full));
  }
}

Pose3d on_the_floor(const Pose2d& pose) {
  return Pose3d(Eigen::Vector3d(pose.x(), pose.y(), 0.0),
                Rotation3d::exp(Eigen::Vector3d(0.0, 0.0, pose.angle())));
}

std::string csv_of(const LocalizedPath& path) {
  TimeSeries series(path.time);
  std::array<std::vector<double>, 6> columns;
  for (std::size_t i = 0; i < path.time.size(); ++i) {
    const Pose2d& pose = path.pose[i];
    const Eigen::Matrix3d& P = path.covariance[i];
    // The position's deviations along the map's axes: the covariance is in the robot's frame.
    const Eigen::Matrix2d R = pose.rotation().matrix();
    const Eigen::Matrix2d map = R * P.topLeftCorner<2, 2>() * R.transpose();
    const std::array<double, 6> row{
        pose.x(),          pose.y(), pose.angle(), std::sqrt(map(0, 0)), std::sqrt(map(1, 1)),
        std::sqrt(P(2, 2))};
    for (std::size_t c = 0; c < row.size(); ++c) {
      columns[c].push_back(row[c]);
    }
  }
  constexpr std::array<std::pair<const char*, const char*>, 6> names{{{"x", "m"},
                                                                      {"y", "m"},
                                                                      {"heading", "rad"},
                                                                      {"x std", "m"},
                                                                      {"y std", "m"},
                                                                      {"heading std", "rad"}}};
  for (std::size_t c = 0; c < names.size(); ++c) {
    // One value a row by construction.
    static_cast<void>(series.add(names[c].first, names[c].second, std::move(columns[c])));
  }
  return to_csv(series);
}

AnswerFile localize_log_file(const LocalizeResult& result) {
  WpilogWriter writer("Flyball localize");
  const double begin = result.log.odometry.front().time;
  const auto add = [&](const std::string& name, const LocalizedPath& path) {
    std::vector<TimedPose> poses;
    for (std::size_t i = 0; i < path.time.size(); ++i) {
      poses.push_back({path.time[i] - begin, on_the_floor(path.pose[i])});
    }
    write_poses(writer, "/Flyball/" + name, poses);
  };
  add("odometry", result.odometry);
  add("filter", result.filter.path);
  if (result.smoother) {
    add("smoother", result.smoother->path);
  }
  if (!result.truth.pose.empty()) {
    add("truth", result.truth);
  }
  return {"data/poses.wpilog", writer.bytes()};
}

}  // namespace flyball::study
