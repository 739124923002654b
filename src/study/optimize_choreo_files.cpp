// What was found, as Choreo's files.
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "core/try.hpp"
#include "study/optimize_choreo.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

constexpr double free_fall = 9.80665;  // m/s²

/// As Choreo's settings have numbers: with what a person typed.
void express(ExpressedNumber& number, std::string_view unit) {
  if (number.expression.empty()) {
    number.expression =
        unit.empty() ? fmt::format("{}", number.value) : fmt::format("{} {}", number.value, unit);
  }
}

/// Calls f(number, unit) for each number of what a trajectory is generated from.
template <class F>
void each_number(ChoreoParameters& params, F&& f) {
  for (ChoreoWaypoint& w : params.waypoints) {
    f(w.x, "m");
    f(w.y, "m");
    f(w.heading, "rad");
  }
  for (ChoreoConstraint& c : params.constraints) {
    for (NamedNumber& prop : c.props) {
      const std::string_view most = c.type == "MaxAcceleration"      ? "m / s ^ 2"
                                    : c.type == "MaxAngularVelocity" ? "rad / s"
                                                                     : "m / s";
      f(prop.number, prop.name == "max"                                ? most
                     : prop.name == "tolerance" && c.type == "PointAt" ? "rad"
                                                                       : "m");
    }
  }
  f(params.target_dt, "s");
}
template <class F>
void each_number(ChoreoConfig& config, F&& f) {
  for (ChoreoPlace* place : {&config.front_left, &config.back_left}) {
    f(place->x, "m");
    f(place->y, "m");
  }
  f(config.mass, "kg");
  f(config.inertia, "kg m ^ 2");
  f(config.gearing, "");
  f(config.radius, "m");
  f(config.vmax, "rad / s");
  f(config.tmax, "N * m");
  if (config.cof) {
    f(*config.cof, "");
  }
  for (ExpressedNumber* side : {&config.bumper.front, &config.bumper.side, &config.bumper.back}) {
    f(*side, "m");
  }
  if (config.differential_track_width) {
    f(*config.differential_track_width, "m");
  }
}

/// What a trajectory was generated from has bare numbers.
template <class T>
T bare(T of) {
  each_number(of, [](ExpressedNumber& number, std::string_view) { number.expression.clear(); });
  return of;
}

/// "first", "last" or a number.
std::string waypoint_name(const DriveProblem& problem, int waypoint) {
  const int last = static_cast<int>(problem.waypoints.size()) - 1;
  return waypoint == 0                        ? "first"
         : waypoint == -1 || waypoint == last ? "last"
                                              : fmt::to_string(waypoint);
}

/// What holds on the way, without the polygons, which Choreo does not have.
void write_constraints(const DriveProblem& problem, ChoreoParameters& params) {
  for (std::size_t i = 0; i < problem.waypoints.size(); ++i) {
    if (problem.waypoints[i].stop) {
      ChoreoConstraint rest;
      rest.type = "StopPoint";
      rest.from = waypoint_name(problem, static_cast<int>(i));
      params.constraints.push_back(std::move(rest));
    }
  }
  for (const DriveConstraint& c : problem.constraints) {
    const auto* const row = std::find_if(choreo_kinds.begin(), choreo_kinds.end(),
                                         [&](const ChoreoKind& k) { return k.kind == c.kind; });
    if (row == choreo_kinds.end()) {
      continue;
    }
    ChoreoConstraint constraint;
    constraint.type = row->name;
    constraint.from = waypoint_name(problem, c.from);
    if (c.to) {
      constraint.to = waypoint_name(problem, *c.to);
    }
    const auto add = [&](const char* key, double value) {
      constraint.props.push_back({key, {value}});
    };
    switch (c.kind) {
      case DriveConstraintKind::max_velocity:
      case DriveConstraintKind::max_acceleration:
      case DriveConstraintKind::max_angular_velocity:
        add("max", c.limit);
        break;
      case DriveConstraintKind::point_at:
        add("x", c.x);
        add("y", c.y);
        add("tolerance", c.tolerance);
        constraint.flip = c.flip;
        break;
      case DriveConstraintKind::keep_in_rectangle:
        add("x", c.x);
        add("y", c.y);
        add("w", c.width);
        add("h", c.height);
        break;
      case DriveConstraintKind::keep_in_circle:
      case DriveConstraintKind::keep_out_circle:
        add("x", c.x);
        add("y", c.y);
        add("r", c.radius);
        break;
      case DriveConstraintKind::keep_in_lane:
        add("tolerance", c.tolerance);
        break;
      default:
        break;
    }
    params.constraints.push_back(std::move(constraint));
  }
}

/// N, of each module in the field; a mecanum wheel pushes along its roller's axis.
std::array<Vector2d, 4> forces_of(const DriveModel& model, const DriveSample& sample) {
  std::array<Vector2d, 4> forces = sample.forces;
  if (model.drivetrain == Drivetrain::mecanum) {
    const Eigen::Rotation2Dd turn(sample.heading);
    for (std::size_t i = 0; i < 4; ++i) {
      const double across = i == 0 || i == 3 ? -1.0 : 1.0;
      forces[i] = turn * (sample.forces[i](0) * Vector2d(1.0, across));
    }
  }
  return forces;
}

/// Time, pose and the rate of turning; the rest depends on the drive.
ChoreoSample pose_sample(const DriveSample& from) {
  ChoreoSample sample;
  sample.time = from.time;
  sample.x = from.x;
  sample.y = from.y;
  sample.heading = from.heading;
  sample.omega = from.omega;
  return sample;
}

/// Events' times count from a waypoint's.
void time_events(std::vector<ChoreoEvent>& events, const DriveSolution& solution) {
  for (ChoreoEvent& event : events) {
    if (event.target && *event.target >= 0 &&
        *event.target < static_cast<int>(solution.waypoint_times.size())) {
      event.target_timestamp = solution.waypoint_times[static_cast<std::size_t>(*event.target)];
    }
  }
}

/// A project as Choreo makes it, without trajectories.
constexpr std::string_view new_project = R"({
 "name":"",
 "version":2,
 "type":"Swerve",
 "variables":{
  "expressions":{},
  "poses":{}
 },
 "config":{
  "frontLeft":{"x":0.0,"y":0.0},
  "backLeft":{"x":0.0,"y":0.0},
  "mass":0.0,
  "inertia":0.0,
  "gearing":1.0,
  "radius":0.0,
  "vmax":0.0,
  "tmax":0.0,
  "cof":0.0,
  "bumper":{"front":0.0,"side":0.0,"back":0.0},
  "differentialTrackWidth":0.0
 },
 "generationFeatures":[],
 "codegen":{
  "root":".",
  "genVars":true,
  "genTrajData":true,
  "useChoreoLib":true
 }
}
)";

}  // namespace

ChoreoConfig config_of(const DriveModel& model, double gearing, double radius) {
  ChoreoConfig config;
  config.front_left = {.x = {model.wheels[0](0)}, .y = {model.wheels[0](1)}};
  config.back_left = {.x = {model.wheels[2](0)}, .y = {model.wheels[2](1)}};
  config.mass.value = model.mass;
  config.inertia.value = model.moment_of_inertia;
  config.gearing.value = gearing;
  config.radius.value = radius;
  config.vmax.value = model.max_speed * gearing / radius;
  config.tmax.value = model.max_force * radius / gearing;
  if (model.friction > 0.0) {
    config.cof = ExpressedNumber{model.friction * model.wheel_count() / (model.mass * free_fall)};
  }
  double front = 0.0, side = 0.0, back = 0.0;
  for (const Vector2d& corner : model.corners) {
    front = std::max(front, corner(0));
    back = std::max(back, -corner(0));
    side = std::max(side, std::abs(corner(1)));
  }
  config.bumper = {.front = {front}, .side = {side}, .back = {back}};
  if (model.trackwidth > 0.0) {
    config.differential_track_width = ExpressedNumber{model.trackwidth};
  }
  return config;
}

ChoreoTrajectory choreo_of(const OptimizeTask& task, const DriveSolution& solution) {
  const DriveProblem& problem = task.problem;
  const bool sides = problem.model.drivetrain == Drivetrain::differential;
  ChoreoTrajectory file;
  if (task.file) {
    file = *task.file;
  } else {
    file.name = task.name;
    for (const DriveWaypoint& w : problem.waypoints) {
      ChoreoWaypoint waypoint;
      waypoint.x.value = w.x;
      waypoint.y.value = w.y;
      waypoint.heading.value = w.heading;
      waypoint.fix_translation = w.fix_translation;
      waypoint.fix_heading = w.fix_heading;
      file.params.waypoints.push_back(std::move(waypoint));
    }
    write_constraints(problem, file.params);
    file.params.target_dt.value = problem.target_interval;
  }
  for (std::size_t i = 0; i < file.params.waypoints.size(); ++i) {
    ChoreoWaypoint& w = file.params.waypoints[i];
    const std::size_t next = i + 1;
    w.intervals = next < solution.waypoint_samples.size()
                      ? solution.waypoint_samples[next] - solution.waypoint_samples[i]
                  : w.intervals > 0 ? w.intervals
                                    : 40;
  }
  each_number(file.params, express);
  file.snapshot = bare(file.params);
  file.version = fmt::to_string(ChoreoTrajectory::newest);
  ChoreoGenerated& generated = file.trajectory;
  generated.config = bare(task.config);
  generated.sample_type = sides ? "Differential" : "Swerve";
  generated.waypoints = solution.waypoint_times;
  generated.samples.clear();
  generated.splits = {0};
  for (std::size_t i = 1; i + 1 < file.params.waypoints.size(); ++i) {
    if (file.params.waypoints[i].split) {
      generated.splits.push_back(solution.waypoint_samples[i]);
    }
  }
  time_events(file.events, solution);
  for (const DriveSample& s : solution.samples) {
    ChoreoSample sample = pose_sample(s);
    sample.alpha = s.alpha;
    if (sides) {
      sample.vl = s.left;
      sample.vr = s.right;
      const double forward = s.ax * std::cos(s.heading) + s.ay * std::sin(s.heading);
      sample.al = forward - 0.5 * problem.model.trackwidth * s.alpha;
      sample.ar = forward + 0.5 * problem.model.trackwidth * s.alpha;
      sample.fl = s.forces[0](0);
      sample.fr = s.forces[1](0);
    } else {
      sample.vx = s.vx;
      sample.vy = s.vy;
      sample.ax = s.ax;
      sample.ay = s.ay;
      std::array<double, 4> fx{}, fy{};
      const std::array<Vector2d, 4> forces = forces_of(problem.model, s);
      for (std::size_t i = 0; i < 4; ++i) {
        fx[i] = forces[i](0);
        fy[i] = forces[i](1);
      }
      sample.fx = fx;
      sample.fy = fy;
    }
    generated.samples.push_back(std::move(sample));
  }
  return file;
}

Expected<ChoreoProject> choreo_project_of(const OptimizeResult& result) {
  if (!result.job.project) {
    const OptimizeTask& task = result.job.tasks.front();
    auto made = parse_choreo_project(new_project, "a new project");
    if (!made) {
      return tl::unexpected(Error(made.error()));
    }
    made->name = task.name;
    made->type =
        task.problem.model.drivetrain == Drivetrain::differential ? "Differential" : "Swerve";
    made->config = task.config;
    each_number(*made->config, express);
    return *std::move(made);
  }
  ChoreoProject project = *result.job.project;
  // Of 2024 the trajectories stand in the project.
  for (std::size_t i = 0; i < project.paths.size() && i < result.solutions.size(); ++i) {
    const DriveSolution& solution = result.solutions[i];
    ChoreoPath2024& path = project.paths[i];
    if (!solution.solved) {
      continue;
    }
    path.trajectory.clear();
    for (const DriveSample& s : solution.samples) {
      ChoreoSample sample = pose_sample(s);
      sample.vx = s.vx;
      sample.vy = s.vy;
      path.trajectory.push_back(std::move(sample));
    }
    path.trajectory_waypoints.clear();
    for (std::size_t k = 0; k < path.waypoints.size(); ++k) {
      ChoreoWaypoint waypoint = path.waypoints[k];
      const auto& at = solution.samples[static_cast<std::size_t>(solution.waypoint_samples[k])];
      waypoint.time = solution.waypoint_times[k];
      waypoint.is_stop_point = std::hypot(at.vx, at.vy) + std::abs(at.omega) < 1e-6;
      waypoint.x.value = at.x;
      waypoint.y.value = at.y;
      waypoint.heading.value = at.heading;
      path.trajectory_waypoints.push_back(std::move(waypoint));
    }
    time_events(path.events, solution);
  }
  return project;
}

}  // namespace flyball::study
