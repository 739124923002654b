#include <flyball/study/project.hpp>

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/io/file.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "study/drive_fields.hpp"
#include "study/mechanism_parts.hpp"
#include "study/model_project.hpp"
#include "study/size_fields.hpp"
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
  if (!plant.kA_determined) {
    plant.kA_upper_bound = known.kA_upper_bound.value_or(plant.kA_upper_bound);
  }
  gains.kS = known.kS.value_or(gains.kS);
  gains.kA = known.kA.value_or(gains.kA);
  gains.kG = known.kG.value_or(gains.kG);
  gains.angle_offset = known.angle_offset.value_or(Angle(gains.angle_offset)).si();
}

struct MissingKey {
  std::string_view section;
  std::string_view key;
  std::string hint;
};

/// What is missing for a plant of a kind.
std::vector<MissingKey> missing_parts(const TomlDocument& document, const MechanismRow& row) {
  if (document.has("gains", "kV")) {
    return {};
  }
  const std::string_view kind = to_string(row.kind);
  const bool vowel = std::string_view("aeiou").find(kind.front()) != std::string_view::npos;
  std::vector<MissingKey> all;
  for (const Field& field : section_of(part_section).fields) {
    if (std::find(row.needs.begin(), row.needs.end(), field.key) != row.needs.end() &&
        !document.has(part_section, field.key)) {
      all.push_back({part_section, field.key,
                     fmt::format("{} {} needs it, for example {} = {}", vowel ? "an" : "a", kind,
                                 field.key, field.example)});
    }
  }
  if (!all.empty() && document.has("", "gains")) {
    std::vector<std::string_view> parts;
    for (const MissingKey& part : all) {
      parts.push_back(part.key);
    }
    return {{"gains", "kV",
             fmt::format("in V·s per rad or m, for example kV = 1.2; or else say in [mechanism]: "
                         "{}",
                         fmt::join(parts, ", "))}};
  }
  return all;
}

/// What a log cannot say of the plant.
void take_parts(TomlDocument& document, Project& project) {
  const MechanismParts& parts = project.parts;
  PlantDescription& plant = project.job.plant;
  plant.gearing = parts.gearing.value_or(plant.gearing);
  plant.drum_radius =
      parts.drum_radius.value_or(parts.wheel_radius.value_or(Length(plant.drum_radius))).si();
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
  std::vector<QuotedError> missing;
  for (MissingKey& key : missing_parts(document, row)) {
    missing.push_back(document.missing(key.section, key.key, std::move(key.hint)));
  }
  if (!missing.empty()) {
    project.plant_error = Errors(std::move(missing));
  }
  const auto given = [&](std::string_view key) { return document.has(part_section, key); };
  if (plant.motor && std::all_of(row.needs.begin(), row.needs.end(), given)) {
    if (auto made = row.make(project.parts, plant); !made) {
      // The mechanism's function names a part as its key does.
      const std::string part = made.error().subject();
      document.refuse(part_section, given(part) ? part : "type", std::move(made).error());
    }
  }
  if (!document.has("gains", "kV")) {
    doubt_arm(project.parts, plant.doubts);
  }
  take_gains(project.gains, plant);
  project.mechanism_run = mechanism_run(document, project);
}

/// What means nothing for a kind of mechanism.
void refuse_other_kinds(TomlDocument& document, const MechanismRow& row) {
  const auto refuse = [&](std::string_view section, std::string_view key, std::string hint) {
    if (document.has(section, key)) {
      document.refuse(section, key,
                      Error(ProjectError::wrong_value)
                          .about(document.name(section, key))
                          .got(fmt::format("without meaning for this {}", to_string(row.kind)))
                          .hint(std::move(hint)),
                      TomlDocument::Fault::key);
    }
  };
  const auto needs = [](const MechanismRow& one, std::string_view key) {
    return std::find(one.needs.begin(), one.needs.end(), key) != one.needs.end() ||
           std::find(one.may.begin(), one.may.end(), key) != one.may.end();
  };
  for (const Field& field : section_of(part_section).fields) {
    if (!needs(row, field.key) &&
        std::any_of(mechanism_rows().begin(), mechanism_rows().end(),
                    [&](const MechanismRow& other) { return needs(other, field.key); })) {
      refuse(part_section, field.key, fmt::format("it is made of {}", fmt::join(row.needs, ", ")));
    }
  }
  if (!has_gravity(row.kind)) {
    refuse("gains", "kG", "gravity does not move it");
  }
  if (row.kind != mechanisms::MechanismKind::arm) {
    refuse("gains", "angle_offset", "it is of an arm");
  }
  constexpr std::string_view bound = "kA_upper_bound";
  if (document.has("gains", bound) &&
      (document.has("gains", "kA") || !document.has("gains", "kV"))) {
    document.refuse("gains", bound,
                    Error(ProjectError::wrong_value)
                        .about(document.name("gains", bound))
                        .got("without meaning beside a kA that is known")
                        .hint("leave one of them out, or give kV without kA"),
                    TomlDocument::Fault::key);
  }
  if (document.has("gains", "kV") && !document.has(part_section, "motor")) {
    refuse(part_section, "motor_count", "say which motor, or leave it out");
  }
}

/// What says what the mechanism is: a file; a log, and a file of that mechanism; a log alone.
enum class Source { file, file_with_log, log };

ExpectedAll<Project> read(std::string_view text, const std::string& name,
                          std::span<const Override> overrides, Source source) {
  TomlDocument document(text, name);
  document.apply(overrides, project_document().sections);
  Project project;
  project.path = name;
  document.read(project_document(), &project);
  auto& type = project.parts.type;
  const auto& logged = project.log.mechanism;
  const bool formulas = document.subject() == Subject::model;
  const bool drives = document.subject() == Subject::drive;
  if (source != Source::log && document.is_toml() && !formulas && !drives &&
      !document.writes(part_section)) {
    document.miss("", part_section,
                  "begin with [mechanism] and type = \"elevator\", \"arm\" or \"flywheel\", "
                  "with [drive] and a drivetrain, or with [model] and formulas");
  }
  if (drives) {
    project.plant_error = Error(ProjectError::wrong_value)
                              .in(name)
                              .about("[drive]")
                              .got("a drivetrain, which `flyball drive` simulates")
                              .expected("a [mechanism] for this command");
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
  if (type) {
    refuse_other_kinds(document, mechanism_row(*type));
  }
  if (type && !formulas && !drives) {
    check_size(document, project);
  }
  if (drives) {
    check_drive(document, project);
  }
  if (!document.errors()) {
    take_parts(document, project);
    type = type ? type : logged;
  }
  if (type && !document.errors()) {
    make_plant(document, project);
  } else if (type && !formulas && source == Source::file) {
    // With errors there is no project to keep them for: what is missing is told beside them.
    for (MissingKey& key : missing_parts(document, mechanism_row(*type))) {
      document.miss(key.section, key.key, std::move(key.hint));
    }
  }
  if (auto errors = document.errors()) {
    return tl::unexpected(*std::move(errors));
  }
  return project;
}

ExpectedAll<Project> read_file_of(const std::string& path, std::span<const Override> overrides,
                                  Source source) {
  constexpr std::size_t largest = 1 << 20;
  FLYBALL_TRY(const auto text, read_file(path, largest));
  auto project = read(text, path, overrides, source);
  const bool log = path.ends_with(".json") || path.ends_with(".wpilog") || path.ends_with(".csv");
  if (!project && log && project.error().is(ProjectError::syntax)) {
    return tl::unexpected(Error(std::move(project).error())
                              .hint("a log goes to `flyball tune`, a linear model to `flyball "
                                    "analyze`"));
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
  return read(text, name, overrides, Source::file);
}

ExpectedAll<Project> read_project(const std::string& path, std::span<const Override> overrides) {
  return read_file_of(path, overrides, Source::file);
}

ExpectedAll<Project> read_project_beside_log(const std::string& path,
                                             std::span<const Override> overrides) {
  return read_file_of(path, overrides, Source::file_with_log);
}

ExpectedAll<DesignJob> design_job(const std::string& project, std::span<const Override> overrides) {
  FLYBALL_TRY(auto read, read_project(project, overrides));
  if (read.plant_error) {
    return tl::unexpected(*std::move(read.plant_error));
  }
  return std::move(read.job);
}

ExpectedAll<TuneJob> tune_job(const std::string& log, const std::string& project,
                              std::span<const Override> overrides) {
  FLYBALL_TRY(auto said, project.empty() ? read("", "", overrides, Source::log)
                                         : read_project_beside_log(project, overrides));
  TuneJob job{.identification = {.log = log, .selection = std::move(said.log)},
              .design = std::move(said.job)};
  if (auto& selection = job.identification.selection;
      !selection.mechanism && !selection.drivetrain) {
    selection.mechanism = said.parts.type;
  }
  return job;
}

ExpectedAll<IdentifyJob> identify_job(const std::string& log, const std::string& project,
                                      std::span<const Override> overrides) {
  return tune_job(log, project, overrides).map([](TuneJob job) {
    job.identification.said = std::move(job.design.plant);
    return std::move(job.identification);
  });
}

ExpectedAll<ExperimentJob> experiment_job(const std::string& file,
                                          std::span<const Override> overrides) {
  if (file.ends_with(".toml")) {
    FLYBALL_TRY(auto project, read_project(file, overrides));
    if (project.plant_error) {
      return tl::unexpected(*std::move(project.plant_error));
    }
    ExperimentJob job{
        .plant = std::move(project.job.plant), .limits = project.experiment, .sensor = {}};
    job.sensor.resolution = project.job.sensor.resolution;
    job.sensor.delay = project.job.controller.delay.value_or(0.0);
    job.seed = project.job.seed;
    return job;
  }
  // The unit of the travel is that of the mechanism, which the log may tell.
  std::vector<Override> of_log;
  std::copy_if(overrides.begin(), overrides.end(), std::back_inserter(of_log),
               [](const Override& given) { return !given.option.starts_with("--travel-"); });
  FLYBALL_TRY(auto first, read("", "", of_log, Source::log));
  const bool said_kind = first.log.mechanism.has_value();
  FLYBALL_TRY(const auto identified, identify({.log = file, .selection = std::move(first.log)}));
  if (!identified.report.fit) {
    return tl::unexpected(Errors(identified.report.fit.error()));
  }
  std::vector<Override> all(overrides.begin(), overrides.end());
  if (!said_kind) {
    all.push_back({"--mechanism", std::string(to_string(identified.report.fit->mechanism))});
  }
  FLYBALL_TRY(auto said, read("", "", all, Source::log));
  ExperimentJob job = experiment_after(identified, said.experiment);
  job.seed = said.job.seed;
  return job;
}

}  // namespace flyball::study
