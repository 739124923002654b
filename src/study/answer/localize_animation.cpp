// The robot on its map, moving along the path that was found.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "study/answer/drawing.hpp"
#include "study/answer/localize_animation.hpp"

namespace flyball::study {

namespace {

constexpr std::size_t most_moments = 2000;

/// Moves a part along poses; headings go on where they wrap.
void put(MovingPart& part, const std::vector<Pose2d>& poses) {
  const double turn = 2.0 * std::numbers::pi;
  for (const Pose2d& pose : poses) {
    part.to_x.push_back(pose.x());
    part.to_y.push_back(pose.y());
    const double before = part.angle.empty() ? pose.angle() : part.angle.back();
    part.angle.push_back(pose.angle() + turn * std::round((before - pose.angle()) / turn));
  }
}

}  // namespace

std::vector<Animation> localize_animation(const LocalizeResult& result, std::string section,
                                          std::string clock) {
  const LocalizedPath& path = result.smoother ? result.smoother->path : result.filter.path;
  if (path.time.size() < 2) {
    return {};
  }
  const std::size_t stride = (path.time.size() + most_moments - 1) / most_moments;
  const double begin = result.log.odometry.front().time;
  Animation animation{.section = std::move(section),
                      .name = "animation",
                      .title = "The robot on its map",
                      .clock = std::move(clock)};
  std::vector<Pose2d> poses;
  std::vector<Pose2d> truths;
  MovingPart way;
  way.style = PartStyle::ground;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  std::size_t truth = 0;
  for (std::size_t i = 0; i < path.time.size(); i += stride) {
    const Pose2d& pose = path.pose[i];
    animation.time.push_back(path.time[i] - begin);
    poses.push_back(pose);
    way.x.push_back(pose.x());
    way.y.push_back(pose.y());
    low = std::min({low, pose.x(), pose.y()});
    high = std::max({high, pose.x(), pose.y()});
    while (truth + 1 < result.truth.time.size() && result.truth.time[truth] < path.time[i]) {
      ++truth;
    }
    if (!result.truth.pose.empty()) {
      truths.push_back(result.truth.pose[truth]);
    }
  }
  MovingPart landmarks;
  landmarks.style = PartStyle::ground;
  for (const Landmark& landmark : result.log.landmarks) {
    low = std::min({low, landmark.position(0), landmark.position(1)});
    high = std::max({high, landmark.position(0), landmark.position(1)});
  }
  const double size = high > low ? 0.02 * (high - low) : 0.1;
  const double gap = std::numeric_limits<double>::quiet_NaN();
  for (const Landmark& landmark : result.log.landmarks) {
    const double x = landmark.position(0);
    const double y = landmark.position(1);
    const double half = 0.4 * size;
    landmarks.x.insert(landmarks.x.end(), {x - half, x + half, x + half, x - half, x - half, gap});
    landmarks.y.insert(landmarks.y.end(), {y - half, y - half, y + half, y + half, y - half, gap});
  }
  MovingPart robot{.x = {-size, 1.6 * size, -size, -size}, .y = {-size, 0.0, size, -size}};
  animation.parts = {std::move(way)};
  if (!landmarks.x.empty()) {
    animation.parts.push_back(std::move(landmarks));
  }
  if (!truths.empty()) {
    MovingPart& outline = animation.parts.emplace_back(robot);
    outline.label = "truth";
    outline.style = PartStyle::outlined;
    outline.color = simulated_color;
    put(outline, truths);
  }
  robot.label = result.smoother ? "smoother" : "filter";
  robot.color = measured_color;
  put(robot, poses);
  animation.values = {
      {"x", "m", robot.to_x}, {"y", "m", robot.to_y}, {"heading", "rad", robot.angle}};
  animation.parts.push_back(std::move(robot));
  animation.description =
      "Where the robot was, as a triangle that points ahead and is larger than it is, among the "
      "landmarks" +
      std::string(truths.empty() ? "" : ", dashed where it truly was") +
      ". It shows the moment that the cursor of the plots below is at, and the other way round.";
  return {std::move(animation)};
}

}  // namespace flyball::study
