// The poses of a model whose states say one.
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "study/answer/pose_log.hpp"

namespace flyball::study {

namespace {

/// Where the states of a pose are; none where there are none.
struct PoseStates {
  std::optional<Eigen::Index> x, y, z, roll, pitch, yaw;
  [[nodiscard]] bool is_pose() const { return x && y && yaw; }
};

PoseStates pose_states(const std::vector<Coordinate>& states) {
  PoseStates found;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto is = [&](std::string_view name, std::string_view unit) {
      return states[i].name == name && states[i].unit == unit;
    };
    const auto at = static_cast<Eigen::Index>(i);
    for (const auto& [place, name] :
         {std::pair(&found.x, "x"), std::pair(&found.y, "y"), std::pair(&found.z, "z")}) {
      if (is(name, "m")) {
        *place = at;
      }
    }
    for (const auto& [place, name] :
         {std::pair(&found.roll, "roll"), std::pair(&found.pitch, "pitch"),
          std::pair(&found.yaw, "yaw"), std::pair(&found.yaw, "heading"),
          std::pair(&found.yaw, "theta")}) {
      if (is(name, "rad")) {
        *place = at;
      }
    }
  }
  return found;
}

}  // namespace

void write_estimated_poses(WpilogWriter& writer, const Estimation& result) {
  const PoseStates states = pose_states(result.model.names().states);
  if (!states.is_pose()) {
    return;
  }
  const auto add = [&](const std::string& name, Eigen::MatrixXd EstimatedRun::* of) {
    std::vector<TimedPose> poses;
    for (const EstimatedRun& run : result.runs) {
      const Eigen::MatrixXd& x = run.*of;
      for (Eigen::Index k = 0; k < x.cols(); ++k) {
        const auto value = [&](const std::optional<Eigen::Index>& state) {
          return state ? x(*state, k) : 0.0;
        };
        const auto about = [](Eigen::Index axis, double angle) {
          return Rotation3d::exp(angle * Eigen::Vector3d::Unit(axis));
        };
        const Rotation3d attitude = about(2, value(states.yaw)) * about(1, value(states.pitch)) *
                                    about(0, value(states.roll));
        if (x.col(k).allFinite()) {
          poses.push_back({run.time[static_cast<std::size_t>(k)],
                           Pose3d({value(states.x), value(states.y), value(states.z)}, attitude)});
        }
      }
    }
    if (!poses.empty()) {
      write_poses(writer, name, poses);
    }
  };
  add("flyball/filter_pose", &EstimatedRun::filtered);
  add("flyball/smoother_pose", &EstimatedRun::smoothed);
}

}  // namespace flyball::study
