#include <flyball/study/path.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/export/motion_table.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/motion/wpilib_trajectory.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

double length_of(const RobotTrajectory& trajectory) {
  double length = 0.0;
  for (std::size_t i = 1; i < trajectory.samples.size(); ++i) {
    length +=
        (trajectory.samples[i].pose.translation() - trajectory.samples[i - 1].pose.translation())
            .norm();
  }
  return length;
}

/// The fastest wheel at each sample, m/s.
std::vector<double> wheels_of(const RobotTrajectory& trajectory, const DriveRobot& robot) {
  std::vector<double> fastest;
  for (const MotionSample& sample : trajectory.samples) {
    if (robot.kind == DriveKind::differential) {
      fastest.push_back(std::abs(sample.forward()) +
                        0.5 * robot.trackwidth * std::abs(sample.omega));
      continue;
    }
    const Vector2d v = sample.pose.rotation().inverse() * sample.velocity;
    double most = 0.0;
    for (const Vector2d& module : robot.modules) {
      const Vector2d w = v + sample.omega * Vector2d(-module(1), module(0));
      most = std::max(
          most, robot.kind == DriveKind::mecanum ? std::abs(w(0)) + std::abs(w(1)) : w.norm());
    }
    fastest.push_back(most);
  }
  return fastest;
}

/// The name of a trajectory, of its file's.
std::string stem(const std::string& file) {
  return std::filesystem::path(file).stem().stem().string();
}

tl::unexpected<Errors> cannot_write(const PathJob& job, std::string got, std::string expected) {
  return tl::unexpected(Errors(Error(ArgumentError::out_of_range)
                                   .in("--to")
                                   .about(fmt::format("\"{}\"", cut(printable(job.to), 40)))
                                   .got(std::move(got))
                                   .expected(std::move(expected))));
}

bool is_differential(const PathResult& result) {
  return result.robot ? result.robot->kind == DriveKind::differential : result.job.differential;
}

/// What a format has no place for is told, not passed over.
void tell_left_out(PathResult& result, std::string_view what) {
  if (!result.events.empty()) {
    std::string names;
    for (const PathEvent& event : result.events) {
      names += (names.empty() ? "" : ", ") + cut(printable(event.name), 30);
    }
    const std::size_t count = result.events.size();
    warn(result.diagnostics, "events_left_out", "{} holds no events: {} ({}) {} left out", what,
         count == 1 ? "one" : std::to_string(count), cut(names, 100), count == 1 ? "is" : "are");
  }
  if (result.plan && !result.plan->params.constraints.empty()) {
    const std::size_t count = result.plan->params.constraints.size();
    warn(result.diagnostics, "constraints_left_out",
         "{} holds no constraints: {} of the trajectory {} left out; its samples keep to them",
         what, count == 1 ? "one" : std::to_string(count), count == 1 ? "is" : "are");
  }
}

/// Of what was read, without folder and ending.
std::string job_name(const PathJob& job) {
  return stem(job.files.empty() ? job.project : job.files.front());
}

/// What `to` asks for.
ExpectedAll<std::string> written(PathResult& result) {
  const PathJob& job = result.job;
  const FieldChange change = FieldChange::of(job);
  const bool one = job.files.size() == 1;
  if (job.to == "pathplanner" && (!one || result.format == MotionFormat::pathplanner_auto)) {
    return written_routine(job);
  }
  if (job.to == "pathplanner") {
    if (!one || result.format != MotionFormat::pathplanner_path) {
      return cannot_write(job, "asked of what is no single .path file",
                          "a .path or .auto, or several of one kind as a routine; else choreo, "
                          "wpilib, csv or c++");
    }
    FLYBALL_TRY(const PathPlannerPath path, read_pathplanner_path(job.files.front()));
    std::size_t linked = 0;
    for (const PathPlannerWaypoint& waypoint : path.waypoints) {
      linked += !change.none() && waypoint.linked_name.has_value() ? 1 : 0;
    }
    if (linked > 0) {
      warn(result.diagnostics, "links_left_out",
           "{} of the waypoints {} linked to those of other paths, which are elsewhere now: the {} "
           "left out (linkedName null)",
           linked, linked == 1 ? "is" : "are", linked == 1 ? "link is" : "links are");
    }
    return to_pathplanner(changed(path, change, job.reverse));
  }
  if (job.to == "choreo") {
    if (one && result.format == MotionFormat::choreo_trajectory && !result.timed) {
      FLYBALL_TRY(ChoreoTrajectory file, read_choreo_trajectory(result.parts.front()));
      if (job.reverse) {
        file = reversed(std::move(file));
      }
      return to_choreo(change.none() ? file : changed(file, change));
    }
    if (is_differential(result) && result.trajectory.holonomic) {
      return cannot_write(job, "of a robot that moves sideways", "one that looks where it goes");
    }
    return to_choreo(choreo_trajectory(result, job_name(job), result.diagnostics));
  }
  if (job.to == "wpilib") {
    tell_left_out(result, "WPILib's trajectory");
    if (one && result.format == MotionFormat::wpilib_trajectory && !result.timed) {
      FLYBALL_TRY(const std::string text, read_file(job.files.front()));
      FLYBALL_TRY(WpilibTrajectory file, parse_wpilib_trajectory(text, job.files.front()));
      if (job.reverse) {
        file = reversed(std::move(file));
      }
      return to_wpilib(change.none() ? file : changed(file, change));
    }
    return to_wpilib(to_wpilib_trajectory(result.trajectory));
  }
  tell_left_out(result, job.to == "csv" ? "A table" : "The table of a header");
  FLYBALL_TRY(const TimeSeries table, to_table(result.trajectory));
  if (job.to == "csv") {
    return to_csv(table);
  }
  return exports::motion_table(table, "path", "A trajectory of " + job_name(job),
                               exports::motion_rates);
}

Expected<void> check_job(const PathJob& job) {
  for (const auto& [value, name] :
       {std::pair(job.field_length.si(), "field_length"), {job.field_width.si(), "field_width"}}) {
    FLYBALL_CHECK(Checks("path").positive(value, name, "m"));
  }
  if (job.files.size() > 200) {
    return refusal(ArgumentError::out_of_range, "path", "the command line")
        .got(fmt::format("of {} files", job.files.size()))
        .expected("at most 200");
  }
  return {};
}

}  // namespace

ExpectedAll<PathResult> plan_path(const PathJob& job) {
  FLYBALL_CHECK(check_job(job));
  PathResult result{.job = job};
  if (job.to == "choreo-project") {
    FLYBALL_TRY(result.written, written_project(job));
    return result;
  }
  double voltage = 12.0;
  bool names_count = false;  // whether a file has several paths
  LoadedMotion motion;
  if (!job.project.empty()) {
    if (job.files.empty()) {
      if (job.retime || job.velocity || job.acceleration || job.centripetal ||
          job.angular_velocity || job.angular_acceleration || job.ramp) {
        return tl::unexpected(Errors(
            Error(ArgumentError::malformed)
                .in("path")
                .about("the trajectory of " + job.project)
                .got("asked for other times")
                .expected("as its [drive] has them: the limits of a command line are of files")
                .hint("change max_velocity and max_acceleration in [drive]")));
      }
      FLYBALL_TRY(const DriveJob drive, drive_job(job.project));
      result.robot = drive.robot;
      voltage = drive.max_voltage;
      motion.trajectory = drive.trajectory;
      motion.format = MotionFormat::wpilib_trajectory;
      motion.parts = {job.project};
    } else {
      FLYBALL_TRY(const DriveJob drive, drive_design_job(job.project));
      result.robot = drive.robot;
      voltage = drive.max_voltage;
      result.diagnostics = drive.diagnostics;
    }
  }
  for (std::size_t i = 0; i < job.files.size(); ++i) {
    PathJob one = job;
    // Only the ends of the whole have the velocities that are asked for.
    if (i > 0) {
      one.start_velocity.reset();
    }
    if (i + 1 < job.files.size()) {
      one.end_velocity.reset();
    }
    FLYBALL_TRY(const LoadedMotion next, load_motion(job.files[i], one, result.robot, voltage));
    names_count = names_count || next.format == MotionFormat::choreo_project ||
                  next.parts.front() != job.files[i];
    const MotionFormat format = i == 0 ? next.format : motion.format;
    FLYBALL_CHECK(append(motion, next, 0.0));
    motion.format = format;
  }
  if (!job.name.empty() && !names_count) {
    return tl::unexpected(Errors(Error(ArgumentError::malformed)
                                     .in("path")
                                     .about("--name")
                                     .got("given with files of one path each")
                                     .expected("left out: it says which path of a .chor of 2024")));
  }
  result.format = motion.format;
  result.timed = motion.timed;
  result.binding = std::move(motion.binding);
  result.parts = std::move(motion.parts);
  result.trajectory = std::move(motion.trajectory);
  result.events = std::move(motion.events);
  result.plan = std::move(motion.plan);
  if (job.reverse) {
    const double end = result.trajectory.duration();
    result.trajectory = reversed(result.trajectory);
    std::reverse(result.binding.begin(), result.binding.end());
    for (PathBinding& binding : result.binding) {
      binding.from = end - std::exchange(binding.to, end - binding.from);
    }
    for (PathEvent& event : result.events) {
      event.time = end - event.time;
      if (event.end) {
        event.time = end - std::exchange(*event.end, event.time);
      }
    }
    if (result.plan) {
      result.plan->params = reversed(std::move(result.plan->params));
      std::reverse(result.plan->times.begin(), result.plan->times.end());
      for (double& time : result.plan->times) {
        time = end - time;
      }
    }
  }
  std::stable_sort(result.events.begin(), result.events.end(),
                   [](const PathEvent& a, const PathEvent& b) { return a.time < b.time; });
  if (const FieldChange change = FieldChange::of(job); !change.none()) {
    result.trajectory = changed(std::move(result.trajectory), change);
    if (result.plan && !result.plan->params.waypoints.empty()) {
      const double first = result.plan->params.waypoints.front().heading.value;
      result.plan->params = changed(std::move(result.plan->params), change.facing(first));
    }
  }
  result.diagnostics.insert(result.diagnostics.end(), result.trajectory.diagnostics.begin(),
                            result.trajectory.diagnostics.end());
  result.length = length_of(result.trajectory);
  if (result.robot) {
    result.fastest_wheel = wheels_of(result.trajectory, *result.robot);
    result.wheel_limit = result.robot->free_speed(voltage);
    const double most = *std::max_element(result.fastest_wheel.begin(), result.fastest_wheel.end());
    if (most > result.wheel_limit * (1.0 + 1e-6)) {
      warn(result.diagnostics, "wheels_too_slow",
           "a wheel would have to go {:.3g} m/s; without load this robot's reach {:.3g} m/s", most,
           result.wheel_limit);
    }
    if (result.robot->kind == DriveKind::differential && result.trajectory.holonomic) {
      warn(result.diagnostics, "moves_sideways",
           "the trajectory moves sideways, which a differential drive does not");
    }
  }
  if (!job.to.empty()) {
    FLYBALL_TRY(result.written, written(result));
  }
  return result;
}

}  // namespace flyball::study
