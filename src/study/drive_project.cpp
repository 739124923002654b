// What a project file says of a drivetrain that follows a trajectory.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>
#include <flyball/planning/splines/spline.hpp>
#include <flyball/planning/trajectory/trajectory.hpp>
#include <flyball/study/drive.hpp>
#include <flyball/study/project.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/drive_fields.hpp"
#include "study/drive_wheel.hpp"
#include "study/field.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

std::string beside(const std::string& project, const std::string& file) {
  const std::size_t slash = project.find_last_of('/');
  return file.starts_with('/') || slash == std::string::npos ? file
                                                             : project.substr(0, slash + 1) + file;
}

Error wrong(const Project& project, std::string_view key, std::string got) {
  return Error(ProjectError::wrong_value)
      .in(project.path)
      .about(fmt::format("drive.{}", key))
      .got(std::move(got));
}

Expected<DriveKind> kind_of(const Project& project, const PathPlannerSettings& settings) {
  const std::string& type = project.drive.type;
  const DriveKind kind = type == "swerve"    ? DriveKind::swerve
                         : type == "mecanum" ? DriveKind::mecanum
                                             : DriveKind::differential;
  if (settings.holonomic && *settings.holonomic != (kind != DriveKind::differential)) {
    return tl::unexpected(wrong(project, "type", fmt::format("\"{}\"", type))
                              .expected(*settings.holonomic
                                            ? "\"swerve\" or \"mecanum\", as the settings are of a "
                                              "holonomic drive"
                                            : "\"differential\", as the settings are not of a "
                                              "holonomic drive"));
  }
  return kind;
}

/// Everything that is missing at once.
class Parts {
 public:
  /// @param settings  Path of PathPlanner's, or empty.
  Parts(const Project& project, std::string_view settings)
      : project_(project), settings_path_(settings) {}

  template <class Said>
  double number(std::string_view key, const std::optional<Said>& said,
                const std::optional<double>& by_settings, std::string_view example) {
    if (said) {
      if constexpr (requires { said->si(); }) {
        return said->si();
      } else {
        return *said;
      }
    }
    if (!by_settings) {
      miss(key, example);
    } else if (auto fits = check_drive_size(key, *by_settings); !fits) {
      missing_.push_back({std::move(fits).error().in(settings_path_), {}, {}});
    }
    return by_settings.value_or(1.0);
  }
  void miss(std::string_view key, std::string_view example) {
    missing_.push_back(
        {Error(ProjectError::missing_key)
             .in(project_.path)
             .about(fmt::format("drive.{}", key))
             .got("missing")
             .hint(fmt::format("a drivetrain needs it, for example {} = {}{}", key, example,
                               settings_path_.empty() ? "; PathPlanner's settings.json may say it: "
                                                        "settings = \"settings.json\""
                                                      : "; the settings do not say it")),
         {},
         {}});
  }
  [[nodiscard]] ExpectedAll<void> all() const {
    return missing_.empty() ? ExpectedAll<void>() : tl::unexpected(Errors(missing_));
  }

 private:
  const Project& project_;
  std::string settings_path_;
  std::vector<QuotedError> missing_;
};

Expected<void> take_modules(const Project& project, const PathPlannerSettings& settings,
                            DriveRobot& robot, bool is_track_known) {
  const DriveSection& said = project.drive;
  if (!said.modules.empty()) {
    if (said.modules.size() != 4) {
      return tl::unexpected(wrong(project, "modules", fmt::format("{} places", said.modules.size()))
                                .expected("four: front left, front right, back left, back right"));
    }
    for (std::size_t i = 0; i < 4; ++i) {
      auto place = quantities_of(said.modules[i], {Dimension::length, Dimension::length}, 2,
                                 fmt::format("drive.modules[{}]", i));
      if (!place) {
        return tl::unexpected(std::move(place).error().in(project.path));
      }
      robot.modules[i] = {(*place)[0], (*place)[1]};
    }
    return {};
  }
  const bool from_settings = !said.trackwidth && !said.wheelbase &&
                             std::all_of(settings.modules.begin(), settings.modules.end(),
                                         [](const auto& place) { return place.has_value(); });
  if (from_settings) {
    for (std::size_t i = 0; i < 4; ++i) {
      robot.modules[i] = *settings.modules[i];
    }
  } else if (is_track_known) {
    const double y = 0.5 * robot.trackwidth;
    const double x = 0.5 * said.wheelbase.value_or(Length(robot.trackwidth)).si();
    robot.modules = {Vector2d(x, y), Vector2d(x, -y), Vector2d(-x, y), Vector2d(-x, -y)};
  }
  return {};
}

ExpectedAll<DriveRobot> robot_of(const Project& project, const PathPlannerSettings& settings,
                                 const std::string& settings_path) {
  const DriveSection& said = project.drive;
  DriveRobot robot;
  FLYBALL_TRY(robot.kind, kind_of(project, settings));
  const bool sides = robot.kind == DriveKind::differential;
  Parts parts(project, settings_path);
  robot.mass = parts.number("mass", said.mass, settings.mass, "\"54 kg\"");
  robot.moment_of_inertia = parts.number("moment_of_inertia", said.moment_of_inertia,
                                         settings.moment_of_inertia, "\"6 kg m^2\"");
  robot.gearing = parts.number("gearing", said.gearing, settings.gearing, "8.45");
  robot.wheel_radius =
      parts.number("wheel_radius", said.wheel_radius, settings.wheel_radius, "\"3 in\"");
  const bool has_modules = !said.modules.empty() || (settings.modules[0] && settings.modules[1] &&
                                                     settings.modules[2] && settings.modules[3]);
  const bool is_track_known = said.trackwidth || settings.trackwidth;
  if (sides || !has_modules || said.trackwidth || said.wheelbase) {
    robot.trackwidth =
        parts.number("trackwidth", said.trackwidth, settings.trackwidth, "\"0.6 m\"");
  }
  const std::string name = !said.motor.empty() ? said.motor : settings.motor;
  if (name.empty()) {
    parts.miss("motor", "\"NEO\"");
  }
  FLYBALL_CHECK(parts.all());
  const int count = said.motor_count.value_or(sides ? 2 : 1);
  const auto motor_of = [&](const std::string& called, int n,
                            std::string_view key) -> Expected<mechanisms::DcMotor> {
    auto motor = mechanisms::motor(called, n);
    if (!motor) {
      return tl::unexpected(
          std::move(motor).error().in(fmt::format("{}: drive.{}", project.path, key)));
    }
    return motor;
  };
  FLYBALL_TRY(robot.motor, motor_of(name, count, said.motor.empty() ? "settings" : "motor"));
  FLYBALL_TRY(robot.steer_motor, motor_of(said.steer_motor.empty() ? name : said.steer_motor, 1,
                                          said.steer_motor.empty() ? "motor" : "steer_motor"));
  FLYBALL_CHECK(take_modules(project, settings, robot, is_track_known));
  robot.wheel_inertia = said.wheel_inertia.si();
  robot.wheelbase = sides ? said.wheelbase.value_or(Length(0.0)).si() : 0.0;
  robot.grip = said.grip.value_or(settings.wheel_friction.value_or(robot.grip));
  const double none = std::numeric_limits<double>::infinity();
  const double n = count;
  robot.stator_limit = said.stator_limit        ? n * said.stator_limit->si()
                       : settings.current_limit ? n * *settings.current_limit
                                                : none;
  robot.supply_limit = said.supply_limit ? n * said.supply_limit->si() : none;
  robot.steer_gearing = said.steer_gearing;
  robot.steer_inertia = said.steer_inertia.si();
  double x = 0.5 * robot.wheelbase;
  double y = 0.5 * robot.trackwidth;
  for (const Vector2d& module : robot.modules) {
    x = std::max(x, module(0));
    y = std::max(y, module(1));
  }
  constexpr double around = 0.3;  // m, of bumpers and frame
  robot.length = said.bumper_length
                     ? said.bumper_length->si()
                     : settings.robot_length.value_or(2.0 * std::max(x, 0.8 * y) + around);
  robot.width =
      said.bumper_width ? said.bumper_width->si() : settings.robot_width.value_or(2.0 * y + around);
  return robot;
}

/// Waypoints as a path with times.
Expected<RobotTrajectory> trajectory_of(const Project& project, const DriveJob& job,
                                        const PathPlannerSettings& settings) {
  const DriveSection& said = project.drive;
  const bool sides = job.robot.kind == DriveKind::differential;
  std::vector<Pose2d> poses;
  std::vector<double> looks;
  for (std::size_t i = 0; i < said.waypoints.size(); ++i) {
    const std::string name = fmt::format("drive.waypoints[{}]", i);
    auto values = quantities_of(
        said.waypoints[i],
        {Dimension::length, Dimension::length, Dimension::angle, Dimension::angle}, 3, name);
    if (!values) {
      return tl::unexpected(std::move(values).error().in(project.path));
    }
    if (values->size() > 3 && sides) {
      return tl::unexpected(wrong(project, fmt::format("waypoints[{}]", i), "of four values")
                                .hint("a differential drive looks where it goes: leave the fourth "
                                      "out"));
    }
    poses.emplace_back((*values)[0], (*values)[1], (*values)[2]);
    looks.push_back(values->size() > 3 ? (*values)[3] : (*values)[2]);
  }
  const auto named = [&](Error error) {
    return tl::unexpected(std::move(error).in(fmt::format("{}: drive.waypoints", project.path)));
  };
  auto spline = quintic_spline(poses);
  if (!spline) {
    return named(std::move(spline).error());
  }
  const double top = job.robot.free_speed(job.max_voltage);
  const double usual = 2.5;       // m/s²
  const double usual_bend = 2.0;  // m/s²
  const double share = 0.6;       // of the free speed: what is left for feedback
  PathLimits limits{.velocity = said.max_velocity ? said.max_velocity->si()
                                                  : settings.max_velocity.value_or(share * top),
                    .acceleration = said.max_acceleration
                                        ? said.max_acceleration->si()
                                        : settings.max_acceleration.value_or(usual),
                    .centripetal = said.max_centripetal ? said.max_centripetal->si() : usual_bend};
  auto path = sample_path(*spline);
  if (!path) {
    return named(std::move(path).error());
  }
  auto timed = time_path(*path, limits);
  if (!timed) {
    return named(std::move(timed).error());
  }
  RobotTrajectory trajectory{.source = project.path};
  // The way the robot looks goes on evenly along the path between two waypoints.
  std::vector<double> lengths{0.0};
  const auto& points = timed->points();
  for (std::size_t i = 1; i < points.size(); ++i) {
    lengths.push_back(lengths.back() +
                      (points[i].pose.translation() - points[i - 1].pose.translation()).norm());
  }
  const bool turns_apart = !sides && std::any_of(said.waypoints.begin(), said.waypoints.end(),
                                                 [](const std::string& text) {
                                                   return text::split(text, ",").size() > 3;
                                                 });
  std::vector<double> stations;
  std::vector<double> angles;
  for (std::size_t w = 0, at = 0; w < poses.size(); ++w) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = at; i < points.size(); ++i) {
      const double d = (points[i].pose.translation() - poses[w].translation()).norm();
      if (d < nearest - 1e-12) {
        nearest = d;
        at = i;
      }
      if (d < 1e-9) {
        break;
      }
    }
    stations.push_back(lengths[at]);
    angles.push_back(angles.empty() ? looks[w]
                                    : angles.back() + std::remainder(looks[w] - angles.back(),
                                                                     2.0 * std::numbers::pi));
  }
  std::size_t w = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const TrajectoryPoint& point = points[i];
    const double sign = said.reversed && sides ? -1.0 : 1.0;
    MotionSample sample{.time = point.time, .pose = point.pose, .place = {0, 0}};
    const Vector2d way(point.pose.rotation().cos(), point.pose.rotation().sin());
    sample.velocity = point.velocity * way;
    sample.acceleration = point.acceleration * way;
    sample.omega = point.velocity * point.curvature;
    if (sign < 0.0) {
      sample.pose = point.pose * Pose2d(0.0, 0.0, std::numbers::pi);
    }
    if (turns_apart) {
      while (w + 2 < stations.size() && lengths[i] > stations[w + 1]) {
        ++w;
      }
      const double span = stations[w + 1] - stations[w];
      const double s = span > 0.0 ? std::clamp((lengths[i] - stations[w]) / span, 0.0, 1.0) : 1.0;
      const double slope = span > 0.0 ? (angles[w + 1] - angles[w]) / span : 0.0;
      // Smoothly at the waypoints: 3 s² - 2 s³.
      sample.pose = Pose2d(point.pose.x(), point.pose.y(),
                           angles[w] + (angles[w + 1] - angles[w]) * s * s * (3.0 - 2.0 * s));
      sample.omega = point.velocity * slope * 6.0 * s * (1.0 - s);
    }
    trajectory.samples.push_back(sample);
  }
  trajectory.holonomic = turns_apart;
  return trajectory;
}

/// A trajectory, or a path that is timed for the robot.
ExpectedAll<RobotTrajectory> followed_file(const Project& project, const DriveJob& job,
                                           const std::string& file) {
  FLYBALL_TRY(const std::string text, read_file(file));
  const auto format = motion_format(text, file);
  const bool planned =
      format &&
      (*format == MotionFormat::pathplanner_path || *format == MotionFormat::pathplanner_auto ||
       *format == MotionFormat::choreo_trajectory || *format == MotionFormat::choreo_project ||
       *format == MotionFormat::trajectory_table);
  if (!planned) {
    return parse_trajectory(text, file);
  }
  PathJob path{.files = {file}, .name = project.drive.path};
  if (*format == MotionFormat::pathplanner_path || *format == MotionFormat::pathplanner_auto) {
    path.velocity = project.drive.max_velocity;
    path.acceleration = project.drive.max_acceleration;
    path.centripetal = project.drive.max_centripetal;
  }
  FLYBALL_TRY(LoadedMotion motion, load_motion(file, path, job.robot, job.max_voltage));
  return std::move(motion.trajectory);
}

Expected<DriveFollower> follower_of(const Project& project, DriveKind kind) {
  const std::string& said = project.drive.follower;
  const bool sides = kind == DriveKind::differential;
  if (said.empty()) {
    return sides ? DriveFollower::ltv_unicycle : DriveFollower::holonomic;
  }
  for (const DriveFollower follower :
       {DriveFollower::ramsete, DriveFollower::ltv_unicycle, DriveFollower::ltv_drive,
        DriveFollower::holonomic, DriveFollower::pure_pursuit}) {
    if (said == to_string(follower)) {
      if (follower != DriveFollower::pure_pursuit &&
          (follower == DriveFollower::holonomic) == sides) {
        return tl::unexpected(
            wrong(project, "follower", fmt::format("\"{}\"", said))
                .expected(sides ? "one of a differential drive: ramsete, ltv unicycle, ltv drive, "
                                  "pure pursuit"
                                : fmt::format("holonomic or pure pursuit, for a {} drive",
                                              to_string(kind))));
      }
      return follower;
    }
  }
  return tl::unexpected(
      wrong(project, "follower", fmt::format("\"{}\"", shortened(said)))
          .expected("ramsete, ltv unicycle, ltv drive, holonomic or pure pursuit"));
}

/// That of the file; of what moves sideways, where it says nothing, one with which wheels that lose
/// the floor do not oscillate. The followers of a differential drive need the tight one.
Expected<void> take_velocity_tolerance(const DriveSection& said, DriveJob& job) {
  const double usual = job.velocity_tolerance;
  const double asked = said.velocity_tolerance.value_or(Velocity(usual)).si();
  const bool sides = job.robot.kind == DriveKind::differential;
  const auto calm = calm_velocity_tolerance(job, asked);
  if (!calm) {
    return {};  // whoever designs the loop says why there is none
  }
  job.velocity_tolerance = said.velocity_tolerance || sides ? asked : *calm;
  const SpinningWheel wheel = SpinningWheel::of(job.robot, job.period);
  const auto gain = wheel_gain(job);
  const double pole = gain ? wheel.pole(*gain) : 0.0;
  const DisturbanceSection& off = job.disturbance;
  const bool slips = off.slip_grip != 1.0 && off.slip_for.si() > 0.0;
  if (pole <= -1.0 && (said.velocity_tolerance || slips)) {
    const std::string mend =
        sides ? "a shorter controller.period keeps it calm"
              : fmt::format("drive.velocity_tolerance of {} m/s or more keeps it calm",
                            format_number(*calm, 3));
    warn(job.diagnostics, "spinning_wheels",
         "the speed of a wheel that loses the floor oscillates: without the robot's share its loop "
         "has a pole of {}; {}",
         format_number(pole, 3), mend);
  } else if (job.velocity_tolerance > asked) {
    note(job.diagnostics, "assumed",
         "drive.velocity_tolerance is taken as {} m/s: with {} m/s the speed of a wheel that loses "
         "the floor would oscillate",
         format_number(*calm, 3), format_number(usual, 3));
  }
  return {};
}

/// What was typed for a key, if anything was. @param option  "--trajectory".
bool is_typed(std::span<const Override> overrides, std::string_view option) {
  return std::any_of(overrides.begin(), overrides.end(),
                     [&](const Override& o) { return o.option == option; });
}

/// Files that the project names stand beside it, those that are typed where they are typed.
std::string file_of(const Project& project, std::span<const Override> overrides,
                    std::string_view option, const std::string& file) {
  return is_typed(overrides, option) ? file : beside(project.path, file);
}

/// All but the trajectory. @param settings  Set to what the project file refers to.
ExpectedAll<DriveJob> drive_job_of(const Project& project, std::span<const Override> overrides,
                                   PathPlannerSettings& settings) {
  const DriveSection& said = project.drive;
  if (said.type.empty()) {
    return tl::unexpected(Errors(Error(ProjectError::missing_key)
                                     .in(project.path)
                                     .about("[drive]")
                                     .got("missing")
                                     .hint("say what the drivetrain is: [drive] and type = "
                                           "\"differential\", \"swerve\" or \"mecanum\"")));
  }
  std::string settings_path;
  if (!said.settings.empty()) {
    settings_path = file_of(project, overrides, "--settings", said.settings);
    FLYBALL_TRY(settings, read_pathplanner_settings(settings_path));
  }
  DriveJob job{.path = project.path};
  FLYBALL_TRY(job.robot, robot_of(project, settings, settings_path));
  FLYBALL_TRY(job.follower, follower_of(project, job.robot.kind));
  job.diagnostics = settings.diagnostics;
  job.b = said.b;
  job.zeta = said.zeta;
  if (job.follower == DriveFollower::holonomic) {
    job.x_tolerance = 0.05;
    job.y_tolerance = 0.05;
    job.heading_tolerance = 0.1;
  }
  job.x_tolerance = said.x_tolerance.value_or(Length(job.x_tolerance)).si();
  job.y_tolerance = said.y_tolerance.value_or(Length(job.y_tolerance)).si();
  job.heading_tolerance = said.heading_tolerance.value_or(Angle(job.heading_tolerance)).si();
  job.least_lookahead = said.least_lookahead.si();
  job.lookahead_time = said.lookahead_time.si();
  job.period = project.job.controller.period;
  job.max_voltage = project.job.controller.max_voltage;
  job.battery = {.open_circuit_voltage = project.job.battery.open_circuit_voltage,
                 .resistance = project.job.battery.resistance};
  job.disturbance = project.disturbance;
  job.seed = project.job.seed;
  FLYBALL_CHECK(take_velocity_tolerance(said, job));
  return job;
}

}  // namespace

ExpectedAll<DriveJob> drive_design_job(const std::string& path,
                                       std::span<const Override> overrides) {
  FLYBALL_TRY(const auto project, read_project(path, overrides));
  PathPlannerSettings settings;
  return drive_job_of(project, overrides, settings);
}

ExpectedAll<DriveJob> drive_job(const std::string& path, std::span<const Override> overrides) {
  FLYBALL_TRY(const auto project, read_project(path, overrides));
  PathPlannerSettings settings;
  FLYBALL_TRY(auto job, drive_job_of(project, overrides, settings));
  const DriveSection& said = project.drive;
  const bool typed = is_typed(overrides, "--trajectory");  // in place of the file's waypoints
  if (!typed && said.trajectory.empty() == said.waypoints.empty()) {
    return tl::unexpected(
        Errors(Error(ProjectError::missing_key)
                   .in(project.path)
                   .about("drive.trajectory")
                   .got(said.trajectory.empty() ? "missing, and so are waypoints"
                                                : "there beside waypoints")
                   .expected("one of them")
                   .hint("waypoints = [\"1 m, 1 m, 0 deg\", \"4 m, 2 m, 0 deg\"], or a file of "
                         "WPILib, Choreo or PathPlanner: trajectory = \"path.wpilib.json\"")));
  }
  if (!said.trajectory.empty()) {
    FLYBALL_TRY(
        job.trajectory,
        followed_file(project, job, file_of(project, overrides, "--trajectory", said.trajectory)));
  } else {
    FLYBALL_TRY(job.trajectory, trajectory_of(project, job, settings));
  }
  for (const Diagnostic& diagnostic : job.trajectory.diagnostics) {
    job.diagnostics.push_back(diagnostic);
  }
  return job;
}

}  // namespace flyball::study
