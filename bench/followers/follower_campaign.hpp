#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include <flyball/control/followers/holonomic.hpp>
#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/control/followers/ltv_unicycle.hpp>
#include <flyball/control/followers/pure_pursuit.hpp>
#include <flyball/control/followers/ramsete.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/integration/fixed_step.hpp>
#include <flyball/mechanisms/drivetrain/wheeled_drive.hpp>
#include <flyball/planning/splines/spline.hpp>

/// Random starts of every follower on a robot that is not the one it was designed for: mass,
/// inertia, motors and trackwidth off by up to 20 %, wheels that slip on tires, poses and speeds
/// seen 40 ms late, 12 V.
namespace flyball::follower_campaign {

enum class Kind { ramsete, unicycle, drive, scheduled_drive, holonomic, pure_pursuit };
inline constexpr std::array kinds{Kind::ramsete,         Kind::unicycle,  Kind::drive,
                                  Kind::scheduled_drive, Kind::holonomic, Kind::pure_pursuit};
inline const char* name_of(Kind kind) {
  constexpr std::array names{"Ramsete",   "LTV unicycle", "LTV drive", "LTV drive, scheduled",
                             "holonomic", "pure pursuit"};
  return names[static_cast<std::size_t>(kind)];
}

/// The region of the starts, and what is wrong with the robot.
struct Conditions {
  double distance = 1.0;      ///< m, of the start from the path's, uniform in the disc.
  double heading = 1.5;       ///< rad, ± of it.
  double velocity = 1.0;      ///< m/s, ± of each side's.
  double parameters = 0.2;    ///< Share, ± of each parameter.
  double latency = 0.04;      ///< s, between what is measured and the voltage.
  bool predicts = true;       ///< The pose by its speeds to where it will be (`pose_after`).
  double least_grip = 0.6;    ///< Friction of the tires, from
  double largest_grip = 1.2;  ///< to.
};

/// How a run ended, by its last half second.
enum class Ending {
  converged,   ///< Within 0.15 m and 0.15 rad (pure pursuit: of the path), where a wrong trackwidth
               ///< alone holds some 0.1 m off in a curve.
  saturated,   ///< Not, and the follower was at its limits in that time.
  lost,        ///< Not, and the monitor said so: beyond 0.3 m or 0.3 rad.
  near,        ///< Not, but within that.
  not_finite,  ///< A command that is no number or above its limit.
};
inline constexpr int endings = 5;

/// The robot that the followers are designed for is 52 kg with two NEOs a side; the real one's
/// parameters are its times these.
struct Factors {
  double mass = 1.0, inertia = 1.0, resistance = 1.0, trackwidth = 1.0, grip = 1.0;
};

/// Where a run starts, in the frame of the path's start.
struct Start {
  Pose2d pose{};
  double left = 0.0;   ///< m/s
  double right = 0.0;  ///< m/s
};

struct Outcome {
  Factors factors{};
  Start start{};
  Ending ending = Ending::converged;
  double error = 0.0;    ///< m, largest of the last half second.
  double heading = 0.0;  ///< rad, likewise.
  double largest = 0.0;  ///< m, of the whole run.
};

inline constexpr double period = 0.02;
inline constexpr double radius = 0.0508;
inline constexpr double wheels_apart = 0.56;  ///< m, the sides.

inline mechanisms::DifferentialDrive nominal_drive(double trackwidth) {
  return mechanisms::differential_drive({.motor = mechanisms::neo(2),
                                         .left_gearing = 8.0,
                                         .right_gearing = 8.0,
                                         .mass = Mass(52.0),
                                         .wheel_radius = Length(radius),
                                         .trackwidth = Length(trackwidth),
                                         .moment_of_inertia = MomentOfInertia(5.0)})
      .value();
}

inline mechanisms::DriveShaft shaft(int motors, double resistance) {
  auto motor = mechanisms::neo(motors);
  motor.R *= resistance;
  return {.motor = motor,
          .gearing = 8.0,
          .moment_of_inertia = MomentOfInertia(0.02 * motors / 2.0),
          .friction = 0.4,
          .damping = 0.01};
}

inline mechanisms::RobotBody body(const Factors& f) {
  return {.mass = Mass(52.0 * f.mass), .moment_of_inertia = MomentOfInertia(5.0 * f.inertia)};
}
inline mechanisms::Tire tire(const Factors& f) {
  // A larger rest speed than a rubber tread's lets the integration take 1 ms.
  return {.friction = f.grip, .stiffness = 15.0, .rest_speed = 0.2};
}

inline auto slipping_drive(const Factors& f) {
  return mechanisms::slipping_differential_drive<4>(
             {.body = body(f),
              .side = shaft(2, f.resistance),
              .wheel_radius = Length(radius),
              .trackwidth = Length(wheels_apart * f.trackwidth),
              .wheelbase = Length(0.3),
              .tire = tire(f)})
      .value();
}

inline std::array<Eigen::Vector2d, 4> corners(double width) {
  return {Eigen::Vector2d{0.25, width / 2}, Eigen::Vector2d{0.25, -width / 2},
          Eigen::Vector2d{-0.25, width / 2}, Eigen::Vector2d{-0.25, -width / 2}};
}
inline auto slipping_mecanum(const Factors& f) {
  return mechanisms::slipping_mecanum_drive({.body = body(f),
                                             .wheel = shaft(1, f.resistance),
                                             .wheel_radius = Length(radius),
                                             .positions = corners(wheels_apart * f.trackwidth),
                                             .tire = tire(f)})
      .value();
}

/// The trackwidth that a drive seems to have: its wheels scrub across when it turns, so that it
/// turns less than they tell. What an identification finds: (vr - vl)/ω of the nominal robot in a
/// curve of 2 m at 1.5 m/s or so.
inline double identified_trackwidth() {
  const auto plant = slipping_drive({.grip = 0.9});
  using State = Eigen::Vector<double, 8>;
  State x = State::Zero();
  const Eigen::Vector2d u(4.2, 6.8);
  for (int k = 0; k < 3000; ++k) {
    x = rk4([&](const State& at) { return State(plant.derivative(at, u)); }, x, 1e-3);
  }
  return radius * (x(7) - x(6)) / x(5);
}

/// A path from the origin along x to somewhere ahead, at most 2 m/s, 1.5 m/s² and 2 m/s² across,
/// and 1 m/s at its end.
inline std::vector<PathPoint> random_path(Random& random) {
  const double side = random.uniform(-2.0, 2.0);
  const std::vector<Pose2d> waypoints{
      {0.0, 0.0, 0.0},
      {random.uniform(5.0, 7.0), side, std::clamp(side, -1.0, 1.0) * random.uniform(0.0, 1.2)}};
  return sample_path(quintic_spline(waypoints).value()).value();
}

/// One run against a plant. `Follow` answers voltages (and its status) of a measured state.
template <class Plant, class Follow, class Error>
Outcome run(const Plant& plant, Eigen::Vector<double, Plant::states()> x, double total,
            double latency, Follow follow, Error error_at) {
  using State = Eigen::Vector<double, Plant::states()>;
  constexpr int substeps = 20;
  const auto late = static_cast<std::size_t>(std::lround(latency / period));
  std::vector<State> seen(late + 1, x);
  auto monitor = TrackingMonitor::create({.distance = 0.3, .heading = 0.3}).value();
  Outcome outcome;
  bool saturated = false;
  const int steps = static_cast<int>(total / period);
  Eigen::Vector<double, Plant::inputs()> u = decltype(u)::Zero();
  for (int k = 0; k < steps; ++k) {
    std::rotate(seen.begin(), seen.end() - 1, seen.end());
    seen.front() = x;
    FollowerStatus status = FollowerStatus::tracking;
    u = follow(k * period, seen.back(), status);
    if (!u.allFinite() || !(u.cwiseAbs().maxCoeff() <= 12.0)) {
      outcome.ending = Ending::not_finite;
      return outcome;
    }
    const Eigen::Vector3d error = error_at(k * period, Pose2d(x(0), x(1), x(2)));
    const double distance = std::hypot(error(0), error(1));
    outcome.largest = std::max(outcome.largest, distance);
    monitor.update(error, period);
    if (k >= steps - 25) {
      outcome.error = std::max(outcome.error, distance);
      outcome.heading = std::max(outcome.heading, std::abs(error(2)));
      saturated = saturated || status != FollowerStatus::tracking;
    }
    for (int i = 0; i < substeps; ++i) {
      x = rk4([&](const State& at) { return State(plant.derivative(at, u)); }, x,
              period / substeps);
    }
    if (!x.allFinite()) {
      outcome.ending = Ending::not_finite;
      return outcome;
    }
  }
  outcome.ending = outcome.error <= 0.15 && outcome.heading <= 0.15  ? Ending::converged
                   : saturated                                       ? Ending::saturated
                   : monitor.state() == TrackingMonitor::State::lost ? Ending::lost
                                                                     : Ending::near;
  return outcome;
}

/// The followers as they are designed once, for the robot of the data sheet. The tolerances are
/// those that leave 40 ms of latency a margin.
struct Followers {
  double trackwidth = identified_trackwidth();
  SpeedLimits limits{
      .velocity = 3.0, .angular_velocity = 8.0, .wheel_velocity = 3.2, .trackwidth = trackwidth};
  RamseteFollower ramsete =
      RamseteFollower::create({.b = 6.0, .zeta = 0.8, .limits = limits}).value();
  LtvUnicycleFollower unicycle = LtvUnicycleFollower::create({.x_tolerance = 0.2,
                                                              .y_tolerance = 0.25,
                                                              .heading_tolerance = 1.0,
                                                              .velocity_tolerance = 1.0,
                                                              .angular_velocity_tolerance = 2.0,
                                                              .limits = limits})
                                     .value();
  LtvDriveFollower drive = drive_of(GainSource::each_period);
  LtvDriveFollower scheduled = drive_of(GainSource::schedule);
  DriveVelocityTracker tracker =
      DriveVelocityTracker::create(nominal_drive(trackwidth), {.velocity_tolerance = 1.2}).value();
  HolonomicFollower holonomic =
      HolonomicFollower::create({.x_tolerance = 0.2,
                                 .y_tolerance = 0.2,
                                 .heading_tolerance = 0.4,
                                 .limits = {.velocity = 3.0, .angular_velocity = 6.0}})
          .value();
  mechanisms::MecanumKinematics mecanum =
      mechanisms::mecanum_kinematics(corners(wheels_apart)).value();

  [[nodiscard]] LtvDriveFollower drive_of(GainSource source) const {
    LtvDriveSettings settings{.x_tolerance = 0.2,
                              .y_tolerance = 0.25,
                              .heading_tolerance = 1.0,
                              .velocity_tolerance = 2.0};
    settings.source = source;
    return LtvDriveFollower::create(nominal_drive(trackwidth), Length(trackwidth), settings)
        .value();
  }
};

inline Outcome run_from(const Followers& designed, Kind kind, Random& random, const Factors& f,
                        const Start& from, const Conditions& conditions) {
  const double trackwidth = designed.trackwidth;
  const auto path = random_path(random);
  const Trajectory trajectory =
      time_path(path,
                {.velocity = 2.0, .acceleration = 1.5, .centripetal = 2.0, .end_velocity = 1.0})
          .value();
  const auto& [start, left, right] = from;
  const auto r_at = [&](double t) { return tracking_point(trajectory.sample(t)); };
  const auto error_at = [&](double t, const Pose2d& pose) {
    return tracking_error(pose, r_at(t).pose);
  };
  // What was measured `latency` ago, as the followers see it.
  const auto seen_pose = [&](const Pose2d& pose, const mechanisms::ChassisSpeeds& speeds) {
    return conditions.predicts ? pose_after(pose, speeds, conditions.latency) : pose;
  };

  if (kind == Kind::holonomic) {
    const auto plant = slipping_mecanum(f);
    HolonomicFollower follower = designed.holonomic;
    const auto motor = mechanisms::neo(1);
    Eigen::Vector<double, 10> x = Eigen::Vector<double, 10>::Zero();
    x.head<3>() << start.x(), start.y(), start.angle();
    return run(
        plant, x, trajectory.total_time(), conditions.latency,
        [&](double t, const Eigen::Vector<double, 10>& y, FollowerStatus& status) {
          const Eigen::Vector4d wheels = radius * y.tail<4>();
          const auto command = follower.calculate(
              seen_pose({y(0), y(1), y(2)}, designed.mecanum.chassis(wheels)), r_at(t));
          status = command.status;
          const Eigen::Vector4d wanted = designed.mecanum.wheels(command.speeds);
          // Each wheel by its motor's speed and a proportional part.
          Eigen::Vector4d u = wanted * (8.0 / (motor.Kv * radius)) + 2.0 * (wanted - wheels);
          const double most = u.cwiseAbs().maxCoeff();
          if (most > 12.0) {
            u *= 12.0 / most;
            status = FollowerStatus::saturated;
          }
          return Eigen::Vector4d(u.cwiseMax(-12.0).cwiseMin(12.0));
        },
        error_at);
  }

  const auto plant = slipping_drive(f);
  Eigen::Vector<double, 8> x = Eigen::Vector<double, 8>::Zero();
  x << start.x(), start.y(), start.angle(), 0.5 * (left + right), 0.0,
      (right - left) / (wheels_apart * f.trackwidth), left / radius, right / radius;
  std::optional<PurePursuitFollower> pursuit;
  if (kind == Kind::pure_pursuit) {
    pursuit = PurePursuitFollower::create(path, {.velocity = 2.0,
                                                 .acceleration = 1.5,
                                                 .centripetal = 2.0,
                                                 .least_lookahead = 0.4,
                                                 .lookahead_time = 0.3,
                                                 .limits = designed.limits})
                  .value();
  }
  const auto follow = [&](double t, const Eigen::Vector<double, 8>& y, FollowerStatus& status) {
    const Eigen::Vector2d sides(radius * y(6), radius * y(7));
    const Pose2d pose = seen_pose(
        {y(0), y(1), y(2)}, {0.5 * (sides(0) + sides(1)), 0.0, (sides(1) - sides(0)) / trackwidth});
    const TrackingPoint r = r_at(t);
    if (kind == Kind::drive || kind == Kind::scheduled_drive) {
      const LtvDriveFollower& follower = kind == Kind::drive ? designed.drive : designed.scheduled;
      const auto command =
          follower.calculate({pose, sides(0), sides(1)}, drive_state(r, trackwidth),
                             drive_state(r_at(t + period), trackwidth));
      status = command.status;
      return command.voltage;
    }
    const FollowerCommand command = kind == Kind::ramsete    ? designed.ramsete.calculate(pose, r)
                                    : kind == Kind::unicycle ? designed.unicycle.calculate(pose, r)
                                                             : pursuit->calculate(pose);
    const Eigen::Vector2d wanted = side_velocities(command.speeds, trackwidth);
    // What is wanted a period later: as the reference changes.
    const Eigen::Vector2d change = side_velocities(r_at(t + period).speeds, trackwidth) -
                                   side_velocities(r.speeds, trackwidth);
    const auto voltage = designed.tracker.calculate(
        sides, wanted, kind == Kind::pure_pursuit ? wanted : Eigen::Vector2d(wanted + change));
    status = std::min(command.status, voltage.status);
    return voltage.voltage;
  };
  if (kind != Kind::pure_pursuit) {
    return run(plant, x, trajectory.total_time(), conditions.latency, follow, error_at);
  }
  // Of the path, whenever: across it and in heading at its nearest point, with time to arrive.
  return run(plant, x, trajectory.total_time() + 3.0, conditions.latency, follow,
             [&](double, const Pose2d& pose) -> Eigen::Vector3d {
               const auto nearest = std::ranges::min_element(path, {}, [&](const PathPoint& point) {
                 return (point.pose.translation() - pose.translation()).squaredNorm();
               });
               Eigen::Vector3d error = tracking_error(pose, nearest->pose);
               error(0) = 0.0;
               return error;
             });
}

inline Outcome run(const Followers& designed, Kind kind, std::uint64_t seed,
                   const Conditions& conditions) {
  Random random(seed);
  const auto factor = [&] {
    return 1.0 + random.uniform(-conditions.parameters, conditions.parameters);
  };
  const Factors f{factor(), factor(), factor(), factor(),
                  random.uniform(conditions.least_grip, conditions.largest_grip)};
  const double away = conditions.distance * std::sqrt(random.uniform());
  const double direction = random.uniform(-std::numbers::pi, std::numbers::pi);
  const auto any = [&](double size) { return random.uniform(-size, size); };
  const Start start{
      {away * std::cos(direction), away * std::sin(direction), any(conditions.heading)},
      any(conditions.velocity),
      any(conditions.velocity)};
  Outcome outcome = run_from(designed, kind, random, f, start, conditions);
  outcome.factors = f;
  outcome.start = start;
  return outcome;
}

}  // namespace flyball::follower_campaign
