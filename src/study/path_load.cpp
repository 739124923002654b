// A file of a planning tool as a motion.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

namespace fs = std::filesystem;

/// The job's limits stand in place of the file's.
void take_limits(RouteShape& shape, const PathJob& job) {
  RouteLimits& limits = shape.limits;
  const auto take = [](double& limit, const auto& said) { limit = said ? said->si() : limit; };
  take(limits.velocity, job.velocity);
  take(limits.acceleration, job.acceleration);
  take(limits.centripetal, job.centripetal);
  take(limits.angular_velocity, job.angular_velocity);
  take(limits.angular_acceleration, job.angular_acceleration);
  if (job.ramp) {
    limits.jerk = limits.acceleration / job.ramp->si();
  }
  take(shape.start_velocity, job.start_velocity);
  take(shape.end_velocity, job.end_velocity);
}

ExpectedAll<LoadedMotion> timed(RouteShape shape, MotionFormat format, const PathJob& job,
                                const std::optional<DriveRobot>& robot, double voltage,
                                std::vector<double>& mark_times) {
  take_limits(shape, job);
  const bool limited = std::isfinite(shape.limits.velocity) || robot.has_value();
  const bool accelerates = std::isfinite(shape.limits.acceleration) || robot.has_value();
  if (!limited || !accelerates) {
    return tl::unexpected(Errors(
        Error(ArgumentError::empty)
            .in(shape.source)
            .about(limited ? "an acceleration limit" : "a velocity limit")
            .got("left out")
            .expected("given, to make new times")
            .hint("--velocity \"3 m/s\" --acceleration \"3 m/s^2\", or a project file with the "
                  "robot's [drive]")));
  }
  if (job.ramp && std::isinf(shape.limits.acceleration)) {
    return tl::unexpected(Errors(Error(ArgumentError::empty)
                                     .in(shape.source)
                                     .about("an acceleration limit")
                                     .got("left out")
                                     .expected("given, for --ramp is the time to it from none")
                                     .hint("--acceleration \"3 m/s^2\"")));
  }
  FLYBALL_TRY(TimedRoute route, time_route(shape, robot, voltage));
  mark_times = std::move(route.mark_times);
  return LoadedMotion{format, true, std::move(route.trajectory), std::move(route.binding), {},
                      {},     {}};
}

/// A step of a routine.
struct RoutineStep {
  std::string path{};                    ///< Empty: a wait, or
  double wait = 0.0;                     ///< s
  std::optional<AutoCommand> command{};  ///< what is run.
};

bool has_path(const AutoCommand& command) {
  return command.type == "path" ||
         std::any_of(command.commands.begin(), command.commands.end(), has_path);
}

void collect(const AutoCommand& command, bool in_sequence, std::vector<RoutineStep>& steps) {
  if (command.type == "path") {
    steps.push_back({command.name, 0.0, {}});
    return;
  }
  if (command.type == "wait" && in_sequence) {
    steps.push_back({{}, std::max(0.0, command.wait.value), {}});
    return;
  }
  if (command.type == "wait") {
    return;
  }
  const bool one_by_one = command.type == "sequential";
  if (command.commands.empty() || (!one_by_one && !has_path(command))) {
    if (!command.type.empty() && (!command.commands.empty() || !command.name.empty())) {
      steps.push_back({{}, 0.0, command});
    }
    return;
  }
  if (!one_by_one) {  // what is beside a path begins with it, as a whole
    for (const AutoCommand& one : command.commands) {
      if (!has_path(one) && one.type != "wait") {
        steps.push_back({{}, 0.0, one});
      }
    }
  }
  for (const AutoCommand& one : command.commands) {
    if (one_by_one || has_path(one)) {
      collect(one, in_sequence && one_by_one, steps);
    }
  }
}

/// What a path of PathPlanner has happen; the marks are the places of its markers, then of their
/// ends.
void take_markers(LoadedMotion& motion, const PathPlannerPath& path,
                  const std::vector<double>& mark_times) {
  for (std::size_t i = 0; i < path.markers.size(); ++i) {
    const PathPlannerMarker& marker = path.markers[i];
    PathEvent event{marker.name, mark_times[2 * i], {}, marker.command};
    if (marker.end_position) {
      event.end = mark_times[2 * i + 1];
    }
    if (marker.names.empty()) {
      motion.events.push_back(event);
    }
    for (const std::string& name : marker.names) {
      event.name = name;
      event.command = AutoCommand{.type = "named", .name = name};
      motion.events.push_back(event);
    }
  }
}

/// Where a routine's path is: beside it, or in the folders that PathPlanner gives it.
Expected<std::string> find_path(const std::string& routine, const std::string& name, bool choreo) {
  const std::string ending = choreo ? ".traj" : ".path";
  const fs::path folder = fs::path(routine).parent_path();
  if (name.empty() || name.find('/') != std::string::npos || name.find('\\') != std::string::npos ||
      name.find('\0') != std::string::npos) {
    return refusal(ArgumentError::malformed, routine, "a path's name")
        .got(fmt::format("\"{}\"", cut(printable(name), 40)))
        .expected("a name without slashes");
  }
  for (const fs::path& place : {folder, folder / ".." / "paths", folder / ".." / ".." / "choreo"}) {
    std::error_code problem;
    const fs::path file = place / (name + ending);
    if (fs::is_regular_file(file, problem)) {
      return file.lexically_normal().string();
    }
  }
  // Copies are often named with something in front.
  std::vector<std::string> like;
  std::error_code problem;
  fs::directory_iterator entries(folder.empty() ? fs::path(".") : folder, problem);
  std::size_t looked_at = 0;
  for (const fs::directory_iterator end; !problem && entries != end && looked_at < 10'000;
       entries.increment(problem)) {
    ++looked_at;
    if (entries->path().filename().string().ends_with("_" + name + ending)) {
      like.push_back(entries->path().string());
    }
  }
  if (like.size() == 1) {
    return like.front();
  }
  return refusal(FileError::not_found, routine,
                 fmt::format("the path \"{}\"", cut(printable(name), 60)))
      .got("not there")
      .expected(fmt::format("beside the file, or in ../paths of a routine, as \"{}{}\"",
                            cut(printable(name), 60), ending));
}

}  // namespace

namespace {

/// The waypoints of one plan after those of another, whose last is the first of these.
void join(ChoreoPlan& plan, const ChoreoPlan& next, double begin) {
  std::vector<ChoreoWaypoint>& waypoints = plan.params.waypoints;
  const std::size_t shift = waypoints.size() - 1;
  const std::size_t count = next.params.waypoints.size();
  const auto index = [](const std::string& id, std::size_t first, std::size_t last) {
    return id == "first" ? std::to_string(first)
           : id == "last"
               ? std::to_string(last)
               : std::to_string(first +
                                static_cast<std::size_t>(std::max(0, std::atoi(id.c_str()))));
  };
  for (ChoreoConstraint& constraint : plan.params.constraints) {
    constraint.from = index(constraint.from, 0, shift);
    if (constraint.to) {
      constraint.to = index(*constraint.to, 0, shift);
    }
  }
  for (ChoreoConstraint constraint : next.params.constraints) {
    constraint.from = index(constraint.from, shift, shift + count - 1);
    if (constraint.to) {
      constraint.to = index(*constraint.to, shift, shift + count - 1);
    }
    plan.params.constraints.push_back(std::move(constraint));
  }
  waypoints.back().intervals = next.params.waypoints.front().intervals;
  waypoints.back().override_intervals = next.params.waypoints.front().override_intervals;
  waypoints.back().split = true;
  waypoints.insert(waypoints.end(), next.params.waypoints.begin() + 1, next.params.waypoints.end());
  for (std::size_t i = 1; i < next.times.size(); ++i) {
    plan.times.push_back(begin + next.times[i]);
  }
}

}  // namespace

Expected<void> append(LoadedMotion& motion, const LoadedMotion& next, double wait) {
  if (motion.trajectory.samples.empty()) {
    const std::vector<std::string> parts = motion.parts;
    const std::vector<PathEvent> events = std::move(motion.events);
    motion = next;
    motion.parts.insert(motion.parts.begin(), parts.begin(), parts.end());
    motion.events.insert(motion.events.begin(), events.begin(), events.end());
    return {};
  }
  constexpr double most = 0.1;      // m
  constexpr double turned = 0.175;  // rad
  constexpr double faster = 0.1;    // m/s
  RobotTrajectory& whole = motion.trajectory;
  const MotionSample end = whole.samples.back();
  const MotionSample& start = next.trajectory.samples.front();
  const double gap = (end.pose.translation() - start.pose.translation()).norm();
  if (!(gap <= most)) {
    return refusal(ArgumentError::out_of_range, "path",
                   fmt::format("the join of {} and {}", whole.source, next.trajectory.source))
        .got(fmt::format("{} m from the one's end to the other's start", format_number(gap, 4)))
        .expected("within 10 cm")
        .hint("give the files in the order in which they are driven")
        .with("gap", gap);
  }
  const double turn = std::remainder(start.pose.angle() - end.pose.angle(), 2.0 * std::numbers::pi);
  if (std::abs(turn) > turned) {
    warn(whole.diagnostics, "heading_jumps", "the heading jumps by {:.3g} rad where {} begins",
         turn, next.trajectory.source);
  }
  const double jump = (start.velocity - end.velocity).norm();
  if (jump > faster) {
    warn(whole.diagnostics, "velocity_jumps", "the velocity jumps by {:.3g} m/s where {} begins",
         jump, next.trajectory.source);
  }
  const double begin = end.time + wait;
  const bool again = wait > 0.0;
  constexpr double shift = 1e-3;  // s, in which it comes to rest and leaves it
  if (wait > 3.0 * shift) {
    for (const double t : {end.time + shift, begin - shift}) {
      MotionSample rest{.time = t, .pose = whole.samples.back().pose};
      whole.samples.push_back(rest);
    }
  }
  for (std::size_t i = again ? 0 : 1; i < next.trajectory.samples.size(); ++i) {
    MotionSample sample = next.trajectory.samples[i];
    sample.time += begin;
    whole.samples.push_back(sample);
  }
  for (PathBinding binding : next.binding) {
    binding.from += begin;
    binding.to += begin;
    motion.binding.push_back(binding);
  }
  for (PathEvent event : next.events) {
    event.time += begin;
    if (event.end) {
      *event.end += begin;
    }
    motion.events.push_back(std::move(event));
  }
  if (motion.plan && next.plan && wait == 0.0) {
    join(*motion.plan, *next.plan, begin);
  } else {
    motion.plan.reset();
  }
  whole.holonomic = whole.holonomic || next.trajectory.holonomic;
  whole.diagnostics.insert(whole.diagnostics.end(), next.trajectory.diagnostics.begin(),
                           next.trajectory.diagnostics.end());
  motion.timed = motion.timed || next.timed;
  motion.parts.insert(motion.parts.end(), next.parts.begin(), next.parts.end());
  return {};
}

ExpectedAll<LoadedMotion> load_motion(const std::string& file, const PathJob& job,
                                      const std::optional<DriveRobot>& robot, double voltage) {
  FLYBALL_TRY(const std::string text, read_file(file));
  FLYBALL_TRY(const MotionFormat format, motion_format(text, file));
  const bool sides = job.differential || (robot && robot->kind == DriveKind::differential);
  const bool anew = job.retime || job.velocity || job.acceleration || job.centripetal ||
                    job.angular_velocity || job.angular_acceleration || job.ramp;
  LoadedMotion motion{.format = format};
  std::vector<double> mark_times;
  if (format == MotionFormat::pathplanner_path) {
    FLYBALL_TRY(const PathPlannerPath path, parse_pathplanner_path(text, file));
    FLYBALL_TRY(RouteShape shape, shape_of(path, file, !sides));
    for (const PathPlannerMarker& marker : path.markers) {
      shape.marks.push_back(marker.position);
      shape.marks.push_back(marker.end_position.value_or(marker.position));
    }
    FLYBALL_TRY(motion, timed(std::move(shape), format, job, robot, voltage, mark_times));
    take_markers(motion, path, mark_times);
  } else if (format == MotionFormat::pathplanner_auto) {
    FLYBALL_TRY(const PathPlannerAuto routine, parse_pathplanner_auto(text, file));
    std::vector<RoutineStep> steps;
    collect(routine.command, true, steps);
    constexpr std::size_t most = 200;
    double wait = 0.0;
    for (const RoutineStep& step : steps) {
      if (step.command) {
        const bool named = !step.command->name.empty();
        const bool begun = !motion.trajectory.samples.empty();
        motion.events.push_back({named ? step.command->name : step.command->type,
                                 begun ? motion.trajectory.duration() + wait : 0.0,
                                 {},
                                 step.command});
        continue;
      }
      if (step.path.empty()) {
        wait += step.wait;
        continue;
      }
      if (motion.parts.size() >= most) {
        return tl::unexpected(Errors(Error(ArgumentError::out_of_range)
                                         .in(file)
                                         .about("the routine")
                                         .got("of more than 200 paths")
                                         .expected("fewer")));
      }
      FLYBALL_TRY(const std::string path, find_path(file, step.path, routine.choreo_auto));
      FLYBALL_TRY(const LoadedMotion next, load_motion(path, job, robot, voltage));
      const bool first = motion.trajectory.samples.empty();
      FLYBALL_CHECK(append(motion, next, first ? 0.0 : wait));
      wait = 0.0;
    }
    if (motion.trajectory.samples.empty()) {
      return tl::unexpected(Errors(Error(TrajectoryFileError::not_a_trajectory)
                                       .in(file)
                                       .about("the routine")
                                       .got("without a path")
                                       .expected("one path or more")));
    }
    for (PathEvent& event : motion.events) {  // what follows the last path
      event.time = std::min(event.time, motion.trajectory.duration());
    }
    motion.format = format;
    motion.plan.reset();
    motion.trajectory.diagnostics.insert(motion.trajectory.diagnostics.begin(),
                                         routine.diagnostics.begin(), routine.diagnostics.end());
    return motion;
  } else {
    bool made = false;
    if (format == MotionFormat::choreo_trajectory) {
      FLYBALL_TRY(const ChoreoTrajectory read, parse_choreo_trajectory(text, file));
      if (read.trajectory.samples.empty() && !read.is_2024) {
        FLYBALL_TRY(RouteShape shape, shape_of(read, file));
        for (std::size_t i = 0; i < read.params.waypoints.size(); ++i) {
          shape.marks.push_back(static_cast<double>(i));
        }
        FLYBALL_TRY(motion, timed(std::move(shape), format, job, robot, voltage, mark_times));
        ChoreoTrajectory reached = read;
        reached.trajectory.waypoints = mark_times;
        for (ChoreoEvent& event : reached.events) {
          event.target_timestamp = event.target ? std::nullopt : event.target_timestamp;
        }
        take_choreo(motion, reached);
        made = true;
      } else {
        take_choreo(motion, read);
      }
    } else if (format == MotionFormat::choreo_project) {
      FLYBALL_TRY(const ChoreoProject project, parse_choreo_project(text, file));
      if (!project.robot && !job.name.empty()) {  // its trajectories are files beside it
        FLYBALL_TRY(const std::string beside, find_path(file, job.name, true));
        return load_motion(beside, job, robot, voltage);
      }
      for (const ChoreoPath2024& path : project.paths) {
        if (path.name == job.name || (job.name.empty() && project.paths.size() == 1)) {
          take_choreo(motion, path);
        }
      }
    }
    if (!made) {
      const std::vector<Diagnostic> of_events = std::move(motion.trajectory.diagnostics);
      FLYBALL_TRY(motion.trajectory, read_motion(file, job.name));
      std::vector<Diagnostic>& noticed = motion.trajectory.diagnostics;
      noticed.insert(noticed.end(), of_events.begin(), of_events.end());
      if (anew) {
        FLYBALL_TRY(RouteShape shape, shape_of(motion.trajectory));
        FLYBALL_TRY(LoadedMotion again,
                    timed(std::move(shape), format, job, robot, voltage, mark_times));
        again.events = motion.events;
        again.plan = motion.plan;
        const auto anew_at = [&](double& time) {
          time = time_at_share(motion.trajectory, again.trajectory, time);
        };
        for (PathEvent& event : again.events) {
          anew_at(event.time);
        }
        if (again.plan) {
          std::for_each(again.plan->times.begin(), again.plan->times.end(), anew_at);
        }
        std::vector<Diagnostic>& all = again.trajectory.diagnostics;
        all.insert(all.begin(), noticed.begin(), noticed.end());
        motion = std::move(again);
      }
    }
  }
  motion.trajectory.source = file;
  motion.parts = {file};
  return motion;
}

}  // namespace flyball::study
