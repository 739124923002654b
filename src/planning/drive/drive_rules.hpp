#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/planning/drive/drive_problem.hpp>

/// What a problem's constraints mean.
namespace flyball::drive_rules {

/// The waypoints that a constraint spans.
struct Span {
  int from = 0;
  int to = 0;
};
[[nodiscard]] Span span_of(const DriveProblem& problem, const DriveConstraint& constraint);

/// "keep out circle 2", or the name it was given.
[[nodiscard]] std::string name_of(const DriveProblem& problem, std::size_t constraint);

/// Whether a waypoint is passed at rest.
[[nodiscard]] bool stops_at(const DriveProblem& problem, int waypoint);

/// Whether a constraint keeps the robot out of something.
[[nodiscard]] bool is_obstacle(const DriveConstraint& constraint) noexcept;
/// The middle of an obstacle, and how far it reaches.
struct Disc {
  Eigen::Vector2d center{};
  double radius = 0.0;
};
[[nodiscard]] Disc disc_of(const DriveConstraint& obstacle);

/// The bumpers' corners, or the middle of a robot without.
[[nodiscard]] std::vector<Eigen::Vector2d> corners_of(const DriveModel& model);
/// How far the bumpers reach from the middle.
[[nodiscard]] double reach_of(const DriveModel& model);
/// How far the wheels are from the middle: what they roll by a turn of 1 rad. 5 cm at least.
[[nodiscard]] double wheel_reach_of(const DriveModel& model);

/// The way from one waypoint to another: a point, and the direction to the left of it.
struct Lane {
  Eigen::Vector2d start{}, left{};
};
[[nodiscard]] Lane lane_of(const DriveProblem& problem, const DriveConstraint& constraint);

/// The distance between two convex shapes; negative: how deep the one is in the other.
[[nodiscard]] double distance(const std::vector<Eigen::Vector2d>& a,
                              const std::vector<Eigen::Vector2d>& b);

/// How far a state and its acceleration are beyond a constraint, in its unit; negative inside.
struct Excess {
  double amount = 0.0;
  double limit = 1.0;  ///< What the amount is a share of.
};
[[nodiscard]] Excess excess(const DriveProblem& problem, const DriveConstraint& constraint,
                            const Eigen::VectorXd& x, const Eigen::VectorXd& u);
/// "m", "m/s", "m/s²", "rad/s", "rad".
[[nodiscard]] std::string_view unit_of(DriveConstraintKind kind);

/// @errors as optimize_drive.
[[nodiscard]] Expected<void> check(const DriveProblem& problem);

}  // namespace flyball::drive_rules
