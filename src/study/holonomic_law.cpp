#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <variant>

#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/turret.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "study/drive_pursuit.hpp"
#include "study/holonomic_law.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;
using mechanisms::ChassisSpeeds;

/// The speeds that the follower wants, and those a period later.
using Wanted = Pursuit::Asked;

/// By the trajectory's times: what the reference gains until the next period, the command does,
/// too.
Wanted wanted_by(HolonomicFollower& follower, const DriveReading& reading, const MotionSample& now,
                 const MotionSample& next) {
  const TrackingPoint r = tracking_point(now);
  const FollowerCommand command = follower.calculate(reading.pose, r);
  // The reference's gain in the field, as the robot sees it.
  const Vector2d gain = reading.pose.rotation().inverse() * Vector2d(next.velocity - now.velocity);
  return {.now = command.speeds,
          .next = {command.speeds.vx + gain(0), command.speeds.vy + gain(1),
                   command.speeds.omega + next.omega - now.omega},
          .saturated = command.status == FollowerStatus::saturated};
}

/// Either follower.
class Leader {
 public:
  explicit Leader(HolonomicFollower follower) : of_(std::move(follower)) {}
  explicit Leader(Pursuit pursuit) : of_(std::move(pursuit)) {}

  Wanted step(const DriveReading& reading, const MotionSample& now, const MotionSample& next) {
    if (auto* pursuit = std::get_if<Pursuit>(&of_)) {
      return pursuit->step(reading.pose);
    }
    return wanted_by(std::get<HolonomicFollower>(of_), reading, now, next);
  }
  /// An order of so many motors.
  DriveOrder order(const Wanted& wanted, Index motors) const {
    DriveOrder order{VectorXd(motors), wanted.now, wanted.saturated};
    if (std::holds_alternative<Pursuit>(of_)) {
      order.clock = wanted.clock;
      order.arrived = wanted.arrived;
    }
    return order;
  }

 private:
  std::variant<HolonomicFollower, Pursuit> of_;
};

class MecanumLaw final : public DriveLaw {
 public:
  MecanumLaw(Leader leader, const HolonomicParts& parts)
      : leader_(std::move(leader)), parts_(parts) {}

  DriveOrder step(const DriveReading& reading, const MotionSample& now,
                  const MotionSample& next) override {
    const Wanted wanted = leader_.step(reading, now, next);
    const Eigen::Vector4d v = parts_.M * wanted.now.vector();
    const Eigen::Vector4d later = parts_.M * wanted.next.vector();
    DriveOrder order = leader_.order(wanted, 4);
    for (Index i = 0; i < 4; ++i) {
      order.volts(i) = parts_.wheel.volts(reading.wheels(i), v(i), later(i), order.saturated);
    }
    return order;
  }

 private:
  Leader leader_;
  HolonomicParts parts_;
};

class SwerveLaw final : public DriveLaw {
 public:
  SwerveLaw(Leader leader, const HolonomicParts& parts, mechanisms::SwerveKinematics<4> kinematics)
      : leader_(std::move(leader)), parts_(parts), kinematics_(std::move(kinematics)) {}

  DriveOrder step(const DriveReading& reading, const MotionSample& now,
                  const MotionSample& next) override {
    const Wanted wanted = leader_.step(reading, now, next);
    std::array<mechanisms::SwerveModule, 4> held;
    for (std::size_t i = 0; i < 4; ++i) {
      held[i].angle = Rotation2d(reading.module_angles(static_cast<Index>(i)));
    }
    const auto modules = kinematics_.modules(wanted.now, held);
    const auto later = kinematics_.modules(wanted.next, held);
    double most = 0.0;
    for (const auto& module : modules) {
      most = std::max(most, module.speed);
    }
    // One factor for all keeps the direction of the motion.
    const double scale = most > parts_.fastest ? parts_.fastest / most : 1.0;
    DriveOrder order = leader_.order(wanted, 8);
    order.saturated = order.saturated || scale < 1.0;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto i = static_cast<Index>(k);
      const double angle = reading.module_angles(i);
      // What hardly moves has no direction worth turning to: it stays as it is.
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
      order.volts(i) = parts_.wheel.volts(reading.wheels(i), ahead * modules[k].speed,
                                          ahead * later[k].speed, order.saturated);
      const double u = parts_.steer(0) * turn - parts_.steer(1) * reading.module_rates(i);
      order.volts(4 + i) = std::clamp(u, -parts_.wheel.limit, parts_.wheel.limit);
    }
    return order;
  }

 private:
  Leader leader_;
  HolonomicParts parts_;
  mechanisms::SwerveKinematics<4> kinematics_;
};

Expected<HolonomicFollower> follower_of(const DriveJob& job) {
  HolonomicSettings settings{.x_tolerance = job.x_tolerance,
                             .y_tolerance = job.y_tolerance,
                             .heading_tolerance = job.heading_tolerance,
                             .period = Time(job.period)};
  settings.limits.velocity = job.robot.free_speed(job.max_voltage);
  return HolonomicFollower::create(settings);
}

Expected<void> add_steering(const DriveJob& job, HolonomicParts& parts) {
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
  parts.steer = design.K;
  parts.steer_A = plant.A;
  parts.steer_B = plant.B;
  return {};
}

Expected<Leader> leader_of(const DriveJob& job, const HolonomicParts& parts) {
  if (job.follower != DriveFollower::pure_pursuit) {
    return Leader(parts.follower);
  }
  return Pursuit::create(job).map([](Pursuit pursuit) { return Leader(std::move(pursuit)); });
}

}  // namespace

Expected<HolonomicParts> holonomic_parts(const DriveJob& job) {
  FLYBALL_TRY(auto follower, follower_of(job));
  HolonomicParts parts{.follower = std::move(follower)};
  FLYBALL_TRY(parts.wheel, WheelLaw::create(job));
  parts.fastest = job.robot.free_speed(job.max_voltage);
  if (job.robot.kind == DriveKind::swerve) {
    FLYBALL_CHECK(mechanisms::swerve_kinematics(job.robot.modules).map([](const auto&) {}));
    FLYBALL_CHECK(add_steering(job, parts));
    return parts;
  }
  FLYBALL_TRY(const auto kinematics, mechanisms::mecanum_kinematics(job.robot.modules));
  parts.M.col(0) = kinematics.wheels({1.0, 0.0, 0.0});
  parts.M.col(1) = kinematics.wheels({0.0, 1.0, 0.0});
  parts.M.col(2) = kinematics.wheels({0.0, 0.0, 1.0});
  return parts;
}

Expected<std::unique_ptr<DriveLaw>> make_holonomic_law(const DriveJob& job) {
  FLYBALL_TRY(const auto parts, holonomic_parts(job));
  FLYBALL_TRY(auto leader, leader_of(job, parts));
  if (job.robot.kind == DriveKind::mecanum) {
    return std::unique_ptr<DriveLaw>(std::make_unique<MecanumLaw>(std::move(leader), parts));
  }
  FLYBALL_TRY(const auto kinematics, mechanisms::swerve_kinematics(job.robot.modules));
  return std::unique_ptr<DriveLaw>(
      std::make_unique<SwerveLaw>(std::move(leader), parts, kinematics));
}

}  // namespace flyball::study
