#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/geometry/se2.hpp>
#include <flyball/planning/path/path.hpp>

/// Paths joined, cut, turned round, moved, mirrored, and given a heading of their own. Of a path of
/// three coordinates (x, y, θ) the heading goes with it; of any other the first two move, and those
/// after them stay.
namespace flyball {

/// One path after the other. The later ones' parameters are stretched so that |q'| is continuous
/// where both move on in one direction; where they do not, there is a corner or a cusp, at which a
/// trajectory stops. @param paths  One or more of as many coordinates, each beginning where the one
/// before it ends. @errors As `Path::join`. Cost: O(pieces), allocates.
[[nodiscard]] Expected<Path> joined(std::span<const Path> paths);

/// The part of a path between two parameters. @errors ArgumentError::out_of_range for parameters
/// that do not ascend or are outside; not_finite. Cost: O(pieces · degree²), allocates.
[[nodiscard]] Expected<Path> part_of(const Path& path, double from, double to);

/// From the end to the beginning.
[[nodiscard]] Path reversed(const Path& path);

/// Moved by a transform of the plane: what was at the origin is at the pose.
/// @errors ArgumentError::wrong_shape (fewer than two coordinates), not_finite.
[[nodiscard]] Expected<Path> transformed(const Path& path, const Pose2d& by);

/// As seen from a pose: the transform's inverse. @errors As `transformed`.
[[nodiscard]] Expected<Path> relative_to(const Path& path, const Pose2d& pose);

/// Mirrored at the line through a point in a direction; a heading θ becomes 2 φ - θ.
/// @param point  m. @param direction  φ, rad: π/2 at x = 8.27 m mirrors a field of 16.54 m.
/// @errors As `transformed`.
[[nodiscard]] Expected<Path> mirrored(const Path& path, const Eigen::Vector2d& point,
                                      double direction);

/// A heading of a holonomic robot, somewhere along its path.
struct PathHeading {
  double parameter = 0.0;
  double heading = 0.0;  ///< rad
};

/// The path (x, y, θ) of a robot that turns while it drives: θ meets the headings, the shorter way
/// round from each to the next, without overshoot between them and at rest at its turning points
/// and at both ends; before the first and after the last it is constant. θ counts on beyond π.
///
/// θ is the monotone cubic of Fritsch and Carlson (1980) with the harmonic means of the slopes
/// (Brodlie): θ' is continuous, θ'' is not.
/// @param path  Of two coordinates. @param headings  One or more, parameters ascending.
/// @errors ArgumentError::wrong_shape, empty, not_finite, out_of_range.
[[nodiscard]] Expected<Path> with_headings(const Path& path, std::span<const PathHeading> headings);

/// rad: directions of travel that differ by less go on smoothly; files round what they hold.
inline constexpr double corner_angle = 1e-3;

/// Where a path does not go on smoothly.
enum class PathBreak {
  corner,  ///< q' jumps to another direction: nothing moves through it, a trajectory stops.
  cusp,    ///< q' turns by π, or vanishes: the way back, or a point to turn at.
};
/// One of them.
struct PathStop {
  double parameter = 0.0;
  PathBreak kind = PathBreak::corner;
};
/// All of them, inside the path (not its ends). @param along  As in `by_arc_length`.
/// Corners and cusps at breaks between pieces; inside a piece a cusp is found where |q'| falls
/// below 1e-9 of its largest. Cost: O(pieces · degree), allocates.
[[nodiscard]] std::vector<PathStop> path_stops(const Path& path, int along = 0);

}  // namespace flyball
