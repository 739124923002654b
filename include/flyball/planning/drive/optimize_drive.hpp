#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/core/function_ref.hpp>
#include <flyball/planning/drive/drive_problem.hpp>

/// Time-optimal trajectories of drivetrains.
namespace flyball {

/// A point of a trajectory. What pushes is held until the next.
struct DriveSample {
  double time = 0.0;               ///< s
  double x = 0.0, y = 0.0;         ///< m
  double heading = 0.0;            ///< rad, not wrapped.
  double vx = 0.0, vy = 0.0;       ///< m/s, in the field.
  double omega = 0.0;              ///< rad/s
  double ax = 0.0, ay = 0.0;       ///< m/s², in the field.
  double alpha = 0.0;              ///< rad/s²
  double left = 0.0, right = 0.0;  ///< m/s, of a differential drive's sides.
  /// N: of swerve modules in the field; of mecanum wheels and sides along the wheel, y being zero.
  std::array<Eigen::Vector2d, 4> forces{};
};

/// By how much something is not kept.
struct DriveViolation {
  std::string name{};   ///< The constraint, the waypoint or the wheel.
  int segment = 0;      ///< From this waypoint to the next; the last waypoint's number at the end.
  double time = 0.0;    ///< s, where it is worst.
  double amount = 0.0;  ///< In its unit.
  std::string unit{};   ///< "m", "m/s", …
  double share = 0.0;   ///< Of its limit; of what has none, of 1.
  int constraint = -1;  ///< Place among the problem's; -1: none of them.
};

/// A start that was tried.
struct DriveAttempt {
  std::string name{};  ///< Such as "left of keep out circle 1, turning the long way".
  bool solved = false;
  double duration = 0.0;  ///< s
  int iterations = 0;
  double seconds = 0.0;
};

/// How to search.
struct DriveOptions {
  double tolerance = 1e-7;   ///< Of the first-order conditions.
  int max_iterations = 400;  ///< Of one attempt.
  double time_limit = 60.0;  ///< s, of all.
  int max_attempts = 4;      ///< Starts that are tried.
  /// Shares of limits that may be exceeded between points: where it is more, limits are drawn
  /// tighter there.
  double keep_limits_to = 5e-4;
  double longest_segment = 120.0;  ///< s, from a waypoint to the next, at most.
};

/// A trajectory, and what an independent simulation says of it.
///
/// It is solved where it is at an optimum and the simulation finds it within 1 mm and 1 mrad of
/// what waypoints fix and within 0.1 % of each limit: a speed, a force, an acceleration; of areas
/// 0.1 % of a radius or tolerance between 1 cm and 1 m, of polygons 1 mm.
struct DriveSolution {
  bool solved = false;
  bool found = false;    ///< At an optimum, whatever the simulation says.
  bool elastic = false;  ///< Whether constraints had to give way: `relaxed` says which.
  std::vector<DriveSample> samples{};
  std::vector<double> waypoint_times{};   ///< s
  std::vector<int> waypoint_samples{};    ///< Index of each waypoint's sample.
  double duration = 0.0;                  ///< s
  std::vector<DriveViolation> relaxed{};  ///< What cannot be kept, the worst first.
  /// Of a simulation of the rigid body to 1e-10 under the samples' forces, from the start alone.
  ///@{
  double waypoint_error = 0.0;               ///< m, the largest distance from a fixed waypoint.
  double heading_error = 0.0;                ///< rad, of a fixed heading.
  std::vector<DriveViolation> violations{};  ///< Limits and constraints, the worst first, to 10.
  ///@}
  std::vector<DriveAttempt> attempts{};
  std::string best{};     ///< The attempt whose trajectory this is.
  std::string message{};  ///< What a person should know; empty where solved.
  double seconds = 0.0;   ///< Wall time.
};

/// Where the search stands.
struct DriveProgress {
  std::string_view attempt{};
  int iteration = 0;
  double duration = 0.0;  ///< s, of the trajectory so far.
  double infeasibility = 0.0;
};

/// The fastest trajectory through the waypoints within the constraints.
///
/// Each segment has its own free time, in equal intervals over which forces are held; a step of
/// Runge and Kutta's method each. Several starts (which side of an obstacle, which way round) are
/// tried, the fastest end counts. Where limits are exceeded between two points, they are drawn
/// tighter at these by what a dense simulation finds and the trajectory is solved again; if that
/// does not do, with intervals half as long. Where no attempt succeeds, the problem is solved with
/// constraints that give way at a price on their sum, so that few do.
/// @errors ArgumentError: not_positive, not_finite, out_of_range for the model, a waypoint, a
///         constraint, each by name; empty for less than two waypoints.
/// Cost: some milliseconds a second of motion and attempt.
/// Source: Verschueren et al., "Towards time-optimal race car driving" (2014) for free time in a
/// direct method; constraints as Choreo has them.
[[nodiscard]] Expected<DriveSolution> optimize_drive(const DriveProblem& problem,
                                                     const DriveOptions& options = {});
/// The same. @param watch  Called each iteration; true stops.
[[nodiscard]] Expected<DriveSolution> optimize_drive(const DriveProblem& problem,
                                                     const DriveOptions& options,
                                                     FunctionRef<bool(const DriveProgress&)> watch);

/// What an independent simulation says.
struct DriveCheck {
  double waypoint_error = 0.0;               ///< m
  double heading_error = 0.0;                ///< rad
  std::vector<DriveViolation> violations{};  ///< The largest share first, to 10.
};
/// Simulates a trajectory's forces from its first sample and measures limits and constraints at
/// a hundred instants of each interval: what `DriveSolution` carries.
/// @param samples, waypoint_samples  Of the solution; others than the problem's are not looked at.
/// Cost: an integration of each interval to 1e-10.
[[nodiscard]] DriveCheck check_drive(const DriveProblem& problem,
                                     const std::vector<DriveSample>& samples,
                                     const std::vector<int>& waypoint_samples);

}  // namespace flyball
