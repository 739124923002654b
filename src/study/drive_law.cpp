#include <utility>

#include "core/try.hpp"
#include "study/drive_law.hpp"
#include "study/drive_pursuit.hpp"
#include "study/drive_wheel.hpp"
#include "study/holonomic_law.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

SpeedLimits limits_of(const DriveJob& job) {
  SpeedLimits limits;
  limits.wheel_velocity = job.robot.free_speed(job.max_voltage);
  limits.trackwidth = job.robot.trackwidth;
  return limits;
}

/// A follower of poses that gives the robot's speeds, and the tracker of the sides' velocities.
template <class Follower>
class ArcLaw final : public DriveLaw {
 public:
  ArcLaw(Follower follower, DriveVelocityTracker tracker, double trackwidth)
      : follower_(std::move(follower)), tracker_(std::move(tracker)), trackwidth_(trackwidth) {}

  DriveOrder step(const DriveReading& reading, const MotionSample& now,
                  const MotionSample& next) override {
    const TrackingPoint r = tracking_point(now);
    const FollowerCommand command = follower_.calculate(reading.pose, r);
    // What the reference gains until the next period, the command does, too.
    const Vector2d sides = side_velocities(command.speeds, trackwidth_);
    const Vector2d gain = side_velocities(tracking_point(next).speeds, trackwidth_) -
                          side_velocities(r.speeds, trackwidth_);
    const DriveCommand order = tracker_.calculate(reading.wheels, sides, sides + gain);
    return {.volts = order.voltage,
            .speeds = command.speeds,
            .saturated = command.status == FollowerStatus::saturated ||
                         order.status == FollowerStatus::saturated};
  }

 private:
  Follower follower_;
  DriveVelocityTracker tracker_;
  double trackwidth_;
};

/// Pure pursuit, and the same tracker.
class PursuitLaw final : public DriveLaw {
 public:
  PursuitLaw(Pursuit pursuit, DriveVelocityTracker tracker, double trackwidth)
      : pursuit_(std::move(pursuit)), tracker_(std::move(tracker)), trackwidth_(trackwidth) {}

  DriveOrder step(const DriveReading& reading, const MotionSample&, const MotionSample&) override {
    const Pursuit::Asked asked = pursuit_.step(reading.pose);
    const DriveCommand order =
        tracker_.calculate(reading.wheels, side_velocities(asked.now, trackwidth_),
                           side_velocities(asked.next, trackwidth_));
    return {.volts = order.voltage,
            .speeds = asked.now,
            .saturated = asked.saturated || order.status == FollowerStatus::saturated,
            .clock = asked.clock,
            .arrived = asked.arrived};
  }

 private:
  Pursuit pursuit_;
  DriveVelocityTracker tracker_;
  double trackwidth_;
};

class LtvDriveLaw final : public DriveLaw {
 public:
  explicit LtvDriveLaw(LtvDriveFollower follower) : follower_(std::move(follower)) {}

  DriveOrder step(const DriveReading& reading, const MotionSample& now,
                  const MotionSample& next) override {
    const double trackwidth = follower_.trackwidth();
    const TrackingPoint r = tracking_point(now);
    const DriveCommand order = follower_.calculate(
        {reading.pose, reading.wheels(0), reading.wheels(1)}, drive_state(r, trackwidth),
        drive_state(tracking_point(next), trackwidth));
    return {.volts = order.voltage,
            .speeds = r.speeds,
            .saturated = order.status == FollowerStatus::saturated};
  }

 private:
  LtvDriveFollower follower_;
};

using MadeLaw = Expected<std::unique_ptr<DriveLaw>>;

MadeLaw differential_law(const DriveJob& job) {
  FLYBALL_TRY(const auto model, differential_model(job.robot));
  if (job.follower == DriveFollower::ltv_drive) {
    FLYBALL_TRY(auto follower, LtvDriveFollower::create(model, Length(job.robot.trackwidth),
                                                        ltv_drive_settings(job)));
    return std::unique_ptr<DriveLaw>(std::make_unique<LtvDriveLaw>(std::move(follower)));
  }
  FLYBALL_TRY(auto tracker, DriveVelocityTracker::create(model, drive_tracker_settings(job)));
  if (job.follower == DriveFollower::pure_pursuit) {
    FLYBALL_TRY(auto pursuit, Pursuit::create(job));
    return std::unique_ptr<DriveLaw>(
        std::make_unique<PursuitLaw>(std::move(pursuit), std::move(tracker), job.robot.trackwidth));
  }
  if (job.follower == DriveFollower::ramsete) {
    FLYBALL_TRY(auto follower, RamseteFollower::create(ramsete_settings(job)));
    return std::unique_ptr<DriveLaw>(std::make_unique<ArcLaw<RamseteFollower>>(
        std::move(follower), std::move(tracker), job.robot.trackwidth));
  }
  FLYBALL_TRY(auto follower, LtvUnicycleFollower::create(ltv_unicycle_settings(job)));
  return std::unique_ptr<DriveLaw>(std::make_unique<ArcLaw<LtvUnicycleFollower>>(
      std::move(follower), std::move(tracker), job.robot.trackwidth));
}

}  // namespace

Expected<mechanisms::DifferentialDrive> differential_model(const DriveRobot& robot) {
  const double half = 0.5 * robot.trackwidth;
  const double wheels = robot.wheel_inertia / (robot.wheel_radius * robot.wheel_radius);
  FLYBALL_TRY(auto model, mechanisms::differential_drive(
                              {.motor = robot.motor,
                               .left_gearing = robot.gearing,
                               .right_gearing = robot.gearing,
                               .mass = Mass(rolling_mass(robot, 2)),
                               .wheel_radius = Length(robot.wheel_radius),
                               .trackwidth = Length(robot.trackwidth),
                               .moment_of_inertia = MomentOfInertia(robot.moment_of_inertia +
                                                                    2.0 * wheels * half * half)}));
  model.kS_left = friction_volts(robot.motor);
  model.kS_right = model.kS_left;
  return model;
}

RamseteSettings ramsete_settings(const DriveJob& job) {
  return {.b = job.b, .zeta = job.zeta, .limits = limits_of(job)};
}

LtvUnicycleSettings ltv_unicycle_settings(const DriveJob& job) {
  return {.x_tolerance = job.x_tolerance,
          .y_tolerance = job.y_tolerance,
          .heading_tolerance = job.heading_tolerance,
          .period = Time(job.period),
          .limits = limits_of(job)};
}

LtvDriveSettings ltv_drive_settings(const DriveJob& job) {
  return {.x_tolerance = job.x_tolerance,
          .y_tolerance = job.y_tolerance,
          .heading_tolerance = job.heading_tolerance,
          .velocity_tolerance = job.velocity_tolerance,
          .voltage_tolerance = usual_voltage,
          .voltage_limit = job.max_voltage,
          .period = Time(job.period)};
}

DriveTrackerSettings drive_tracker_settings(const DriveJob& job) {
  return {.velocity_tolerance = job.velocity_tolerance,
          .voltage_tolerance = usual_voltage,
          .voltage_limit = job.max_voltage,
          .period = Time(job.period)};
}

TrackingPoint tracking_point(const MotionSample& sample) noexcept {
  const Vector2d v = sample.pose.rotation().inverse() * sample.velocity;
  return {sample.pose, {v(0), v(1), sample.omega}};
}

Expected<std::unique_ptr<DriveLaw>> make_drive_law(const DriveJob& job) {
  return job.robot.kind == DriveKind::differential ? differential_law(job)
                                                   : make_holonomic_law(job);
}

}  // namespace flyball::study
