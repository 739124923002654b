#include <cmath>
#include <limits>

#include <flyball/control/lqr.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/linearize.hpp>

#include "book/chapter_8/followed_trajectory.hpp"
#include "book/figure_functions.hpp"

/// Figures 8.4 to 8.9: linear time-varying regulators of a differential drive (sections 8.7.4,
/// 8.7.5).
namespace flyball::book {

namespace {

/// The slowest velocity at which the book linearises: at rest the drive cannot move sideways.
constexpr double least_velocity = 1e-9;

/// V: the loop limits the sum of feedback and feedforward itself.
constexpr double largest_voltage = 1e6;

/// In the field's frame: each period the regulator of the model linearised where the robot is.
Eigen::Vector2d in_global_frame(const DriveVector& x, const DriveVector& r) {
  DriveVector about = x;
  if (std::abs(0.5 * (x(3) + x(4))) < least_velocity) {
    about.tail<2>().setConstant(least_velocity);
  }
  const auto model = linearize(FieldDrive{}, about, Eigen::Vector2d(0.0, 0.0)).value();
  const auto plant = discretize(model, drive_period).value();
  const auto K =
      lqr(plant, bryson({0.05, 0.125, 10.0, 0.95, 0.95}), bryson({12.0, 12.0})).value().K;
  return K * (r - x);
}

/// Theorem 8.7.4: the error in the robot's frame, the model linearised at θ = 0.
DriveFeedback cross_track() {
  LtvDriveSettings settings{.x_tolerance = 0.05,
                            .y_tolerance = 0.125,
                            .heading_tolerance = 10.0,
                            .velocity_tolerance = 0.95,
                            .voltage_tolerance = 12.0,
                            .voltage_limit = largest_voltage,
                            .period = drive_period};
  settings.low_speed = {least_velocity, LowSpeed::CrossTrack::holds};
  settings.farthest_error = std::numeric_limits<double>::infinity();
  settings.largest_velocity = 10.0;
  const auto follower =
      LtvDriveFollower::create(case_study_drive(), drive_trackwidth, settings).value();
  return [follower](const DriveVector& x, const DriveVector& r) {
    return follower
        .calculate(DriveState{{x(0), x(1), x(2)}, x(3), x(4)},
                   DriveState{{r(0), r(1), r(2)}, r(3), r(4)}, Eigen::Vector2d::Zero().eval())
        .voltage;
  };
}

}  // namespace

FigureResult figure_8_4() {
  return path_figure("8.4", "LTV differential drive, first-order: path",
                     follow(in_global_frame, DriveMotion::first_order));
}
FigureResult figure_8_5() {
  return response_figure("8.5", "LTV differential drive, first-order: response",
                         follow(in_global_frame, DriveMotion::first_order));
}
FigureResult figure_8_6() {
  return path_figure("8.6", "LTV differential drive in the global frame: path",
                     follow(in_global_frame));
}
FigureResult figure_8_7() {
  return response_figure("8.7", "LTV differential drive in the global frame: response",
                         follow(in_global_frame));
}
FigureResult figure_8_8() {
  return path_figure("8.8", "LTV differential drive: path", follow(cross_track()));
}
FigureResult figure_8_9() {
  return response_figure("8.9", "LTV differential drive: response", follow(cross_track()));
}

}  // namespace flyball::book
