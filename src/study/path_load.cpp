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
                                const std::optional<DriveRobot>& robot, double voltage) {
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
  return LoadedMotion{format, true, std::move(route.trajectory), std::move(route.binding), {}};
}

/// A step of a routine.
struct RoutineStep {
  std::string path{};  ///< Empty: a wait.
  double wait = 0.0;   ///< s
};

void collect(const AutoCommand& command, bool in_sequence, std::vector<RoutineStep>& steps) {
  if (command.type == "path") {
    steps.push_back({command.name});
  } else if (command.type == "wait" && in_sequence) {
    steps.push_back({{}, std::max(0.0, command.wait.value)});
  }
  for (const AutoCommand& one : command.commands) {
    collect(one, in_sequence && command.type == "sequential", steps);
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
      .expected(fmt::format("beside the routine or in ../paths, as \"{}{}\"",
                            cut(printable(name), 60), ending));
}

}  // namespace

Expected<void> append(LoadedMotion& motion, const LoadedMotion& next, double wait) {
  if (motion.trajectory.samples.empty()) {
    const std::vector<std::string> parts = motion.parts;
    motion = next;
    motion.parts.insert(motion.parts.begin(), parts.begin(), parts.end());
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
  if (format == MotionFormat::pathplanner_path) {
    FLYBALL_TRY(const PathPlannerPath path, parse_pathplanner_path(text, file));
    FLYBALL_TRY(RouteShape shape, shape_of(path, file, !sides));
    FLYBALL_TRY(motion, timed(std::move(shape), format, job, robot, voltage));
  } else if (format == MotionFormat::pathplanner_auto) {
    FLYBALL_TRY(const PathPlannerAuto routine, parse_pathplanner_auto(text, file));
    std::vector<RoutineStep> steps;
    collect(routine.command, true, steps);
    constexpr std::size_t most = 200;
    double wait = 0.0;
    for (const RoutineStep& step : steps) {
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
    motion.format = format;
    motion.trajectory.diagnostics.insert(motion.trajectory.diagnostics.begin(),
                                         routine.diagnostics.begin(), routine.diagnostics.end());
    return motion;
  } else {
    bool made = false;
    if (format == MotionFormat::choreo_trajectory) {
      FLYBALL_TRY(const ChoreoTrajectory read, parse_choreo_trajectory(text, file));
      if (read.trajectory.samples.empty() && !read.is_2024) {
        FLYBALL_TRY(RouteShape shape, shape_of(read, file));
        FLYBALL_TRY(motion, timed(std::move(shape), format, job, robot, voltage));
        made = true;
      }
    }
    if (!made) {
      FLYBALL_TRY(motion.trajectory, read_motion(file, job.name));
      if (anew) {
        const std::vector<Diagnostic> noticed = motion.trajectory.diagnostics;
        FLYBALL_TRY(RouteShape shape, shape_of(motion.trajectory));
        FLYBALL_TRY(motion, timed(std::move(shape), format, job, robot, voltage));
        motion.trajectory.diagnostics.insert(motion.trajectory.diagnostics.begin(), noticed.begin(),
                                             noticed.end());
      }
    }
  }
  motion.trajectory.source = file;
  motion.parts = {file};
  return motion;
}

}  // namespace flyball::study
