#pragma once

#include <limits>
#include <span>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/planning/splines/spline.hpp>

namespace flyball {

/// Where a robot is to be, and how fast.
struct TrajectoryPoint {
  double time = 0.0;          ///< s since the start.
  double velocity = 0.0;      ///< m/s along the path.
  double acceleration = 0.0;  ///< m/s² along the path, until the next point.
  Pose2d pose{};
  double curvature = 0.0;  ///< 1/m
};

/// A path with a time at each point; between two points the acceleration is constant.
class Trajectory {
 public:
  /// @param points  Two or more, times ascending; `time_path` makes them.
  explicit Trajectory(std::vector<TrajectoryPoint> points) noexcept : points_(std::move(points)) {}

  [[nodiscard]] const std::vector<TrajectoryPoint>& points() const noexcept { return points_; }
  /// s.
  [[nodiscard]] double total_time() const noexcept { return points_.back().time; }

  /// At a time: the pose on the arc between two points, curvature in proportion to the distance.
  /// @param t  s; before the start (and NaN) the first point, after the end the last.
  /// Cost: O(log points), noexcept, allocation-free.
  [[nodiscard]] TrajectoryPoint sample(double t) const noexcept;

 private:
  std::vector<TrajectoryPoint> points_;
};

/// What a robot must not exceed along a path, and how fast it is at the ends.
struct PathLimits {
  double velocity = 0.0;      ///< m/s, > 0.
  double acceleration = 0.0;  ///< m/s², > 0, along the path.
  /// m/s², > 0, across the path: v² |κ|.
  double centripetal = std::numeric_limits<double>::infinity();
  double start_velocity = 0.0;  ///< m/s, >= 0.
  double end_velocity = 0.0;    ///< m/s, >= 0.
};

/// The fastest times along a path's points under limits: a cap on the velocity at each point, from
/// the velocity and centripetal limits; forward from the start and back from the end the speeds
/// that the acceleration reaches; and the times in which the straight chords are covered.
///
/// @param path  Two points or more, neighbours in different places; `sample_path` makes them.
/// @errors ArgumentError::empty, not_finite, not_positive, out_of_range: a point where its
/// neighbour
///         is; a start or end velocity that is above the limits there, or that the path is too
///         short to brake from or to reach.
/// Cost: O(points), allocates. Source: Bobrow, Dubowsky, Gibson, "Time-optimal control of robotic
/// manipulators along specified paths", Int. J. Robotics Research 4 (1985), for limits that do not
/// depend on the velocity; Kunz and Stilman, "Time-optimal trajectory generation for path following
/// with bounded acceleration and velocity" (2012).
[[nodiscard]] Expected<Trajectory> time_path(std::span<const PathPoint> path,
                                             const PathLimits& limits);

}  // namespace flyball
