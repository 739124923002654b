#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <flyball/control/followers/ltv_unicycle.hpp>
#include <flyball/control/followers/ramsete.hpp>

#include "book/chapter_8/followed_trajectory.hpp"
#include "book/figure_functions.hpp"

/// Figures 8.10 to 8.13: followers of a pose tell the sides' velocities, which a regulator of
/// Theorem 8.7.1 tracks (sections 8.8 and 8.9).
namespace flyball::book {

namespace {

Pose2d pose_of(const DriveVector& x) {
  return {x(0), x(1), x(2)};
}

TrackingPoint point_of(const DriveVector& r) {
  return {pose_of(r), {0.5 * (r(3) + r(4)), 0.0, (r(4) - r(3)) / drive_trackwidth.si()}};
}

/// K (what a follower wants - the velocities).
template <class Follower>
DriveFeedback tracked(Follower follower) {
  const auto tracker = DriveVelocityTracker::create(case_study_drive()).value();
  return [tracker, follower](const DriveVector& x, const DriveVector& r) -> Eigen::Vector2d {
    const auto command = follower(pose_of(x), point_of(r));
    return tracker.K() * (side_velocities(command, drive_trackwidth.si()) - x.tail<2>());
  };
}

/// Theorem 8.8.2 with b = 2 rad²/m² and ζ = 0.7/rad.
DriveFeedback ramsete() {
  const auto follower = RamseteFollower::create({.b = 2.0, .zeta = 0.7}).value();
  return tracked([follower](const Pose2d& pose, const TrackingPoint& r) {
    return follower.calculate(pose, r).speeds;
  });
}

/// The book's script has the normalised sinc, sin(πe)/(πe), where (8.28) is sin(e)/e.
DriveFeedback ramsete_of_script() {
  const auto follower = RamseteFollower::create({.b = 2.0, .zeta = 0.7}).value();
  return tracked([follower](const Pose2d& pose, const TrackingPoint& r) {
    const Eigen::Vector3d e = tracking_error(pose, r.pose);
    const auto sinc = [](double angle) { return angle == 0.0 ? 1.0 : std::sin(angle) / angle; };
    auto speeds = follower.calculate(pose, r).speeds;
    speeds.omega += 2.0 * r.speeds.vx * (sinc(std::numbers::pi * e(2)) - sinc(e(2))) * e(1);
    return speeds;
  });
}

/// Theorem 8.9.1.
LtvUnicycleFollower unicycle_follower() {
  LtvUnicycleSettings settings{.x_tolerance = 0.0625,
                               .y_tolerance = 0.125,
                               .heading_tolerance = 2.5,
                               .velocity_tolerance = 0.95,
                               .angular_velocity_tolerance = 0.95,
                               .period = drive_period};
  // Linearised around a slightly nonzero velocity where the reference stands.
  settings.low_speed = {1e-9, LowSpeed::CrossTrack::holds};
  settings.farthest_error = std::numeric_limits<double>::infinity();
  return LtvUnicycleFollower::create(settings).value();
}

DriveFeedback unicycle() {
  return tracked([follower = unicycle_follower()](const Pose2d& pose, const TrackingPoint& r) {
    return follower.calculate(pose, r).speeds;
  });
}

/// At 1e-9 m/s, where the figure begins, the book's solver has five digits of the gain.
DriveFeedback unicycle_of_script() {
  constexpr double k_y = 7.571268898455848;  // what it answered; 7.571174870… is right
  return tracked([follower = unicycle_follower()](const Pose2d& pose, const TrackingPoint& r) {
    auto speeds = follower.calculate(pose, r).speeds;
    if (r.speeds.vx == 0.0) {
      speeds.omega += (k_y - follower.K(0.0)(1, 1)) * tracking_error(pose, r.pose)(1);
    }
    return speeds;
  });
}

/// The theorem's run, and that of the script beside it.
FigureResult figure_of(std::string id, std::string title, const DriveFeedback& theorem,
                       const DriveFeedback& script) {
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  add_run(figure, follow(theorem));
  add_run(figure, follow(script), "_script");
  return figure;
}

}  // namespace

FigureResult figure_8_10() {
  FigureResult figure = figure_of("8.10", "Ramsete: path", ramsete(), ramsete_of_script());
  figure.picture = path_plot(figure);
  return figure;
}
FigureResult figure_8_11() {
  FigureResult figure = figure_of("8.11", "Ramsete: response", ramsete(), ramsete_of_script());
  figure.picture = drive_response_plot(figure);
  return figure;
}
FigureResult figure_8_12() {
  FigureResult figure = figure_of("8.12", "LTV unicycle: path", unicycle(), unicycle_of_script());
  figure.picture = path_plot(figure);
  return figure;
}
FigureResult figure_8_13() {
  FigureResult figure =
      figure_of("8.13", "LTV unicycle: response", unicycle(), unicycle_of_script());
  figure.picture = drive_response_plot(figure);
  return figure;
}

}  // namespace flyball::book
