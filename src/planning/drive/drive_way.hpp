#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <flyball/planning/drive/drive_problem.hpp>

/// The way that a start of the search goes: where along, and how fast.
namespace flyball::drive_way {

/// A way to look: on which side of each obstacle, and how headings turn.
struct Choice {
  std::vector<int> sides{};  ///< Of each constraint: 1 left, -1 right, 0 no obstacle in the way.
  bool curved = true;        ///< Of what steers: along its headings, not turning in place at stops.
  bool other_end = false;    ///< Of what steers: the other end of the robot goes first.
  bool as_typed = false;     ///< Headings as they are given, not by the shorter turn.
};

/// Points of the way, some ten centimetres apart.
struct Way {
  std::vector<Eigen::Vector2d> points{};
  std::vector<double> headings{};        ///< rad, not wrapped.
  std::vector<double> arcs{};            ///< m, turning in place counted as what wheels roll.
  std::vector<std::size_t> waypoints{};  ///< Points that waypoints are.
};

/// From stop to stop a C2 cubic spline through the waypoints, and through places beside the
/// obstacles that it would touch otherwise. What steers looks along it, and turns where it stops.
[[nodiscard]] Way way_of(const DriveProblem& problem, const Choice& choice);

/// When each point is passed.
struct Timing {
  std::vector<double> times{};   ///< s
  std::vector<double> speeds{};  ///< m/s of the arc.
};

/// The times of a heavy hand: the speed that limits and bends allow at each point, then forwards
/// what the wheels reach, backwards what they brake.
/// Source: Bobrow, Dubowsky, Gibson (1985), with the limits of the point reached last.
[[nodiscard]] Timing time_way(const DriveProblem& problem, const Way& way);

/// How far the way is out of areas to stay in, or in those to stay out of, at most; m.
[[nodiscard]] double intrusion(const DriveProblem& problem, const Way& way);

/// Whether a constraint holds from a waypoint to the next.
[[nodiscard]] bool applies(const DriveProblem& problem, const DriveConstraint& constraint,
                           std::size_t segment);
/// How near a straight way comes to a point; where along it.
struct Approach {
  double distance = 0.0, share = 0.0;
};
[[nodiscard]] Approach nearest(const Eigen::Vector2d& p, const Eigen::Vector2d& a,
                               const Eigen::Vector2d& b);
/// What is kept between the middle and an obstacle's: more than it takes.
[[nodiscard]] double berth(const DriveProblem& problem, const DriveConstraint& obstacle);

}  // namespace flyball::drive_way
