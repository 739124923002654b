#pragma once

#include <optional>
#include <span>
#include <vector>

#include <flyball/control/followers/follower.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/planning/splines/spline.hpp>

namespace flyball {

/// How a robot moves towards the point that it pursues.
enum class PursuitDrive {
  on_arcs,           ///< Along the arc that leads there: differential drives, steered cars.
  in_any_direction,  ///< Straight there, turning as the path's headings do: swerve, mecanum.
};

/// What tunes pure pursuit.
struct PurePursuitSettings {
  PursuitDrive drive = PursuitDrive::on_arcs;
  bool reversed = false;  ///< Backs along the path; the poses' headings are still along it. On arcs
                          ///< only.
  double velocity = 0.0;  ///< m/s, > 0, along the path.
  double acceleration = std::numeric_limits<double>::infinity();  ///< m/s², > 0: of the start, and
                                                                  ///< of the braking at the end.
  double centripetal = std::numeric_limits<double>::infinity();   ///< m/s², > 0: v² |κ|.
  /// The lookahead distance is lookahead_time times the speed, within these two; m, s.
  double least_lookahead = 0.3;
  double largest_lookahead = 1.5;
  double lookahead_time = 0.5;
  double heading_gain = 4.0;  ///< 1/s, of a robot that moves in any direction.
  double tolerance = 0.02;    ///< m, > 0: so near the path's end, or past it, it has arrived.
  Time period{0.02};          ///< T > 0, between two calls.
  SpeedLimits limits{};
};

/// Pure pursuit: towards the point of the path one lookahead distance on, along the arc that is
/// tangent to the robot and leads there,
///
///     κ = 2 sin α / d,    ω = v κ,
///
/// α the bearing of that point and d its distance; a point behind is turned to as tightly as one
/// abeam. The lookahead adapts to the speed, and the speed to the curvature, the limits and what is
/// left of the path. It tracks a path, not its times: a robot that is held up goes on from where it
/// is. Past the path's end the pursued point moves on straight, so that the robot arrives along the
/// path.
///
/// Progress along the path is searched forward only, within twice the largest lookahead, so that a
/// path may cross itself, until the robot is farther away than that; then it is searched in all of
/// the path that is left.
///
/// Run-time object: noexcept, allocation-free, O(points within the search); finite and within the
/// limits whatever comes. Source: Coulter, "Implementation of the Pure Pursuit Path Tracking
/// Algorithm", CMU-RI-TR-92-01 (1992); named in the book's section 8.8; the regulated speed:
/// Macenski, Singh, Martín, Ginés, "Regulated pure pursuit for robot path tracking", Autonomous
/// Robots 47 (2023), equations (4) to (9).
class PurePursuitFollower {
 public:
  /// @param path  Two points or more, neighbours in different places; copied.
  /// @errors ArgumentError::empty, not_finite, not_positive, out_of_range (neighbours in one place,
  ///         lookaheads in the wrong order, backing in any direction).
  [[nodiscard]] static Expected<PurePursuitFollower> create(std::span<const PathPoint> path,
                                                            const PurePursuitSettings& settings);

  /// @param pose  The estimated pose.
  FollowerCommand calculate(const Pose2d& pose) noexcept;

  /// Starts the path anew.
  void reset() noexcept;
  /// Whether it has come to the path's end; the command is then to stand still.
  [[nodiscard]] bool arrived() const noexcept { return arrived_; }
  /// m of the path that are done, and its length.
  [[nodiscard]] double progress() const noexcept { return progress_; }
  [[nodiscard]] double length() const noexcept { return stations_.back(); }
  /// m from the path, positive where the robot is to its left.
  [[nodiscard]] double cross_track() const noexcept { return cross_track_; }
  /// The last command's curvature, 1/m: a car of a wheelbase L steers by atan(L κ).
  [[nodiscard]] double curvature() const noexcept { return curvature_; }
  /// m, what it looked ahead last.
  [[nodiscard]] double lookahead() const noexcept { return lookahead_; }
  /// The point that it pursued last, m.
  [[nodiscard]] const Eigen::Vector2d& target() const noexcept { return target_; }

 private:
  PurePursuitFollower(std::vector<PathPoint> path, std::vector<double> stations,
                      const PurePursuitSettings& settings) noexcept;

  struct Place {
    Eigen::Vector2d position;
    std::size_t segment = 0;
    double fraction = 0.0;
  };
  /// Of a distance along the path; beyond its end straight on.
  [[nodiscard]] Place at(double station) const noexcept;
  void advance(const Eigen::Vector2d& position) noexcept;
  [[nodiscard]] double speed_for(double curvature, double remaining) const noexcept;

  std::vector<PathPoint> path_;
  std::vector<double> stations_;  ///< m along the path of each point.
  PurePursuitSettings settings_;
  std::size_t segment_ = 0;  ///< On which the robot is.
  double progress_ = 0.0;
  double distance_ = 0.0;  ///< m, of the robot from the path.
  double cross_track_ = 0.0;
  double speed_ = 0.0;  ///< m/s, of the last command, not negative.
  double curvature_ = 0.0;
  double lookahead_ = 0.0;
  Eigen::Vector2d target_ = Eigen::Vector2d::Zero();
  bool arrived_ = false;
};

}  // namespace flyball
