#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <flyball/control/followers/holonomic.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>
#include <flyball/mechanisms/swerve_drive.hpp>
#include <flyball/mechanisms/turret.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "study/drive_law.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;
using mechanisms::ChassisSpeeds;

constexpr double usual_voltage = 12.0;  ///< V, the largest acceptable one (Bryson's rule).

/// What the mass of the robot is to the wheels' shafts: the wheels turn, too.
double rolling_mass(const DriveRobot& robot, int shafts) {
  return robot.mass + shafts * robot.wheel_inertia / (robot.wheel_radius * robot.wheel_radius);
}

/// V against the motors' own friction.
double friction_volts(const mechanisms::DcMotor& motor) {
  return motor.free_current * motor.R;
}

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
    return {
        order.voltage, command.speeds,
        command.status == FollowerStatus::saturated || order.status == FollowerStatus::saturated};
  }

 private:
  Follower follower_;
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
    return {order.voltage, r.speeds, order.status == FollowerStatus::saturated};
  }

 private:
  LtvDriveFollower follower_;
};

/// The velocity of one wheel: LQR and plant inversion of dv/dt = (V - kV v)/kA.
struct WheelLaw {
  double A = 0.0, B = 1.0;  ///< v_{k+1} = A v_k + B V
  double K = 0.0;           ///< V/(m/s)
  double kS = 0.0;          ///< V
  double limit = 12.0;      ///< V

  static Expected<WheelLaw> create(const DriveJob& job) {
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
  double volts(double measured, double v, double next, bool& saturated) const {
    const double u = (next - A * v) / B +
                     kS * (next > 0.0   ? 1.0
                           : next < 0.0 ? -1.0
                                        : 0.0) +
                     K * (v - measured);
    saturated = saturated || std::abs(u) > limit;
    return std::clamp(u, -limit, limit);
  }
};

/// The speeds that the follower wants, and those a period later, as the reference gains.
struct Wanted {
  ChassisSpeeds now{}, next{};
  bool saturated = false;
};

Wanted wanted_by(HolonomicFollower& follower, const DriveReading& reading, const MotionSample& now,
                 const MotionSample& next) {
  const TrackingPoint r = tracking_point(now);
  const FollowerCommand command = follower.calculate(reading.pose, r);
  // The reference's gain in the field, as the robot sees it.
  const Vector2d gain = reading.pose.rotation().inverse() * Vector2d(next.velocity - now.velocity);
  return {command.speeds,
          {command.speeds.vx + gain(0), command.speeds.vy + gain(1),
           command.speeds.omega + next.omega - now.omega},
          command.status == FollowerStatus::saturated};
}

class MecanumLaw final : public DriveLaw {
 public:
  MecanumLaw(HolonomicFollower follower, mechanisms::MecanumKinematics kinematics, WheelLaw wheel)
      : follower_(std::move(follower)), kinematics_(std::move(kinematics)), wheel_(wheel) {}

  DriveOrder step(const DriveReading& reading, const MotionSample& now,
                  const MotionSample& next) override {
    const Wanted wanted = wanted_by(follower_, reading, now, next);
    const Eigen::Vector4d v = kinematics_.wheels(wanted.now);
    const Eigen::Vector4d later = kinematics_.wheels(wanted.next);
    DriveOrder order{VectorXd(4), wanted.now, wanted.saturated};
    for (Index i = 0; i < 4; ++i) {
      order.volts(i) = wheel_.volts(reading.wheels(i), v(i), later(i), order.saturated);
    }
    return order;
  }

 private:
  HolonomicFollower follower_;
  mechanisms::MecanumKinematics kinematics_;
  WheelLaw wheel_;
};

class SwerveLaw final : public DriveLaw {
 public:
  SwerveLaw(HolonomicFollower follower, mechanisms::SwerveKinematics<4> kinematics, WheelLaw wheel,
            const Eigen::RowVector2d& steer, double fastest)
      : follower_(std::move(follower)),
        kinematics_(std::move(kinematics)),
        wheel_(wheel),
        steer_(steer),
        fastest_(fastest) {}

  DriveOrder step(const DriveReading& reading, const MotionSample& now,
                  const MotionSample& next) override {
    Wanted wanted = wanted_by(follower_, reading, now, next);
    std::array<mechanisms::SwerveModule, 4> held;
    for (std::size_t i = 0; i < 4; ++i) {
      held[i].angle = Rotation2d(reading.module_angles(static_cast<Index>(i)));
    }
    auto modules = kinematics_.modules(wanted.now, held);
    auto later = kinematics_.modules(wanted.next, held);
    double most = 0.0;
    for (const auto& module : modules) {
      most = std::max(most, module.speed);
    }
    // One factor for all keeps the direction of the motion.
    const double scale = most > fastest_ ? fastest_ / most : 1.0;
    DriveOrder order{VectorXd(8), wanted.now, wanted.saturated || scale < 1.0};
    for (std::size_t k = 0; k < 4; ++k) {
      const auto i = static_cast<Index>(k);
      const double angle = reading.module_angles(i);
      // What hardly moves has no direction worth turning to: it stays as it is.
      constexpr double creep = 0.02;  // m/s
      const bool rests = modules[k].speed < creep && later[k].speed < creep;
      const double to = rests                       ? angle
                        : modules[k].speed >= creep ? modules[k].angle.angle()
                                                    : later[k].angle.angle();
      double turn = std::remainder(to - angle, 2.0 * std::numbers::pi);
      double sign = 1.0;
      if (std::abs(turn) > 0.5 * std::numbers::pi) {  // the other way round is nearer
        turn = std::remainder(turn + std::numbers::pi, 2.0 * std::numbers::pi);
        sign = -1.0;
      }
      const double ahead = sign * scale * std::max(0.0, std::cos(turn));
      order.volts(i) = wheel_.volts(reading.wheels(i), ahead * modules[k].speed,
                                    ahead * later[k].speed, order.saturated);
      const double u = steer_(0) * turn - steer_(1) * reading.module_rates(i);
      order.volts(4 + i) = std::clamp(u, -wheel_.limit, wheel_.limit);
    }
    return order;
  }

 private:
  HolonomicFollower follower_;
  mechanisms::SwerveKinematics<4> kinematics_;
  WheelLaw wheel_;
  Eigen::RowVector2d steer_;
  double fastest_;
};

using Made = Expected<std::unique_ptr<DriveLaw>>;

Made differential_law(const DriveJob& job) {
  FLYBALL_TRY(const auto model, differential_model(job.robot));
  if (job.follower == DriveFollower::ltv_drive) {
    FLYBALL_TRY(auto follower, LtvDriveFollower::create(model, Length(job.robot.trackwidth),
                                                        ltv_drive_settings(job)));
    return std::unique_ptr<DriveLaw>(std::make_unique<LtvDriveLaw>(std::move(follower)));
  }
  FLYBALL_TRY(auto tracker, DriveVelocityTracker::create(model, drive_tracker_settings(job)));
  if (job.follower == DriveFollower::ramsete) {
    FLYBALL_TRY(auto follower, RamseteFollower::create(ramsete_settings(job)));
    return std::unique_ptr<DriveLaw>(std::make_unique<ArcLaw<RamseteFollower>>(
        std::move(follower), std::move(tracker), job.robot.trackwidth));
  }
  FLYBALL_TRY(auto follower, LtvUnicycleFollower::create(ltv_unicycle_settings(job)));
  return std::unique_ptr<DriveLaw>(std::make_unique<ArcLaw<LtvUnicycleFollower>>(
      std::move(follower), std::move(tracker), job.robot.trackwidth));
}

Expected<HolonomicFollower> holonomic(const DriveJob& job) {
  HolonomicSettings settings{.x_tolerance = job.x_tolerance,
                             .y_tolerance = job.y_tolerance,
                             .heading_tolerance = job.heading_tolerance,
                             .period = Time(job.period)};
  settings.limits.velocity = job.robot.free_speed(job.max_voltage);
  return HolonomicFollower::create(settings);
}

Made swerve_law(const DriveJob& job) {
  FLYBALL_TRY(auto follower, holonomic(job));
  FLYBALL_TRY(const WheelLaw wheel, WheelLaw::create(job));
  FLYBALL_TRY(const auto kinematics, mechanisms::swerve_kinematics(job.robot.modules));
  FLYBALL_TRY(const auto steer,
              mechanisms::swerve_steer(mechanisms::TurretParameters{
                  .motor = job.robot.steer_motor,
                  .gearing = job.robot.steer_gearing,
                  .moment_of_inertia = MomentOfInertia(job.robot.steer_inertia)}));
  FLYBALL_TRY(const auto plant,
              discretize(static_cast<const ContinuousSystem<2, 1, 1>&>(steer), Time(job.period)));
  constexpr double angle = 0.05;  // rad
  constexpr double rate = 8.0;    // rad/s
  FLYBALL_TRY(const auto design, lqr(plant, bryson({angle, rate}), bryson({usual_voltage})));
  return std::unique_ptr<DriveLaw>(std::make_unique<SwerveLaw>(
      std::move(follower), kinematics, wheel, Eigen::RowVector2d(design.K),
      job.robot.free_speed(job.max_voltage)));
}

Made mecanum_law(const DriveJob& job) {
  FLYBALL_TRY(auto follower, holonomic(job));
  FLYBALL_TRY(const WheelLaw wheel, WheelLaw::create(job));
  FLYBALL_TRY(auto kinematics, mechanisms::mecanum_kinematics(job.robot.modules));
  return std::unique_ptr<DriveLaw>(
      std::make_unique<MecanumLaw>(std::move(follower), std::move(kinematics), wheel));
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
  switch (job.robot.kind) {
    case DriveKind::swerve:
      return swerve_law(job);
    case DriveKind::mecanum:
      return mecanum_law(job);
    case DriveKind::differential:
      break;
  }
  return differential_law(job);
}

}  // namespace flyball::study
