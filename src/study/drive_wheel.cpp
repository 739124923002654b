#include <algorithm>
#include <cmath>

#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/swerve_drive.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "study/drive_law.hpp"
#include "study/drive_wheel.hpp"

namespace flyball::study {

double rolling_mass(const DriveRobot& robot, int shafts) {
  return robot.mass + shafts * robot.wheel_inertia / (robot.wheel_radius * robot.wheel_radius);
}

double friction_volts(const mechanisms::DcMotor& motor) {
  return motor.free_current * motor.R;
}

Expected<WheelLaw> WheelLaw::create(const DriveJob& job) {
  const DriveRobot& robot = job.robot;
  FLYBALL_TRY(const auto model, mechanisms::swerve_drive(mechanisms::SwerveDriveParameters{
                                    .motor = robot.motor,
                                    .gearing = robot.gearing,
                                    .mass = Mass(rolling_mass(robot, 4) / 4.0),
                                    .wheel_radius = Length(robot.wheel_radius)}));
  FLYBALL_TRY(const auto plant,
              discretize(static_cast<const ContinuousSystem<1, 1, 1>&>(model), Time(job.period)));
  FLYBALL_TRY(const auto design,
              lqr(plant, bryson({job.velocity_tolerance}), bryson({usual_voltage})));
  return WheelLaw{plant.A(0, 0), plant.B(0, 0), design.K(0, 0), friction_volts(robot.motor),
                  job.max_voltage};
}

double WheelLaw::volts(double measured, double v, double next, bool& saturated) const noexcept {
  const double u = (next - A * v) / B +
                   kS * (next > 0.0   ? 1.0
                         : next < 0.0 ? -1.0
                                      : 0.0) +
                   K * (v - measured);
  saturated = saturated || std::abs(u) > limit;
  return std::clamp(u, -limit, limit);
}

SpinningWheel SpinningWheel::of(const DriveRobot& robot, double period) noexcept {
  const mechanisms::DcMotor& motor = robot.motor;
  const double kV = robot.gearing / (motor.Kv * robot.wheel_radius);
  const double kA = motor.R * robot.wheel_inertia / (robot.wheel_radius * robot.gearing * motor.Kt);
  const double a = std::exp(-period * kV / kA);
  return {a, (1.0 - a) / kV};
}

Expected<double> wheel_gain(const DriveJob& job) {
  // Of one side's error alone, or of both sides'.
  const auto most = [](double own, double other) { return own + std::max(0.0, other); };
  if (job.robot.kind != DriveKind::differential) {
    return WheelLaw::create(job).map([](const WheelLaw& wheel) { return wheel.K; });
  }
  FLYBALL_TRY(const auto model, differential_model(job.robot));
  if (job.follower != DriveFollower::ltv_drive) {
    return DriveVelocityTracker::create(model, drive_tracker_settings(job))
        .map([&](const DriveVelocityTracker& tracker) {
          return most(tracker.K()(0, 0), tracker.K()(0, 1));
        });
  }
  FLYBALL_TRY(const auto follower, LtvDriveFollower::create(model, Length(job.robot.trackwidth),
                                                            ltv_drive_settings(job)));
  double gain = 0.0;
  for (const auto& K : follower.schedule()) {
    gain = std::max(gain, most(K(0, 3), K(0, 4)));
  }
  return gain;
}

Expected<double> calm_velocity_tolerance(DriveJob job, double least) {
  constexpr double calm = -0.5;
  constexpr double loosest = 1e3;  // m/s: no feedback worth its name
  constexpr double step = 1.1;
  const SpinningWheel wheel = SpinningWheel::of(job.robot, job.period);
  double tolerance = least;
  for (; tolerance < loosest; tolerance *= step) {
    job.velocity_tolerance = tolerance;
    FLYBALL_TRY(const double gain, wheel_gain(job));
    if (wheel.pole(gain) >= calm) {
      break;
    }
  }
  // To a twentieth: the search's own steps are coarser.
  return tolerance == least ? least : std::ceil(20.0 * tolerance) / 20.0;
}

}  // namespace flyball::study
