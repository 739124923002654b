#include <flyball/study/project.hpp>

#include <array>
#include <span>
#include <type_traits>

#include <fmt/format.h>

#include <flyball/io/file.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "study/toml_reader.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;
using enum Dimension;

constexpr std::array<std::string_view, 7> sections{
    "mechanism", "gains", "controller", "estimator", "sensor", "battery", "profile"};
constexpr std::array<std::string_view, 8> mechanism_keys{
    "type", "motor",       "motor_count",       "gearing",
    "mass", "drum_radius", "moment_of_inertia", "center_of_mass"};
constexpr std::array<std::string_view, 5> motor_keys{"nominal_voltage", "stall_torque",
                                                     "stall_current", "free_current", "free_speed"};
constexpr std::array<std::string_view, 5> gains_keys{"kS", "kV", "kA", "kG", "angle_offset"};
constexpr std::array<std::string_view, 5> controller_keys{
    "period", "state_tolerance", "input_tolerance", "max_voltage", "delay"};
constexpr std::array<std::string_view, 2> estimator_keys{"measurement_std", "model_std"};
constexpr std::array<std::string_view, 1> sensor_keys{"resolution"};
constexpr std::array<std::string_view, 2> battery_keys{"open_circuit_voltage", "resistance"};
constexpr std::array<std::string_view, 4> profile_keys{"goal", "max_velocity", "max_acceleration",
                                                       "seed"};

std::vector<Dimension> state_dimensions(MechanismKind kind) {
  switch (kind) {
    case MechanismKind::flywheel:
      return {angular_velocity};
    case MechanismKind::elevator:
      return {length, velocity};
    case MechanismKind::arm:
      return {angle, angular_velocity};
  }
  return {};
}

// The dimension of what is measured and followed: a flywheel's velocity, else the position.
Dimension output_dimension(MechanismKind kind) {
  return state_dimensions(kind).front();
}

Dimension rate_dimension(MechanismKind kind) {
  switch (kind) {
    case MechanismKind::flywheel:
      return angular_acceleration;
    case MechanismKind::elevator:
      return velocity;
    case MechanismKind::arm:
      return angular_velocity;
  }
  return dimensionless;
}

std::optional<mechanisms::DcMotor> read_motor(TomlReader& reader, const toml::table& section,
                                              const std::string& file) {
  const int count = static_cast<int>(reader.integer("motor_count", 1).value_or(1));
  if (reader.error() || !reader.has("motor")) {
    return std::nullopt;
  }
  if (!section.get("motor")->is_table()) {
    const auto name = reader.text("motor");
    if (!name) {
      return std::nullopt;
    }
    auto motor = mechanisms::motor(*name, count);
    if (!motor) {
      reader.refuse("motor", std::move(motor).error());
      return std::nullopt;
    }
    return *std::move(motor);
  }
  const toml::table& numbers = *section.get("motor")->as_table();
  TomlReader inner(numbers, "mechanism.motor", file);
  inner.allow(motor_keys);
  mechanisms::MotorDatasheet datasheet;
  const auto number = [&](std::string_view key, Dimension dimension, auto& target) {
    if (const auto value = inner.quantity(key, dimension)) {
      target = std::remove_reference_t<decltype(target)>(*value);
    } else if (!inner.error()) {
      inner.refuse(key, inner.missing(key, "a custom motor needs its five datasheet numbers"));
    }
  };
  datasheet.nominal_voltage = Voltage(12.0);
  if (inner.has("nominal_voltage")) {
    number("nominal_voltage", voltage, datasheet.nominal_voltage);
  }
  number("stall_torque", torque, datasheet.stall_torque);
  number("stall_current", current, datasheet.stall_current);
  number("free_current", current, datasheet.free_current);
  number("free_speed", angular_velocity, datasheet.free_speed);
  if (inner.error()) {
    reader.adopt(inner);
    return std::nullopt;
  }
  auto motor = mechanisms::motor("custom motor", datasheet, count);
  if (!motor) {
    reader.refuse("motor", std::move(motor).error());
    return std::nullopt;
  }
  return *std::move(motor);
}

// The plant from mass, gearing and motors; an absent number is the project's `plant_error`.
void read_physical_plant(TomlReader& reader, Project& project) {
  PlantDescription& plant = project.job.plant;
  const MechanismKind kind = *project.mechanism;
  const auto gearing = reader.positive("gearing", dimensionless);
  const auto mass_kg = reader.not_negative("mass", mass);
  const auto radius = reader.positive("drum_radius", length);
  const auto inertia = reader.positive("moment_of_inertia", moment_of_inertia);
  const auto center = reader.not_negative("center_of_mass", length);
  if (reader.error()) {
    return;
  }
  plant.gearing = gearing.value_or(1.0);
  plant.drum_radius = radius.value_or(0.0);

  const auto need = [&](std::string_view key, bool present, std::string_view example) {
    if (!present && !project.plant_error) {
      project.plant_error = reader.missing(
          key, fmt::format("{} needs it, for example {} = {}",
                           kind == MechanismKind::elevator || kind == MechanismKind::arm
                               ? fmt::format("an {}", to_string(kind))
                               : fmt::format("a {}", to_string(kind)),
                           key, example));
    }
  };
  need("motor", plant.motor.has_value(), "\"NEO\"");
  need("gearing", gearing.has_value(), "10.0");
  const auto take = [&](const auto& model) {
    if (!model) {
      reader.refuse("type", model.error());
      return;
    }
    plant.gains = model->gains;
    plant.nominal_voltage = model->nominal_voltage;
  };
  switch (kind) {
    case MechanismKind::flywheel:
      need("moment_of_inertia", inertia.has_value(), "\"0.003 kg m^2\"");
      if (!project.plant_error) {
        take(mechanisms::flywheel(
            mechanisms::FlywheelParameters{.motor = *plant.motor,
                                           .gearing = *gearing,
                                           .moment_of_inertia = MomentOfInertia(*inertia)}));
      }
      return;
    case MechanismKind::elevator:
      need("mass", mass_kg.has_value(), "\"8 kg\"");
      need("drum_radius", radius.has_value(), "\"1 in\"");
      if (mass_kg && *mass_kg == 0.0) {
        reader.refuse("mass", Error(ArgumentError::not_positive)
                                  .about("mechanism.mass")
                                  .got("0 kg")
                                  .expected("greater than zero"));
        return;
      }
      if (!project.plant_error) {
        take(mechanisms::elevator(mechanisms::ElevatorParameters{.motor = *plant.motor,
                                                                 .gearing = *gearing,
                                                                 .mass = Mass(*mass_kg),
                                                                 .drum_radius = Length(*radius)}));
      }
      return;
    case MechanismKind::arm:
      need("moment_of_inertia", inertia.has_value(), "\"1.1 kg m^2\"");
      need("mass", mass_kg.has_value(), "\"3 kg\"");
      need("center_of_mass", center.has_value(), "\"0.4 m\"");
      if (!project.plant_error) {
        take(mechanisms::arm(
            mechanisms::ArmParameters{.motor = *plant.motor,
                                      .gearing = *gearing,
                                      .moment_of_inertia = MomentOfInertia(*inertia),
                                      .mass = Mass(*mass_kg),
                                      .center_of_mass = Length(*center)}));
      }
      return;
  }
}

void read_gains(TomlReader& reader, Project& project) {
  PlantDescription& plant = project.job.plant;
  plant.gains.kS = reader.not_negative("kS", dimensionless).value_or(0.0);
  plant.gains.kG = reader.quantity("kG", dimensionless).value_or(0.0);
  plant.gains.angle_offset = reader.quantity("angle_offset", angle).value_or(0.0);
  const auto kV = reader.positive("kV", dimensionless);
  const auto kA = reader.positive("kA", dimensionless);
  if (reader.error()) {
    return;
  }
  if (!kV) {
    project.plant_error = reader.missing("kV", "in V·s per rad or m, for example kV = 1.2");
    return;
  }
  project.plant_error.reset();
  plant.gains.kV = *kV;
  plant.gains.kA = kA.value_or(0.0);
  plant.kA_determined = kA.has_value();
}

void read_controller(TomlReader& reader, MechanismKind kind, ControllerOptions& controller) {
  controller.period = reader.positive("period", time).value_or(controller.period);
  controller.state_tolerance = reader.quantities("state_tolerance", state_dimensions(kind));
  controller.input_tolerance =
      reader.positive("input_tolerance", voltage).value_or(controller.input_tolerance);
  controller.max_voltage = reader.positive("max_voltage", voltage).value_or(controller.max_voltage);
  controller.delay = reader.not_negative("delay", time);
}

void read_surroundings(TomlReader& top, const std::string& file, MechanismKind kind,
                       DesignJob& job) {
  const auto section = [&](const char* name, std::span<const std::string_view> keys, auto&& read) {
    if (const toml::table* table = top.table(name)) {
      TomlReader reader(*table, name, file);
      reader.allow(keys);
      read(reader);
      top.adopt(reader);
    }
  };
  section("controller", controller_keys,
          [&](TomlReader& reader) { read_controller(reader, kind, job.controller); });
  section("estimator", estimator_keys, [&](TomlReader& reader) {
    job.estimator.measurement_std = reader.positive("measurement_std", output_dimension(kind));
    job.estimator.model_std = reader.quantities("model_std", state_dimensions(kind));
  });
  section("sensor", sensor_keys, [&](TomlReader& reader) {
    job.sensor.resolution = reader.not_negative("resolution", output_dimension(kind)).value_or(0.0);
  });
  section("battery", battery_keys, [&](TomlReader& reader) {
    BatteryOptions& battery = job.battery;
    battery.open_circuit_voltage =
        reader.positive("open_circuit_voltage", voltage).value_or(battery.open_circuit_voltage);
    battery.resistance = reader.not_negative("resistance", resistance).value_or(battery.resistance);
  });
  section("profile", profile_keys, [&](TomlReader& reader) {
    job.profile.goal = reader.quantity("goal", output_dimension(kind));
    job.profile.max_velocity = reader.positive("max_velocity", rate_dimension(kind));
    job.profile.max_acceleration = reader.positive(
        "max_acceleration", kind == MechanismKind::elevator ? acceleration : angular_acceleration);
    job.seed = static_cast<unsigned long long>(reader.integer("seed", 0).value_or(1));
  });
}

}  // namespace

ErrorInfo error_info(ProjectError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"syntax", "the file is not TOML", ErrorKind::misuse},
      {"unknown_key", "the key is not known", ErrorKind::misuse},
      {"missing_key", "a key is missing", ErrorKind::misuse},
      {"wrong_type", "the value has the wrong type", ErrorKind::misuse},
      {"wrong_value", "the value cannot be", ErrorKind::misuse},
  };
  return detail::info_of(code, "project", rows);
}

Expected<Project> parse_project(std::string_view text, const std::string& name) {
  toml::table root;
  try {
    root = toml::parse(text, name);
  } catch (const toml::parse_error& problem) {
    return tl::unexpected(Error(ProjectError::syntax)
                              .in(fmt::format("{}:{}:{}", name, problem.source().begin.line,
                                              problem.source().begin.column))
                              .hint(std::string(problem.description())));
  }

  Project project;
  project.path = name;
  TomlReader top(root, "", name);
  top.allow(sections);

  if (const toml::table* section = top.table("mechanism")) {
    TomlReader reader(*section, "mechanism", name);
    reader.allow(mechanism_keys);
    if (const auto type = reader.text("type")) {
      auto kind = mechanisms::parse_mechanism_kind(*type);
      if (kind) {
        project.mechanism = *kind;
        project.job.plant.kind = *kind;
        project.job.plant.unit = mechanisms::position_unit(*kind);
      } else {
        reader.refuse("type", std::move(kind).error());
      }
    } else if (!reader.error()) {
      reader.refuse("type",
                    reader.missing("type", "write type = \"elevator\", \"arm\" or \"flywheel\""));
    }
    if (!reader.error()) {
      project.job.plant.motor = read_motor(reader, *section, name);
    }
    if (!reader.error()) {
      read_physical_plant(reader, project);
    }
    top.adopt(reader);
  }
  if (!top.error() && !project.mechanism) {
    return tl::unexpected(top.missing("mechanism",
                                      "begin with [mechanism] and type = \"elevator\", \"arm\" or "
                                      "\"flywheel\""));
  }
  if (const toml::table* section = top.table("gains")) {
    TomlReader reader(*section, "gains", name);
    reader.allow(gains_keys);
    read_gains(reader, project);
    top.adopt(reader);
  }
  if (!top.error()) {
    read_surroundings(top, name, *project.mechanism, project.job);
  }
  if (top.error()) {
    return tl::unexpected(*top.error());
  }
  return project;
}

Expected<Project> read_project(const std::string& path) {
  constexpr std::size_t largest = 1 << 20;
  FLYBALL_TRY(auto text, read_file(path, largest));
  return parse_project(text, path);
}

}  // namespace flyball::study
