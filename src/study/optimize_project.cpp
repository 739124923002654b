// What a project file says of a trajectory that is to be found.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/study/drive.hpp>
#include <flyball/study/optimize.hpp>
#include <flyball/study/project.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/optimize_choreo.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

constexpr double standard_gravity = 9.80665;

/// The comma-separated parts of a row of a key, and what is wrong with it.
class TomlRow {
 public:
  TomlRow(const Project& project, std::string key, std::size_t number, const std::string& text)
      : path_(project.path), name_(fmt::format("optimize.{}[{}]", key, number)), text_(text) {
    for (const std::string_view part : text::split(text_, ",")) {
      parts_.emplace_back(part);
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return parts_.size(); }
  /// Takes a word away where it is the last part.
  bool take_word(std::string_view word) {
    if (parts_.empty()) {
      return false;
    }
    std::string last = parts_.back();
    std::erase(last, ' ');
    if (last != word) {
      return false;
    }
    parts_.pop_back();
    return true;
  }
  Expected<double> value(std::size_t i, Dimension dimension) const {
    auto read = parse_quantity(parts_[i], dimension, name_);
    if (!read) {
      return tl::unexpected(std::move(read).error().in(path_));
    }
    return *read;
  }
  /// A waypoint's number.
  Expected<int> waypoint(std::size_t i, std::size_t count) const {
    FLYBALL_TRY(const double at, value(i, Dimension::dimensionless));
    if (at != std::floor(at) || at < 0.0 || at >= static_cast<double>(count)) {
      return tl::unexpected(
          wrong(fmt::format("waypoint {}", format_number(at)), fmt::format("0 to {}", count - 1)));
    }
    return static_cast<int>(at);
  }
  [[nodiscard]] Error wrong(std::string got, std::string expected) const {
    return Error(ProjectError::wrong_value)
        .in(path_)
        .about(name_)
        .got(std::move(got))
        .expected(std::move(expected));
  }
  [[nodiscard]] Error wrong_count(std::string expected) const {
    return wrong(fmt::format("\"{}\", {} values", text_, parts_.size()), std::move(expected));
  }

 private:
  std::string path_;
  std::string name_;
  std::string text_;
  std::vector<std::string> parts_;
};

Expected<void> take_waypoints(const Project& project, DriveProblem& problem) {
  const auto& rows = project.optimize.waypoints;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    TomlRow row(project, "waypoints", i, rows[i]);
    DriveWaypoint w;
    const bool end = i == 0 || i + 1 == rows.size();
    const bool guess = row.take_word("guess");
    const bool stop = row.take_word("stop");
    const bool moving = row.take_word("moving");
    w.stop = stop || (end && !moving);
    if (row.size() < 2 || row.size() > 3) {
      return tl::unexpected(
          row.wrong_count("x, y and maybe a heading, then \"stop\", \"moving\" or \"guess\""));
    }
    FLYBALL_TRY(w.x, row.value(0, Dimension::length));
    FLYBALL_TRY(w.y, row.value(1, Dimension::length));
    w.fix_translation = !guess;
    w.fix_heading = row.size() == 3 && !guess;
    if (row.size() == 3) {
      FLYBALL_TRY(w.heading, row.value(2, Dimension::angle));
    } else if (i > 0) {
      w.heading = problem.waypoints.back().heading;
    }
    problem.waypoints.push_back(w);
  }
  return {};
}

Expected<void> take_areas(const Project& project, const std::string& key,
                          const std::vector<std::string>& rows, bool inside,
                          DriveProblem& problem) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TomlRow row(project, key, i, rows[i]);
    DriveConstraint c{.from = 0, .to = -1};
    std::vector<double> values;
    for (std::size_t j = 0; j < row.size(); ++j) {
      FLYBALL_TRY(const double value, row.value(j, Dimension::length));
      values.push_back(value);
    }
    if (values.size() == 3) {
      c.kind = inside ? DriveConstraintKind::keep_in_circle : DriveConstraintKind::keep_out_circle;
      c.x = values[0];
      c.y = values[1];
      c.radius = values[2];
    } else if (values.size() == 4 && inside) {
      c.kind = DriveConstraintKind::keep_in_rectangle;
      c.x = values[0];
      c.y = values[1];
      c.width = values[2];
      c.height = values[3];
    } else if (values.size() >= 6 && values.size() % 2 == 0) {
      c.kind =
          inside ? DriveConstraintKind::keep_in_polygon : DriveConstraintKind::keep_out_polygon;
      double area = 0.0;
      for (std::size_t j = 0; j < values.size(); j += 2) {
        c.polygon.emplace_back(values[j], values[j + 1]);
        const std::size_t next = (j + 2) % values.size();
        area += values[j] * values[next + 1] - values[next] * values[j + 1];
      }
      if (area < 0.0) {  // clockwise is as good
        std::reverse(c.polygon.begin(), c.polygon.end());
      }
    } else {
      return tl::unexpected(row.wrong_count(
          inside ? "x, y, radius; x, y, width, height; or x, y of three corners or more"
                 : "x, y, radius; or x, y of three corners or more"));
    }
    problem.constraints.push_back(std::move(c));
  }
  return {};
}

Expected<void> take_rows(const Project& project, DriveProblem& problem) {
  const OptimizeSection& said = project.optimize;
  const std::size_t count = problem.waypoints.size();
  for (std::size_t i = 0; i < said.lanes.size(); ++i) {
    const TomlRow row(project, "lanes", i, said.lanes[i]);
    if (row.size() != 3) {
      return tl::unexpected(row.wrong_count("from, to, tolerance"));
    }
    DriveConstraint c{.kind = DriveConstraintKind::keep_in_lane};
    FLYBALL_TRY(c.from, row.waypoint(0, count));
    FLYBALL_TRY(const int to, row.waypoint(1, count));
    c.to = to;
    FLYBALL_TRY(c.tolerance, row.value(2, Dimension::length));
    problem.constraints.push_back(std::move(c));
  }
  for (std::size_t i = 0; i < said.point_at.size(); ++i) {
    const TomlRow row(project, "point_at", i, said.point_at[i]);
    if (row.size() != 5) {
      return tl::unexpected(row.wrong_count("from, to, x, y, tolerance"));
    }
    DriveConstraint c{.kind = DriveConstraintKind::point_at};
    FLYBALL_TRY(c.from, row.waypoint(0, count));
    FLYBALL_TRY(const int to, row.waypoint(1, count));
    c.to = to;
    FLYBALL_TRY(c.x, row.value(2, Dimension::length));
    FLYBALL_TRY(c.y, row.value(3, Dimension::length));
    FLYBALL_TRY(c.tolerance, row.value(4, Dimension::angle));
    problem.constraints.push_back(std::move(c));
  }
  const auto limit = [&](DriveConstraintKind kind, const auto& value) {
    if (value) {
      problem.constraints.push_back({.kind = kind, .from = 0, .to = -1, .limit = value->si()});
    }
  };
  limit(DriveConstraintKind::max_velocity, said.max_velocity);
  limit(DriveConstraintKind::max_acceleration, said.max_acceleration);
  limit(DriveConstraintKind::max_angular_velocity, said.max_angular_velocity);
  return {};
}

/// What the drivetrain pushes with, at the voltage that the loop may ask for.
DriveModel model_of(const DriveJob& job) {
  const DriveRobot& robot = job.robot;
  DriveModel model;
  model.drivetrain = robot.kind == DriveKind::swerve    ? Drivetrain::swerve
                     : robot.kind == DriveKind::mecanum ? Drivetrain::mecanum
                                                        : Drivetrain::differential;
  model.mass = robot.mass;
  model.moment_of_inertia = robot.moment_of_inertia;
  model.wheels = robot.modules;
  model.trackwidth = robot.trackwidth;
  const double arm = robot.gearing / robot.wheel_radius;
  const mechanisms::DcMotor& motor = robot.motor;
  model.stall_force = motor.torque(0.0, job.max_voltage) * arm;
  model.free_speed = motor.Kv * job.max_voltage / arm;
  model.max_speed = robot.free_speed(job.max_voltage);
  const double limited =
      std::isfinite(robot.stator_limit) ? motor.Kt * robot.stator_limit * arm : model.stall_force;
  model.max_force = std::min(model.stall_force, limited);
  model.friction =
      robot.grip * robot.mass * standard_gravity / static_cast<double>(model.wheel_count());
  if (std::isfinite(robot.supply_limit)) {
    // V I_supply = ω τ + R I², with I = τ/K_t.
    model.supply_power = job.max_voltage * robot.supply_limit;
    model.copper_loss = motor.R / std::pow(motor.Kt * arm, 2);
  }
  const double x = 0.5 * robot.length;
  const double y = 0.5 * robot.width;
  model.corners = {Vector2d(x, y), Vector2d(-x, y), Vector2d(-x, -y), Vector2d(x, -y)};
  return model;
}

}  // namespace

ExpectedAll<OptimizeJob> optimize_job(const std::string& path,
                                      std::span<const Override> overrides) {
  if (is_choreo(path)) {
    return choreo_job(path);
  }
  FLYBALL_TRY(const DriveJob drive, drive_design_job(path, overrides));
  FLYBALL_TRY(const Project project, read_project(path, overrides));
  OptimizeJob job{.path = path, .diagnostics = drive.diagnostics};
  OptimizeTask task;
  const std::size_t slash = path.find_last_of('/');
  task.name = slash == std::string::npos ? path : path.substr(slash + 1);
  if (task.name.ends_with(".toml")) {
    task.name.erase(task.name.size() - 5);
  }
  task.problem.model = model_of(drive);
  if (project.optimize.waypoints.size() < 2) {
    return tl::unexpected(Error(ProjectError::missing_key)
                              .in(path)
                              .about("optimize.waypoints")
                              .got(project.optimize.waypoints.empty() ? "missing" : "of one place")
                              .hint("say two places or more: [optimize] waypoints = [\"1 m, 1 m, "
                                    "0 deg\", \"4 m, 2 m\"]"));
  }
  FLYBALL_CHECK(take_waypoints(project, task.problem));
  FLYBALL_CHECK(take_areas(project, "keep_out", project.optimize.keep_out, false, task.problem));
  FLYBALL_CHECK(take_areas(project, "keep_in", project.optimize.keep_in, true, task.problem));
  FLYBALL_CHECK(take_rows(project, task.problem));
  task.problem.target_interval = project.optimize.interval.si();
  task.config = config_of(task.problem.model, drive.robot.gearing, drive.robot.wheel_radius);
  job.options.max_attempts = project.optimize.attempts;
  job.options.longest_segment = project.optimize.longest.si();
  job.options.time_limit = project.optimize.time_limit.si();
  job.tasks.push_back(std::move(task));
  return job;
}

}  // namespace flyball::study
