// What a project file says of a mechanism that is to be sized.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/mechanisms/gravity.hpp>
#include <flyball/study/motor_curves.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/size.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/mechanism_parts.hpp"

namespace flyball::study {

namespace {

using mechanisms::GearedLoad;
using mechanisms::MechanismKind;

Error wrong_size(const Project& project, std::string_view key, std::string got) {
  return Error(ProjectError::wrong_value)
      .in(project.path)
      .about(fmt::format("size.{}", key))
      .got(std::move(got));
}

/// The parts without which there is no load; the gearing is what is looked for.
ExpectedAll<void> check_parts(const Project& project) {
  const MechanismParts& parts = project.parts;
  if (!parts.type) {
    return tl::unexpected(Errors(Error(ProjectError::missing_key)
                                     .in(project.path)
                                     .about("mechanism.type")
                                     .got("missing")
                                     .hint("say what is to be sized: type = \"elevator\"")));
  }
  const auto is_there = [&](std::string_view key) {
    return key == "gearing"             ? true
           : key == "motor"             ? !parts.motor.empty() || parts.custom_motor.has_value()
           : key == "mass"              ? parts.mass.has_value()
           : key == "drum_radius"       ? parts.drum_radius.has_value()
           : key == "wheel_radius"      ? parts.wheel_radius.has_value()
           : key == "moment_of_inertia" ? parts.moment_of_inertia.has_value()
           : key == "center_of_mass"    ? parts.center_of_mass.has_value()
                                        : true;
  };
  std::vector<QuotedError> missing;
  for (const std::string_view key : mechanism_row(*parts.type).needs) {
    if (!is_there(key)) {
      missing.push_back({Error(ProjectError::missing_key)
                             .in(project.path)
                             .about(fmt::format("mechanism.{}", key))
                             .got("missing")
                             .hint("a mechanism is sized by its parts, gains do not tell them"),
                         {},
                         {}});
    }
  }
  if (!missing.empty()) {
    return tl::unexpected(Errors(std::move(missing)));
  }
  return {};
}

GearedLoad load_of(const Project& project) {
  const MechanismParts& parts = project.parts;
  const SizeSection& said = project.size;
  const PlantDescription& plant = project.job.plant;
  GearedLoad load{.kind = *parts.type, .motor = *plant.motor};
  load.gearing = parts.gearing.value_or(1.0);
  switch (*parts.type) {
    case MechanismKind::elevator:
      if (const auto lift = elevator_lift(parts)) {  // else the file would not have been read
        load.radius = lift->rise;
        load.inertia = lift->inertia;
        load.gravity = lift->weight;
      }
      break;
    case MechanismKind::swerve_drive:
      load.radius = parts.wheel_radius->si();
      load.inertia = parts.mass->si();
      break;
    case MechanismKind::arm:
      load.inertia = parts.moment_of_inertia->si();
      load.gravity = parts.mass->si() * mechanisms::standard_gravity * parts.center_of_mass->si();
      load.angle_offset = project.gains.angle_offset.value_or(Angle(0.0)).si();
      break;
    default:
      load.inertia = parts.moment_of_inertia->si();
  }
  load.rotor_inertia = load.motor.count * said.rotor_inertia.si();
  load.efficiency = said.efficiency;
  load.motor_friction = load.motor.Kt * load.motor.free_current;
  load.friction = said.friction.value_or(0.0);
  if (!said.friction && project.gains.kS && parts.gearing) {
    // kS is all friction there is, as a voltage at the motors of the gearing that is given.
    const double all = load.motor.Kt * *project.gains.kS / load.motor.R;
    load.friction = std::max(0.0, all - load.motor_friction) * load.ratio();
  }
  if (said.grip) {
    load.grip = *said.grip * load.inertia * mechanisms::standard_gravity;
  }
  return load;
}

/// From where to where, or which speed.
void take_motion(const Project& project, TravelJob& travel, std::vector<Diagnostic>& diagnostics) {
  const SizeSection& said = project.size;
  const MechanismKind kind = *project.parts.type;
  const std::string unit(mechanisms::position_unit(kind));
  if (said.distance) {
    travel.end = said.distance->si();
    travel.stops = said.stop.value_or(false);
    return;
  }
  travel.speed = controls_velocity(kind);
  travel.start = said.start.value_or(0.0);
  if (said.end) {
    travel.end = *said.end;
    return;
  }
  if (travel.speed && kind == MechanismKind::swerve_drive) {
    travel.speed = false;
    travel.stops = false;
    travel.end = 5.0;
    note(diagnostics, "assumed", "no size.distance: a sprint of 5 m from rest is looked at");
  } else if (travel.speed) {
    const mechanisms::DcMotor& motor = travel.load.motor;
    travel.end = project.job.profile.goal.value_or(0.75 * motor.free_speed /
                                                   project.parts.gearing.value_or(1.0));
    note(diagnostics, "assumed", "no size.end: the speed to be reached is taken to be {:.4g} {}/s",
         travel.end, unit);
  } else {
    travel.end = travel.start +
                 project.job.profile.goal.value_or(unit == "m" ? 1.0 : 0.5 * std::numbers::pi);
    note(diagnostics, "assumed", "no size.end: a motion from {:.4g} to {:.4g} {} is looked at",
         travel.start, travel.end, unit);
  }
}

std::string beside_project(const std::string& project, const std::string& file) {
  const std::size_t slash = project.find_last_of('/');
  return file.starts_with('/') || slash == std::string::npos ? file
                                                             : project.substr(0, slash + 1) + file;
}

Expected<Winding> winding_of(const Project& project, std::vector<Diagnostic>& diagnostics) {
  const SizeSection& said = project.size;
  Winding winding{.ambient = said.ambient_temperature};
  winding.thermal_resistance = said.winding_thermal_resistance.value_or(winding.thermal_resistance);
  winding.heat_capacity = said.winding_heat_capacity.value_or(winding.heat_capacity);
  if (said.locked_rotor.empty()) {
    return winding;
  }
  MotorCurvesJob curves{.paths = {beside_project(project.path, said.locked_rotor)}};
  FLYBALL_TRY(const auto found, fit_motor_curves(curves));
  const MotorCurveFile& file = found.files.front();
  if (!file.locked || !file.locked->heat_capacity.determined) {
    return tl::unexpected(
        wrong_size(
            project, "locked_rotor",
            file.locked
                ? fmt::format("a run in which the resistance does not rise beyond its scatter "
                              "({} over {})",
                              text::percent(file.locked->R_rise, 2),
                              text::count(static_cast<std::size_t>(file.locked->rows), "row"))
                : "a motor curve, in which the motor turns")
            .expected("a locked rotor whose windings warm")
            .hint("say winding_heat_capacity in place of it, in J/K"));
  }
  winding.heat_capacity = file.locked->heat_capacity.value;
  note(diagnostics, "heat_capacity",
       "the windings' heat capacity is {:.3g} J/K (95 % from {:.3g} to {:.3g}), by {}",
       winding.heat_capacity, file.locked->heat_capacity.interval[0],
       file.locked->heat_capacity.interval[1], said.locked_rotor);
  return winding;
}

}  // namespace

ExpectedAll<SizeJob> size_job(const std::string& path, std::span<const Override> overrides) {
  // A file beside a log may lack parts: here the gearing.
  FLYBALL_TRY(const auto project, read_project_beside_log(path, overrides));
  if (project.model_job || !project.drive.type.empty()) {
    return tl::unexpected(*project.plant_error);
  }
  FLYBALL_CHECK(check_parts(project));
  const SizeSection& said = project.size;
  SizeJob job{.path = path,
              .gearing = project.parts.gearing,
              .brownout_voltage = said.brownout_voltage.si(),
              .temperature_limit = said.temperature_limit,
              .gearing_low = said.gearing_low,
              .gearing_high = said.gearing_high,
              .compare_motors = said.compare_motors,
              .counterbalance = project.parts.counterbalance.value_or(Force(0.0)).si()};
  job.travel.load = load_of(project);
  const double n = job.travel.load.motor.count;
  const double none = job.travel.limits.stator_current;
  job.travel.limits = {.voltage = project.job.controller.max_voltage,
                       .stator_current = said.stator_limit ? n * said.stator_limit->si() : none,
                       .supply_current = said.supply_limit ? n * said.supply_limit->si() : none,
                       .battery = {.open_circuit_voltage = project.job.battery.open_circuit_voltage,
                                   .resistance = project.job.battery.resistance,
                                   .other_current = said.other_current.si()}};
  job.travel.longest = said.longest.si();
  take_motion(project, job.travel, job.diagnostics);
  FLYBALL_TRY(job.travel.winding, winding_of(project, job.diagnostics));
  job.diagnostics.insert(job.diagnostics.end(), project.job.plant.doubts.begin(),
                         project.job.plant.doubts.end());
  if (job.travel.load.rotor_inertia == 0.0) {
    note(job.diagnostics, "no_rotor",
         "the motors' rotors are taken to have no inertia: with size.rotor_inertia high gearings "
         "are slower");
  }
  return job;
}

}  // namespace flyball::study
