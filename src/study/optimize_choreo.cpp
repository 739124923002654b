#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/io/file.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/optimize_choreo.hpp"

namespace flyball::study {

namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Json = nlohmann::json;

constexpr double gravity = 9.80665;

Error refusal_of(OptimizeError code, const std::string& path, std::string about) {
  return Error(code).in(path).about(std::move(about));
}

/// Place among `count` waypoints; 2024's constraints name waypoints as they are counted.
Expected<int> waypoint_of(const std::string& text, std::size_t count, const std::string& path,
                          const std::string& type) {
  if (text == "first") {
    return 0;
  }
  if (text == "last") {
    return static_cast<int>(count) - 1;
  }
  int value = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 0 ||
      value >= static_cast<int>(count)) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in(path)
                              .about(fmt::format("a waypoint of the constraint {}", type))
                              .expected(fmt::format("\"first\", \"last\" or 0 to {}", count - 1))
                              .got(fmt::format("\"{}\"", text)));
  }
  return value;
}

using KindName = ChoreoKind;
constexpr std::array kinds_of_2024{
    KindName{"StopPoint", DriveConstraintKind::stop_point},
    KindName{"MaxVelocity", DriveConstraintKind::max_velocity},
    KindName{"WptZeroVelocity", DriveConstraintKind::max_velocity},
    KindName{"StraightLine", DriveConstraintKind::keep_in_lane},
    KindName{"MaxAcceleration", DriveConstraintKind::max_acceleration},
    KindName{"MaxAngularVelocity", DriveConstraintKind::max_angular_velocity},
    KindName{"ZeroAngularVelocity", DriveConstraintKind::max_angular_velocity},
    KindName{"PointAt", DriveConstraintKind::point_at}};

Expected<DriveConstraint> constraint_of(const ChoreoConstraint& from, std::size_t waypoints,
                                        const std::string& path) {
  const auto* const row = std::find_if(choreo_kinds.begin(), choreo_kinds.end(),
                                       [&](const ChoreoKind& k) { return k.name == from.type; });
  if (row == choreo_kinds.end()) {
    return tl::unexpected(refusal_of(OptimizeError::unknown_kind, path, "a constraint")
                              .got(fmt::format("\"{}\"", from.type))
                              .expected("StopPoint, MaxVelocity, MaxAcceleration, "
                                        "MaxAngularVelocity, PointAt, KeepInCircle, "
                                        "KeepInRectangle, KeepInLane or KeepOutCircle"));
  }
  DriveConstraint c{.kind = row->kind};
  FLYBALL_TRY(c.from, waypoint_of(from.from, waypoints, path, from.type));
  if (from.to && !from.to->empty()) {
    FLYBALL_TRY(const int to, waypoint_of(*from.to, waypoints, path, from.type));
    c.to = to;
  }
  c.limit = from.prop("max").value_or(0.0);
  c.x = from.prop("x").value_or(0.0);
  c.y = from.prop("y").value_or(0.0);
  c.width = from.prop("w").value_or(0.0);
  c.height = from.prop("h").value_or(0.0);
  c.radius = from.prop("r").value_or(0.0);
  c.tolerance = from.prop("tolerance").value_or(0.0);
  c.flip = from.flip.value_or(false);
  return c;
}

/// What the reader keeps as it stands. @return discarded where there is none.
Json tree_of(const std::string& path) {
  const auto text = read_file(path);
  return text ? Json::parse(*text, nullptr, false) : Json(Json::value_t::discarded);
}

/// A number of an object of 2024.
double number_of(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : 0.0;
}

/// The constraints and obstacles of a path of 2024.
Expected<void> take_2024(const Json& tree, const std::string& name, const std::string& path,
                         DriveProblem& problem) {
  if (!tree.is_object() || !tree.contains("paths") || !tree["paths"].is_object() ||
      !tree["paths"].contains(name) || !tree["paths"][name].is_object()) {
    return {};
  }
  const Json& of = tree["paths"][name];
  const std::size_t count = problem.waypoints.size();
  const auto waypoint = [&](const Json& at, const std::string& type) {
    return waypoint_of(at.is_string() ? at.get<std::string>() : at.dump(), count, path, type);
  };
  const Json constraints = of.value("constraints", Json::array());
  for (const Json& from : constraints.is_array() ? constraints : Json::array()) {
    if (!from.is_object()) {
      continue;
    }
    const std::string type = from.value("type", Json("")).is_string()
                                 ? from.value("type", std::string())
                                 : std::string();
    const Json scope = from.value("scope", Json::array());
    DriveConstraint c;
    const auto* const row = std::find_if(kinds_of_2024.begin(), kinds_of_2024.end(),
                                         [&](const KindName& k) { return k.name == type; });
    if (row == kinds_of_2024.end()) {
      return tl::unexpected(
          refusal_of(OptimizeError::unknown_kind, path, fmt::format("a constraint of {}", name))
              .got(fmt::format("\"{}\"", type)));
    }
    c.kind = row->kind;
    if (!scope.is_array() || scope.empty() || scope.size() > 2) {
      return tl::unexpected(Error(ArgumentError::malformed)
                                .in(path)
                                .about(fmt::format("the scope of {} of {}", type, name))
                                .expected("one waypoint, or two"));
    }
    FLYBALL_TRY(c.from, waypoint(scope[0], type));
    if (scope.size() == 2) {
      FLYBALL_TRY(const int to, waypoint(scope[1], type));
      c.to = to;
    }
    c.limit = type == "MaxVelocity"          ? number_of(from, "velocity")
              : type == "MaxAcceleration"    ? number_of(from, "acceleration")
              : type == "MaxAngularVelocity" ? number_of(from, "angular_velocity")
                                             : 0.0;
    c.x = number_of(from, "x");
    c.y = number_of(from, "y");
    c.tolerance = type == "StraightLine" ? 1e-3 : number_of(from, "tolerance");
    problem.constraints.push_back(std::move(c));
  }
  const Json obstacles = of.value("circleObstacles", Json::array());
  for (const Json& disc : obstacles.is_array() ? obstacles : Json::array()) {
    if (disc.is_object()) {
      problem.constraints.push_back({.kind = DriveConstraintKind::keep_out_circle,
                                     .from = 0,
                                     .to = -1,
                                     .x = number_of(disc, "x"),
                                     .y = number_of(disc, "y"),
                                     .radius = number_of(disc, "radius")});
    }
  }
  return {};
}

Expected<void> take_parameters(const ChoreoParameters& params, const std::string& path,
                               DriveProblem& problem) {
  if (params.waypoints.size() < 2) {
    return tl::unexpected(refusal_of(OptimizeError::no_waypoints, path, "the trajectory")
                              .got(fmt::format("of {} waypoints", params.waypoints.size()))
                              .expected("two waypoints or more, in params.waypoints"));
  }
  for (const ChoreoWaypoint& w : params.waypoints) {
    const bool guess = w.is_initial_guess.value_or(false);
    problem.waypoints.push_back({.x = w.x.value,
                                 .y = w.y.value,
                                 .heading = w.heading.value,
                                 .fix_translation = w.fix_translation && !guess,
                                 .fix_heading = w.fix_heading && !guess});
  }
  for (const ChoreoConstraint& c : params.constraints) {
    if (c.enabled) {
      FLYBALL_TRY(DriveConstraint constraint, constraint_of(c, params.waypoints.size(), path));
      problem.constraints.push_back(std::move(constraint));
    }
  }
  if (params.target_dt.value > 0.0) {
    problem.target_interval = std::min(params.target_dt.value, 0.04);
  }
  return {};
}

std::vector<Vector2d> box(double front, double side, double back) {
  return {Vector2d(front, side), Vector2d(-back, side), Vector2d(-back, -side),
          Vector2d(front, -side)};
}

DriveModel model_of(const ChoreoConfig& config, bool differential) {
  DriveModel model;
  model.drivetrain = differential ? Drivetrain::differential : Drivetrain::swerve;
  model.mass = config.mass.value;
  model.moment_of_inertia = config.inertia.value;
  const Vector2d front(config.front_left.x.value, config.front_left.y.value);
  const Vector2d back(config.back_left.x.value, config.back_left.y.value);
  model.wheels = {front, Vector2d(front(0), -front(1)), back, Vector2d(back(0), -back(1))};
  model.trackwidth =
      config.differential_track_width ? config.differential_track_width->value : 2.0 * front(1);
  model.max_force = config.wheel_force();
  model.max_speed = config.wheel_speed();
  model.friction = config.cof ? config.cof->value * model.mass * gravity /
                                    static_cast<double>(model.wheel_count())
                              : 0.0;
  model.corners =
      box(config.bumper.front.value, config.bumper.side.value, config.bumper.back.value);
  return model;
}

std::optional<double> duration_of(const ChoreoGenerated& generated) {
  double most = 0.0;
  for (const ChoreoSample& sample : generated.samples) {
    most = std::max(most, sample.time);
  }
  return generated.samples.empty() ? std::nullopt : std::optional(most);
}

/// A project of several that says the robot of a kind.
ExpectedAll<std::optional<ChoreoConfig>> config_beside(const std::string& path, bool differential,
                                                       std::vector<Diagnostic>& diagnostics) {
  std::error_code ignored;
  fs::path folder = fs::path(path).parent_path();
  if (folder.empty()) {
    folder = ".";
  }
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == ".chor") {
      files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  for (const std::string& file : files) {
    const auto project = read_choreo_project(file);
    if (!project) {
      if (files.size() == 1) {
        return tl::unexpected(project.error());
      }
      continue;
    }
    const bool fits = project->type.empty() || (project->type == "Differential") == differential;
    if (project->config && fits) {
      if (files.size() > 1) {
        note(diagnostics, "project_beside",
             "the robot is that of {}, the first project beside the trajectory of its drivetrain",
             file);
      }
      return project->config;
    }
  }
  return std::optional<ChoreoConfig>();
}

ExpectedAll<OptimizeTask> task_of(const std::string& path, ChoreoTrajectory file,
                                  const std::optional<ChoreoConfig>& of_project, bool differential,
                                  std::vector<Diagnostic>& diagnostics) {
  OptimizeTask task;
  task.name = file.name.empty() ? fs::path(path).stem().string() : file.name;
  if (file.is_2024 || file.params.waypoints.empty()) {
    return tl::unexpected(refusal_of(OptimizeError::no_waypoints, path, "the trajectory")
                              .got("of samples alone, without the waypoints it was made from")
                              .hint("of 2024 the .chor project holds them: flyball optimize "
                                    "PROJECT.chor"));
  }
  std::optional<ChoreoConfig> config = of_project;
  if (!config && file.trajectory.config) {
    config = file.trajectory.config;
  }
  if (!config) {
    FLYBALL_TRY(config, config_beside(path, differential, diagnostics));
  }
  if (!config) {
    return tl::unexpected(
        refusal_of(OptimizeError::no_robot, path, "the robot")
            .got("missing")
            .expected("trajectory.config, which files of the version 3 have, or a .chor project "
                      "beside the trajectory"));
  }
  task.config = *config;
  task.problem.model = model_of(*config, differential);
  FLYBALL_CHECK(take_parameters(file.params, path, task.problem));
  task.given_duration = duration_of(file.trajectory);
  task.file = std::move(file);
  return task;
}

ExpectedAll<OptimizeJob> of_trajectory(const std::string& path) {
  OptimizeJob job{.path = path};
  FLYBALL_TRY(ChoreoTrajectory file, read_choreo_trajectory(path));
  job.diagnostics = file.diagnostics;
  const bool differential = file.differential();
  FLYBALL_TRY(OptimizeTask task,
              task_of(path, std::move(file), std::nullopt, differential, job.diagnostics));
  job.tasks.push_back(std::move(task));
  return job;
}

ExpectedAll<OptimizeJob> of_project(const std::string& path) {
  OptimizeJob job{.path = path};
  FLYBALL_TRY(ChoreoProject project, read_choreo_project(path));
  job.diagnostics = project.diagnostics;
  if (project.robot) {
    const ChoreoRobot2024& robot = *project.robot;
    ChoreoConfig config;
    const double x = 0.5 * robot.wheelbase;
    const double y = 0.5 * robot.track_width;
    config.front_left = {.x = {x}, .y = {y}};
    config.back_left = {.x = {-x}, .y = {y}};
    config.mass.value = robot.mass;
    config.inertia.value = robot.rotational_inertia;
    config.gearing.value = robot.gearing;
    config.radius.value = robot.wheel_radius;
    config.vmax.value = robot.motor_max_velocity * std::numbers::pi / 30.0;
    config.tmax.value = robot.motor_max_torque;
    config.bumper = {.front = {0.5 * robot.bumper_length},
                     .side = {0.5 * robot.bumper_width},
                     .back = {0.5 * robot.bumper_length}};
    const Json tree = tree_of(path);
    for (const ChoreoPath2024& from : project.paths) {
      OptimizeTask task{.name = from.name, .config = config};
      task.problem.model = model_of(config, false);
      ChoreoParameters params;
      params.waypoints = from.waypoints;
      FLYBALL_CHECK(take_parameters(params, path, task.problem));
      FLYBALL_CHECK(take_2024(tree, from.name, path, task.problem));
      ChoreoGenerated given;
      given.samples = from.trajectory;
      task.given_duration = duration_of(given);
      job.tasks.push_back(std::move(task));
    }
  } else {
    if (!project.config) {
      return tl::unexpected(refusal_of(OptimizeError::no_robot, path, "the robot")
                                .got("missing")
                                .expected("config, as Choreo's projects have it"));
    }
    std::error_code ignored;
    fs::path folder = fs::path(path).parent_path();
    if (folder.empty()) {
      folder = ".";
    }
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
      if (entry.path().extension() == ".traj") {
        files.push_back(entry.path().string());
      }
    }
    std::sort(files.begin(), files.end());
    const bool differential = project.type == "Differential";
    for (const std::string& file : files) {
      FLYBALL_TRY(ChoreoTrajectory trajectory, read_choreo_trajectory(file));
      if (trajectory.is_2024 || trajectory.differential() != differential) {
        continue;  // of another project in the same folder
      }
      FLYBALL_TRY(OptimizeTask task, task_of(file, std::move(trajectory), project.config,
                                             differential, job.diagnostics));
      job.tasks.push_back(std::move(task));
    }
  }
  job.project = std::move(project);
  if (job.tasks.empty()) {
    return tl::unexpected(refusal_of(OptimizeError::no_waypoints, path, "the project")
                              .got("without trajectories")
                              .expected("paths in it (of 2024), or .traj files of its drivetrain "
                                        "beside it"));
  }
  return job;
}

}  // namespace

bool is_choreo(const std::string& path) {
  return path.ends_with(".traj") || path.ends_with(".chor");
}

ExpectedAll<OptimizeJob> choreo_job(const std::string& path) {
  return path.ends_with(".traj") ? of_trajectory(path) : of_project(path);
}

}  // namespace flyball::study
