#include <flyball/study/project.hpp>

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/file.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "study/mechanism_parts.hpp"
#include "study/model_project.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view part_section = "mechanism";

Expected<mechanisms::DcMotor> motor_of(const MechanismParts& parts) {
  const int count = parts.motor_count.value_or(1);
  if (!parts.custom_motor) {
    return mechanisms::motor(parts.motor, count);
  }
  const CustomMotor& custom = *parts.custom_motor;
  return mechanisms::motor("custom motor",
                           {.nominal_voltage = custom.nominal_voltage,
                            .stall_torque = custom.stall_torque,
                            .stall_current = custom.stall_current,
                            .free_current = custom.free_current,
                            .free_speed = custom.free_speed},
                           count);
}

/// Known gains stand in place of those of the parts. kV alone makes a plant; then a kA that is not
/// given is not known.
void take_gains(const KnownGains& known, PlantDescription& plant) {
  mechanisms::FeedforwardGains& gains = plant.gains;
  if (known.kV) {
    gains = {.kV = *known.kV};
    plant.kA_determined = known.kA.has_value();
  }
  gains.kS = known.kS.value_or(gains.kS);
  gains.kA = known.kA.value_or(gains.kA);
  gains.kG = known.kG.value_or(gains.kG);
  gains.angle_offset = known.angle_offset.value_or(Angle(gains.angle_offset)).si();
}

/// What is missing for a plant, if anything is.
std::optional<Errors> missing_parts(const TomlDocument& document, const Project& project) {
  if (project.gains.kV) {
    return std::nullopt;
  }
  const MechanismRow& row = mechanism_row(*project.parts.type);
  const std::string_view kind = to_string(row.kind);
  const bool vowel = std::string_view("aeiou").find(kind.front()) != std::string_view::npos;
  std::vector<QuotedError> all;
  for (const Field& field : section_of(part_section).fields) {
    if (std::find(row.needs.begin(), row.needs.end(), field.key) != row.needs.end() &&
        !document.has(part_section, field.key)) {
      all.push_back(
          {document.missing(part_section, field.key,
                            fmt::format("{} {} needs it, for example {} = {}", vowel ? "an" : "a",
                                        kind, field.key, field.example)),
           {}});
    }
  }
  if (!all.empty() && document.has("", "gains")) {
    return document.missing("gains", "kV", "in V·s per rad or m, for example kV = 1.2");
  }
  return all.empty() ? std::nullopt : std::optional<Errors>(std::move(all));
}

/// What a log cannot say of the plant.
void take_parts(TomlDocument& document, Project& project) {
  const MechanismParts& parts = project.parts;
  PlantDescription& plant = project.job.plant;
  plant.gearing = parts.gearing.value_or(plant.gearing);
  plant.drum_radius = parts.drum_radius.value_or(Length(plant.drum_radius)).si();
  if (!document.has(part_section, "motor")) {
    return;
  }
  if (auto motor = motor_of(parts)) {
    plant.nominal_voltage = motor->nominal_voltage;
    plant.motor = *std::move(motor);
  } else {
    document.refuse(part_section, "motor", std::move(motor).error());
  }
}

/// The plant of a mechanism whose type is known.
void make_plant(TomlDocument& document, Project& project) {
  PlantDescription& plant = project.job.plant;
  const MechanismRow& row = mechanism_row(*project.parts.type);
  plant.kind = row.kind;
  plant.unit = mechanisms::position_unit(row.kind);
  project.plant_error = missing_parts(document, project);
  const auto given = [&](std::string_view key) { return document.has(part_section, key); };
  if (plant.motor && std::all_of(row.needs.begin(), row.needs.end(), given)) {
    if (auto made = row.make(project.parts, plant); !made) {
      // The mechanism's function names a part as its key does.
      const std::string part = made.error().subject();
      document.refuse(part_section, given(part) ? part : "type", std::move(made).error());
    }
  }
  take_gains(project.gains, plant);
}

/// @param alone  Whether the text is all that says what the mechanism is.
ExpectedAll<Project> read(std::string_view text, const std::string& name,
                          std::span<const Override> overrides, bool alone) {
  TomlDocument document(text, name);
  document.apply(overrides, project_document().sections);
  Project project;
  project.path = name;
  document.read(project_document(), &project);
  auto& type = project.parts.type;
  const auto& logged = project.log.mechanism;
  const bool formulas = document.has("", "model");
  if (alone && document.is_toml() && !formulas && !document.writes(part_section)) {
    document.miss("", part_section,
                  "begin with [mechanism] and type = \"elevator\", \"arm\" or \"flywheel\", or "
                  "with [model] and formulas");
  }
  if (formulas) {
    project.model_job = model_job(document, project);
    project.plant_error = Error(ProjectError::wrong_value)
                              .in(name)
                              .about("[model]")
                              .got("a model by formula")
                              .expected("a [mechanism] for this command");
  }
  if (type && logged && *type != *logged) {
    document.refuse("log", "mechanism",
                    Error(ProjectError::wrong_value)
                        .about(document.name("log", "mechanism"))
                        .got(std::string(to_string(*logged)))
                        .expected(fmt::format("the type in [mechanism], {}", to_string(*type))));
  }
  if (!document.errors()) {
    take_parts(document, project);
    type = type ? type : logged;
  }
  if (type && !document.errors()) {
    make_plant(document, project);
  }
  if (auto errors = document.errors()) {
    return tl::unexpected(*std::move(errors));
  }
  return project;
}

}  // namespace

ErrorInfo error_info(ProjectError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"syntax", "the file is not TOML", ErrorKind::misuse},
      {"unknown_key", "the key is not known", ErrorKind::misuse},
      {"missing_key", "a key is missing", ErrorKind::misuse},
      {"wrong_type", "the value has the wrong type", ErrorKind::misuse},
      {"wrong_value", "the value cannot be", ErrorKind::misuse},
      {"more_errors", "there are more errors", ErrorKind::misuse},
  };
  return flyball::detail::info_of(code, "project", rows);
}

ExpectedAll<Project> parse_project(std::string_view text, const std::string& name,
                                   std::span<const Override> overrides) {
  return read(text, name, overrides, true);
}

ExpectedAll<Project> read_project(const std::string& path, std::span<const Override> overrides) {
  constexpr std::size_t largest = 1 << 20;
  FLYBALL_TRY(const auto text, read_file(path, largest));
  auto project = parse_project(text, path, overrides);
  const bool log = path.ends_with(".json") || path.ends_with(".wpilog") || path.ends_with(".csv");
  if (!project && log && project.error().is(ProjectError::syntax)) {
    return tl::unexpected(Error(std::move(project).error())
                              .hint("a log goes to `flyball tune`, a linear model to `flyball "
                                    "analyze`"));
  }
  return project;
}

ExpectedAll<DesignJob> design_job(const std::string& project, std::span<const Override> overrides) {
  FLYBALL_TRY(auto read, read_project(project, overrides));
  if (read.plant_error) {
    return tl::unexpected(*std::move(read.plant_error));
  }
  return std::move(read.job);
}

ExpectedAll<IdentifyJob> identify_job(const std::string& log, std::span<const Override> overrides) {
  return read("", "", overrides, false).map([&](Project said) {
    return IdentifyJob{.log = log, .selection = std::move(said.log)};
  });
}

ExpectedAll<TuneJob> tune_job(const std::string& log, const std::string& project,
                              std::span<const Override> overrides) {
  FLYBALL_TRY(auto said,
              project.empty() ? read("", "", overrides, false) : read_project(project, overrides));
  TuneJob job{.identification = {.log = log, .selection = std::move(said.log)},
              .design = std::move(said.job)};
  if (!job.identification.selection.mechanism) {
    job.identification.selection.mechanism = said.parts.type;
  }
  return job;
}

}  // namespace flyball::study
