// Routines of PathPlanner and projects of Choreo as what is written.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/file.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

tl::unexpected<Errors> cannot(const PathJob& job, std::string got, std::string expected) {
  return tl::unexpected(Errors(Error(ArgumentError::out_of_range)
                                   .in("--to")
                                   .about(fmt::format("\"{}\"", cut(printable(job.to), 40)))
                                   .got(std::move(got))
                                   .expected(std::move(expected))));
}

ExpressedNumber said(double value, std::string_view unit) {
  return {value, fmt::format("{}{}{}", value, unit.empty() ? "" : " ", unit), {}};
}

/// The robot of a [drive] as Choreo has it: a motor a module or side, its torque under its current
/// limit, its speed without load.
ChoreoConfig config_of(const DriveRobot& robot, double voltage) {
  ChoreoConfig config;
  const bool differential = robot.kind == DriveKind::differential;
  const double half = 0.5 * robot.trackwidth;
  const double base = 0.5 * (robot.wheelbase > 0.0 ? robot.wheelbase : robot.trackwidth);
  const auto place = [&](std::size_t module, double sign) {
    return differential
               ? ChoreoPlace{said(sign * base, "m"), said(half, "m"), {}}
               : ChoreoPlace{
                     said(robot.modules[module](0), "m"), said(robot.modules[module](1), "m"), {}};
  };
  config.front_left = place(0, 1.0);
  config.back_left = place(2, -1.0);
  config.mass = said(robot.mass, "kg");
  config.inertia = said(robot.moment_of_inertia, "kg m^2");
  config.gearing = said(robot.gearing, "");
  config.radius = said(robot.wheel_radius, "m");
  config.vmax = said(robot.free_speed(voltage) * robot.gearing / robot.wheel_radius, "rad/s");
  const double stall = voltage / robot.motor.R;
  const double current = robot.stator_limit > 0.0 ? std::min(stall, robot.stator_limit) : stall;
  config.tmax = said(robot.motor.Kt * current, "N*m");
  config.cof = said(robot.grip, "");
  config.bumper = {said(0.5 * robot.length, "m"),
                   said(0.5 * robot.width, "m"),
                   said(0.5 * robot.length, "m"),
                   {}};
  config.differential_track_width = said(differential ? robot.trackwidth : 2.0 * half, "m");
  return config;
}

}  // namespace

ExpectedAll<std::string> written_routine(const PathJob& job) {
  const bool changes = !FieldChange::of(job).none() || job.reverse;
  const auto ends_with = [](std::string_view ending) {
    return [ending](const std::string& file) { return file.ends_with(ending); };
  };
  if (changes) {
    return cannot(job, "asked of a routine with its field turned or from its end",
                  "without: a routine names its paths, which are files of their own to be turned");
  }
  if (job.files.size() == 1) {
    FLYBALL_TRY(const PathPlannerAuto routine, read_pathplanner_auto(job.files.front()));
    return to_pathplanner(routine);
  }
  const bool choreo = std::all_of(job.files.begin(), job.files.end(), ends_with(".traj"));
  if (!choreo && !std::all_of(job.files.begin(), job.files.end(), ends_with(".path"))) {
    return cannot(job, "asked of files of several tools",
                  "a .path, an .auto, or the .path or .traj files of a routine, in their order");
  }
  PathPlannerAuto routine{.version = "2025.0"};
  routine.command.type = "sequential";
  for (const std::string& file : job.files) {
    routine.command.commands.push_back(
        {.type = "path", .name = std::filesystem::path(file).stem().string()});
  }
  routine.reset_odometry = true;
  routine.choreo_auto = choreo;
  return to_pathplanner(routine);
}

ExpectedAll<std::string> written_project(const PathJob& job) {
  if (job.files.size() == 1 && job.files.front().ends_with(".chor")) {
    FLYBALL_TRY(ChoreoProject project, read_choreo_project(job.files.front()));
    const FieldChange change = FieldChange::of(job);
    if (job.reverse) {
      return cannot(job, "asked of a project from its end",
                    "without --reverse, or of a path of it");
    }
    if (!change.none()) {  // of newer ones the paths are files of their own
      for (ChoreoPath2024& path : project.paths) {
        path = changed(std::move(path), change);
      }
    }
    return to_choreo(project);
  }
  if (!job.files.empty() || job.project.empty()) {
    return cannot(job, "asked of what is no project",
                  "a .chor, or a project file with [drive] alone");
  }
  FLYBALL_TRY(const DriveJob drive, drive_design_job(job.project));
  if (drive.robot.kind == DriveKind::mecanum) {
    return cannot(job, "asked of a mecanum drive", "swerve or differential, which Choreo has");
  }
  ChoreoProject project;
  project.name = std::filesystem::path(job.project).stem().string();
  project.version = std::to_string(ChoreoProject::newest);
  project.type = drive.robot.kind == DriveKind::differential ? "Differential" : "Swerve";
  project.config = config_of(drive.robot, drive.max_voltage);
  return to_choreo(project);
}

}  // namespace flyball::study
