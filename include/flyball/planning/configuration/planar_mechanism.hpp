#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace flyball {

/// A joint of a mechanism in the plane, seen from the side: x forward, y up, m, angles
/// counter-clockwise from x.
struct PlanarJoint {
  std::string name{};
  /// Which coordinate of the configuration space moves it: its length or its angle.
  int coordinate = 0;
  bool slides = false;  ///< Along the x axis of its own frame; else it turns about its origin.
  int parent = -1;      ///< An earlier joint, whose frame carries this one; -1: the robot.
  double x = 0.0;       ///< m, where its frame is in the parent's when its coordinate is 0.
  double y = 0.0;
  double angle = 0.0;  ///< rad, how its frame is turned in the parent's then.
};

/// A part of a link: what is within `radius` of a segment in the frame of a joint; without a length
/// a disc.
struct LinkBody {
  std::string name{};
  int joint = 0;
  std::array<double, 2> from{};  ///< m
  std::array<double, 2> to{};
  double radius = 0.0;  ///< m, >= 0
};

/// A weight that a joint carries.
struct LinkMass {
  int joint = 0;
  std::array<double, 2> at{};  ///< m, in the joint's frame.
  double mass = 0.0;           ///< kg
};

/// What does not move, or the room that must not be left.
struct PlanarObstacle {
  /// What its numbers mean.
  enum class Shape {
    disc,        ///< Within `radius` of `at`.
    half_plane,  ///< {p : normal·(p - at) <= 0}: a floor has the normal (0, 1).
    polygon,     ///< Within `vertices`.
    frame,       ///< Everything outside of `vertices`, which are convex: a frame perimeter.
  };
  std::string name{};
  Shape shape = Shape::disc;
  std::array<double, 2> at{};  ///< m
  double radius = 0.0;
  std::array<double, 2> normal{};
  std::vector<std::array<double, 2>> vertices{};
  /// Names of bodies that may touch it; the others may not.
  std::vector<std::string> spares{};

  /// @param at, radius  m.
  [[nodiscard]] static PlanarObstacle disc(std::string name, std::array<double, 2> at,
                                           double radius);
  /// @param at  On its border, m. @param normal  Out of it; any length but 0.
  [[nodiscard]] static PlanarObstacle half_plane(std::string name, std::array<double, 2> at,
                                                 std::array<double, 2> normal);
  /// @param vertices  m, in either sense, without crossing edges; 3 to 1000.
  [[nodiscard]] static PlanarObstacle polygon(std::string name,
                                              std::vector<std::array<double, 2>> vertices);
  /// @param low, high  Opposite corners, m.
  [[nodiscard]] static PlanarObstacle box(std::string name, std::array<double, 2> low,
                                          std::array<double, 2> high);
  /// @param vertices  m, of a convex polygon.
  [[nodiscard]] static PlanarObstacle frame(std::string name,
                                            std::vector<std::array<double, 2>> vertices);
};

/// How much a joint may hold against gravity.
struct HoldingLimit {
  int joint = 0;
  /// N·m of a joint that turns, N of one that slides; > 0.
  double most = 0.0;
};

/// A mechanism in the plane whose links must not touch what stands around them: elevators, arms and
/// trees of them. A configuration is forbidden where a body is nearer to an obstacle, or to a body
/// that it may not touch, than their radii, and where a joint would have to hold more against
/// gravity than it may.
struct PlanarMechanism {
  std::vector<PlanarJoint> joints{};  ///< Parents before what they carry; at most 16.
  std::vector<LinkBody> bodies{};
  std::vector<PlanarObstacle> obstacles{};
  /// Pairs of names of bodies that must not touch each other.
  std::vector<std::array<std::string, 2>> apart{};
  std::vector<LinkMass> masses{};
  std::vector<HoldingLimit> holding{};
  double gravity = 9.80665;  ///< m/s², downwards.
};

/// Where a frame is in the plane.
struct PlanarFrame {
  double x = 0.0;
  double y = 0.0;
  double angle = 0.0;  ///< rad
};

/// The frames of the joints at a configuration, one a joint. Joints whose parent or coordinate is
/// not there stay at the robot's own frame. Cost: O(joints); allocates the result.
[[nodiscard]] std::vector<PlanarFrame> joint_frames(const PlanarMechanism& mechanism,
                                                    const std::vector<double>& q);

}  // namespace flyball
