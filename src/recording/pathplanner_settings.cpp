// PathPlanner's settings.json: a robot, field by field.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/file.hpp>
#include <flyball/recording/trajectory_file.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/json_objects.hpp"

namespace flyball {

namespace {

using nlohmann::json;

/// A number of the file, and what it is in SI.
struct NumberField {
  const char* key;
  std::optional<double> PathPlannerSettings::* member;
  double factor;
  bool positive;  ///< Whether it must be; otherwise not negative.
};

constexpr std::array numbers{
    NumberField{"robotWidth", &PathPlannerSettings::robot_width, 1.0, true},
    NumberField{"robotLength", &PathPlannerSettings::robot_length, 1.0, true},
    NumberField{"defaultMaxVel", &PathPlannerSettings::max_velocity, 1.0, true},
    NumberField{"defaultMaxAccel", &PathPlannerSettings::max_acceleration, 1.0, true},
    NumberField{"defaultMaxAngVel", &PathPlannerSettings::max_angular_velocity, one_degree, true},
    NumberField{"defaultMaxAngAccel", &PathPlannerSettings::max_angular_acceleration, one_degree,
                true},
    NumberField{"defaultNominalVoltage", &PathPlannerSettings::nominal_voltage, 1.0, true},
    NumberField{"robotMass", &PathPlannerSettings::mass, 1.0, true},
    NumberField{"robotMOI", &PathPlannerSettings::moment_of_inertia, 1.0, true},
    NumberField{"robotTrackwidth", &PathPlannerSettings::trackwidth, 1.0, true},
    NumberField{"driveWheelRadius", &PathPlannerSettings::wheel_radius, 1.0, true},
    NumberField{"driveGearing", &PathPlannerSettings::gearing, 1.0, true},
    NumberField{"maxDriveSpeed", &PathPlannerSettings::max_drive_speed, 1.0, true},
    NumberField{"driveCurrentLimit", &PathPlannerSettings::current_limit, 1.0, true},
    NumberField{"wheelCOF", &PathPlannerSettings::wheel_friction, 1.0, true}};

constexpr std::array<const char*, 4> module_names{"fl", "fr", "bl", "br"};
constexpr std::array<std::string_view, 4> other_keys{"holonomicMode", "pathFolders", "autoFolders",
                                                     "robotFeatures"};

Expected<std::vector<std::string>> texts_of(const json& file, const char* key,
                                            const std::string& source) {
  std::vector<std::string> texts;
  const auto found = file.find(key);
  if (found == file.end()) {
    return texts;
  }
  const auto is_text = [](const json& element) { return element.is_string(); };
  if (!found->is_array() || !std::all_of(found->begin(), found->end(), is_text)) {
    return refusal(TrajectoryFileError::wrong_sample, source, key)
        .got(shortened(found->dump()))
        .expected("a list of texts");
  }
  for (const json& element : *found) {
    texts.push_back(element.get<std::string>());
  }
  return texts;
}

Expected<void> read_modules(const json& file, const std::string& source,
                            PathPlannerSettings& settings) {
  for (std::size_t i = 0; i < module_names.size(); ++i) {
    const std::string x = fmt::format("{}ModuleX", module_names[i]);
    const std::string y = fmt::format("{}ModuleY", module_names[i]);
    if (!file.contains(x) && !file.contains(y)) {
      continue;
    }
    Eigen::Vector2d place;
    FLYBALL_TRY(place(0), recording::number_of(file, x.c_str(), x, source));
    FLYBALL_TRY(place(1), recording::number_of(file, y.c_str(), y, source));
    settings.modules[i] = place;
  }
  if (std::all_of(settings.modules.begin(), settings.modules.end(),
                  [](const auto& place) { return place.has_value(); })) {
    const auto wrong = misplaced_module(
        {*settings.modules[0], *settings.modules[1], *settings.modules[2], *settings.modules[3]});
    if (wrong) {
      return refusal(TrajectoryFileError::wrong_sample, source, "the order of the modules")
          .got("another: " + *wrong)
          .expected("x ahead and y to the left of the robot's middle, in metres")
          .hint("two of flModuleX, frModuleX, … or their signs are exchanged");
    }
  }
  return {};
}

void tell_unknown(const json& file, PathPlannerSettings& settings) {
  std::vector<std::string> known(other_keys.begin(), other_keys.end());
  for (const NumberField& field : numbers) {
    known.emplace_back(field.key);
  }
  known.insert(known.end(), {"driveMotorType", "bumperOffsetX", "bumperOffsetY"});
  for (const char* module : module_names) {
    known.push_back(fmt::format("{}ModuleX", module));
    known.push_back(fmt::format("{}ModuleY", module));
  }
  const std::vector<std::string_view> names(known.begin(), known.end());
  for (const auto& [key, value] : file.items()) {
    if (std::find(names.begin(), names.end(), key) == names.end()) {
      const std::string nearest = nearest_name(key, names);
      warn(settings.diagnostics, "unknown_key", "the settings' \"{}\" means nothing here{}", key,
           nearest.empty() ? std::string() : fmt::format("; did they mean \"{}\"?", nearest));
    }
  }
}

}  // namespace

std::optional<std::string> misplaced_module(const std::array<Eigen::Vector2d, 4>& modules) {
  constexpr std::array<const char*, 4> names{"front left", "front right", "back left",
                                             "back right"};
  const auto shown = [&](std::size_t i) {
    return fmt::format("({}, {}) m", format_number(modules[i](0), 4),
                       format_number(modules[i](1), 4));
  };
  const auto told = [&](std::size_t a, const char* not_so, std::size_t b) {
    return fmt::format("the {} module, {}, is not {} the {} one, {}", names[a], shown(a), not_so,
                       names[b], shown(b));
  };
  for (const auto& [front, back] : {std::pair{0U, 2U}, std::pair{1U, 3U}}) {
    if (!(modules[front](0) > modules[back](0))) {
      return told(front, "ahead of", back);
    }
  }
  for (const auto& [left, right] : {std::pair{0U, 1U}, std::pair{2U, 3U}}) {
    if (!(modules[left](1) > modules[right](1))) {
      return told(left, "to the left of", right);
    }
  }
  return std::nullopt;
}

Expected<PathPlannerSettings> parse_pathplanner_settings(std::string_view text,
                                                         const std::string& source) {
  FLYBALL_TRY(const json file, recording::json_of(text, source));
  PathPlannerSettings settings;
  const auto is_known = [&](const NumberField& field) {
    return file.is_object() && file.contains(field.key);
  };
  if (std::none_of(numbers.begin(), numbers.end(), is_known)) {
    return refusal(TrajectoryFileError::not_a_trajectory, source, "the JSON")
        .got("without a field of PathPlanner's settings")
        .expected("settings.json with robotMass, robotMOI, driveWheelRadius, driveGearing, …");
  }
  for (const NumberField& field : numbers) {
    if (!file.contains(field.key)) {
      continue;
    }
    FLYBALL_TRY(const double value, recording::number_of(file, field.key, field.key, source));
    if (!(value > 0.0)) {
      return refusal(TrajectoryFileError::wrong_sample, source, field.key)
          .got(format_number(value))
          .expected("positive");
    }
    settings.*field.member = field.factor * value;
  }
  if (const auto found = file.find("holonomicMode"); found != file.end()) {
    if (!found->is_boolean()) {
      return refusal(TrajectoryFileError::wrong_sample, source, "holonomicMode")
          .got(shortened(found->dump()))
          .expected("true or false");
    }
    settings.holonomic = found->get<bool>();
  }
  if (const auto found = file.find("driveMotorType"); found != file.end()) {
    if (!found->is_string()) {
      return refusal(TrajectoryFileError::wrong_sample, source, "driveMotorType")
          .got(shortened(found->dump()))
          .expected("a motor's name, such as \"krakenX60\"");
    }
    settings.motor = found->get<std::string>();
  }
  FLYBALL_TRY(settings.path_folders, texts_of(file, "pathFolders", source));
  FLYBALL_TRY(settings.auto_folders, texts_of(file, "autoFolders", source));
  if (const auto found = file.find("robotFeatures"); found != file.end() && found->is_array()) {
    for (const json& feature : *found) {  // objects in texts, or objects
      settings.features.push_back(feature.is_string() ? feature.get<std::string>()
                                                      : feature.dump());
    }
  }
  FLYBALL_CHECK(read_modules(file, source, settings));
  FLYBALL_TRY(settings.bumper_offset(0),
              recording::number_of(file, "bumperOffsetX", "bumperOffsetX", source, 0.0));
  FLYBALL_TRY(settings.bumper_offset(1),
              recording::number_of(file, "bumperOffsetY", "bumperOffsetY", source, 0.0));
  tell_unknown(file, settings);
  return settings;
}

Expected<PathPlannerSettings> read_pathplanner_settings(const std::string& path) {
  constexpr std::size_t largest = 1 << 22;
  FLYBALL_TRY(const std::string text, read_file(path, largest));
  return parse_pathplanner_settings(text, path);
}

}  // namespace flyball
