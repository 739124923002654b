// Results as project files.
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/version.hpp>
#include <flyball/study/project.hpp>

#include "core/controls.hpp"
#include "study/per_unit.hpp"

namespace flyball::study {

namespace {

using identification::FeedforwardFit;
using identification::GainEstimate;
using mechanisms::MechanismKind;

const std::string& heading() {
  static const std::string text = fmt::format(
      "A Flyball {} project: `flyball design` reads this file as it is.\n"
      "Gains in V, V·s/unit and V·s²/unit with the unit of the mechanism (m or rad).",
      version);
  return text;
}

/// The plant's gains, and the parts that a loop around known gains still needs.
void describe(const PlantDescription& plant, Project& project) {
  const mechanisms::FeedforwardGains& gains = plant.gains;
  project.parts.type = plant.kind;
  project.gains.kS = gains.kS;
  project.gains.kV = gains.kV;
  if (plant.kA_determined) {
    project.gains.kA = gains.kA;
  } else if (plant.kA_upper_bound > 0.0) {
    project.gains.kA_upper_bound = plant.kA_upper_bound;
  }
  if (has_gravity(plant.kind)) {
    project.gains.kG = gains.kG;
  }
  if (plant.kind == MechanismKind::arm) {
    project.gains.angle_offset = Angle(gains.angle_offset);
  }
  if (!plant.motor) {
    return;
  }
  const mechanisms::DcMotor& motor = *plant.motor;
  const auto known = mechanisms::motor(motor.name, motor.count);
  project.parts.motor_count = motor.count;
  project.parts.gearing = plant.gearing;
  if (plant.drum_radius > 0.0 && plant.kind == MechanismKind::elevator) {
    project.parts.drum_radius = Length(plant.drum_radius);
  } else if (plant.drum_radius > 0.0 && plant.kind == MechanismKind::swerve_drive) {
    project.parts.wheel_radius = Length(plant.drum_radius);
  }
  if (known && known->R == motor.R && known->Kt == motor.Kt && known->Kv == motor.Kv) {
    project.parts.motor = motor.name;
  } else {
    project.parts.custom_motor =
        CustomMotor{.nominal_voltage = Voltage(motor.nominal_voltage),
                    .stall_torque = Torque(motor.stall_torque / motor.count),
                    .stall_current = Current(motor.stall_current / motor.count),
                    .free_current = Current(motor.free_current / motor.count),
                    .free_speed = AngularVelocity(motor.free_speed)};
  }
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text::without_steering(std::move(text), false);
}

/// @param V  What the gains are in.
std::vector<KeyComment> comments(const PlantDescription& plant, const FeedforwardFit* fit,
                                 std::string_view V = "V") {
  const auto within = [](const GainEstimate* gain) {
    return gain == nullptr || !gain->determined
               ? std::string()
               : fmt::format(", 95 % within {} to {}", format_number(gain->interval[0], 5),
                             format_number(gain->interval[1], 5));
  };
  const auto of = [&](const GainEstimate FeedforwardFit::* gain) {
    return within(fit == nullptr ? nullptr : &(fit->*gain));
  };
  const auto of_some = [&](const std::optional<GainEstimate> FeedforwardFit::* gain) {
    return within(fit == nullptr || !(fit->*gain) ? nullptr : &*(fit->*gain));
  };
  const std::string unit_of_kA = fmt::format("{}·s²/{}", V, plant.unit);
  const std::string why =
      fmt::format("is not determined{}",
                  fit != nullptr && !fit->kA.reason.empty() ? ": " + one_line(fit->kA.reason) : "");
  std::vector<KeyComment> all{
      {"gains.kS", std::string(V) + of(&FeedforwardFit::kS)},
      {"gains.kV", fmt::format("{}·s/{}{}", V, plant.unit, of(&FeedforwardFit::kV))}};
  if (plant.kA_determined) {
    all.push_back({"gains.kA", unit_of_kA + of(&FeedforwardFit::kA)});
  } else if (plant.kA_upper_bound > 0.0) {
    all.push_back({"gains.kA_upper_bound", fmt::format("{}; kA {}", unit_of_kA, why)});
  } else {
    all.push_back({"gains.kA", why});
  }
  if (has_gravity(plant.kind)) {
    all.push_back({"gains.kG", std::string(V) + of_some(&FeedforwardFit::kG)});
  }
  if (plant.kind == MechanismKind::arm) {
    all.push_back({"gains.angle_offset", "true angle from horizontal less the measured one" +
                                             of_some(&FeedforwardFit::angle_offset)});
  }
  return all;
}

}  // namespace

Project project_of(const DesignJob& job) {
  Project project;
  project.job = job;
  describe(job.plant, project);
  return project;
}

std::string gains_toml(const IdentifyResult& result) {
  if (!result.report.fit) {
    return "";
  }
  const FeedforwardFit& fit = *result.report.fit;
  PlantDescription plant = plant_from_fit(fit);
  // Gains as they were found, also those that a design would take for zero.
  plant.gains.kS = fit.kS.value;
  plant.gains.kG = fit.kG ? fit.kG->value : 0.0;
  plant.gains.angle_offset = fit.angle_offset ? fit.angle_offset->value : 0.0;
  Project project;
  describe(plant, project);
  constexpr std::array<std::string_view, 2> sections{"mechanism", "gains"};
  const std::string mind = is_per_unit(result) ? fmt::format("\n{}", per_unit_comment) : "";
  return write_project(project, heading() + mind, sections,
                       comments(plant, &fit, volts_of(result)));
}

std::string gains_toml(const DesignResult& result, const FeedforwardFit* fit) {
  Project project = project_of(result.job);
  DesignJob& job = project.job;
  std::vector<KeyComment> beside = comments(job.plant, fit);
  std::vector<double>& tolerances = job.controller.state_tolerance;
  if (result.velocity_servo && !controls_velocity(job.plant.kind) && tolerances.size() == 1) {
    // A project gives a position and a velocity; the plant without kA has the first alone.
    tolerances.push_back(job.plant.nominal_voltage / job.plant.gains.kV);
    beside.push_back({"controller.state_tolerance", "without kA the velocity's is not used"});
  }
  if (result.velocity_servo) {
    job.estimator.model_std.clear();
  }
  job.profile.goal = result.motion.goal;
  constexpr std::array<std::string_view, 8> sections{"mechanism",  "mechanism.motor", "gains",
                                                     "controller", "estimator",       "sensor",
                                                     "battery",    "profile"};
  return write_project(project, heading(), sections, beside);
}

}  // namespace flyball::study
