#include <flyball/planning/configuration/planar_mechanism.hpp>

#include <cmath>
#include <utility>

namespace flyball {

PlanarObstacle PlanarObstacle::disc(std::string name, std::array<double, 2> at, double radius) {
  PlanarObstacle one;
  one.name = std::move(name);
  one.shape = Shape::disc;
  one.at = at;
  one.radius = radius;
  return one;
}

PlanarObstacle PlanarObstacle::half_plane(std::string name, std::array<double, 2> at,
                                          std::array<double, 2> normal) {
  PlanarObstacle one;
  one.name = std::move(name);
  one.shape = Shape::half_plane;
  one.at = at;
  one.normal = normal;
  return one;
}

PlanarObstacle PlanarObstacle::polygon(std::string name,
                                       std::vector<std::array<double, 2>> vertices) {
  PlanarObstacle one;
  one.name = std::move(name);
  one.shape = Shape::polygon;
  one.vertices = std::move(vertices);
  return one;
}

PlanarObstacle PlanarObstacle::box(std::string name, std::array<double, 2> low,
                                   std::array<double, 2> high) {
  return polygon(std::move(name), {low, {high[0], low[1]}, high, {low[0], high[1]}});
}

PlanarObstacle PlanarObstacle::frame(std::string name,
                                     std::vector<std::array<double, 2>> vertices) {
  PlanarObstacle one = polygon(std::move(name), std::move(vertices));
  one.shape = Shape::frame;
  return one;
}

std::vector<PlanarFrame> joint_frames(const PlanarMechanism& mechanism,
                                      const std::vector<double>& q) {
  std::vector<PlanarFrame> frames;
  frames.reserve(mechanism.joints.size());
  for (const PlanarJoint& joint : mechanism.joints) {
    PlanarFrame at;
    if (joint.parent >= 0 && static_cast<std::size_t>(joint.parent) < frames.size()) {
      at = frames[static_cast<std::size_t>(joint.parent)];
    }
    const double c = std::cos(at.angle);
    const double s = std::sin(at.angle);
    at.x += c * joint.x - s * joint.y;
    at.y += s * joint.x + c * joint.y;
    at.angle += joint.angle;
    if (joint.coordinate >= 0 && static_cast<std::size_t>(joint.coordinate) < q.size()) {
      const double moved = q[static_cast<std::size_t>(joint.coordinate)];
      if (joint.slides) {
        at.x += moved * std::cos(at.angle);
        at.y += moved * std::sin(at.angle);
      } else {
        at.angle += moved;
      }
    }
    frames.push_back(at);
  }
  return frames;
}

}  // namespace flyball
