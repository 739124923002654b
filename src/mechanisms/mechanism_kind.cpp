#include <flyball/mechanisms/mechanism_kind.hpp>

#include <algorithm>
#include <cctype>
#include <string>
#include <utility>

#include "core/try.hpp"

namespace flyball::mechanisms {

std::string_view to_string(MechanismKind kind) {
  switch (kind) {
    case MechanismKind::flywheel:
      return "flywheel";
    case MechanismKind::elevator:
      return "elevator";
    case MechanismKind::arm:
      return "arm";
    case MechanismKind::turret:
      return "turret";
    case MechanismKind::roller:
      return "roller";
    case MechanismKind::swerve_steer:
      return "swerve steer";
    case MechanismKind::swerve_drive:
      return "swerve drive";
  }
  return "";
}

Expected<MechanismKind> parse_mechanism_kind(std::string_view text) {
  std::string folded;
  std::copy_if(text.begin(), text.end(), std::back_inserter(folded),
               [](unsigned char c) { return std::isalpha(c) != 0; });
  std::transform(folded.begin(), folded.end(), folded.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  using enum MechanismKind;
  constexpr std::pair<std::string_view, MechanismKind> names[] = {{"flywheel", flywheel},
                                                                  {"simple", flywheel},
                                                                  {"elevator", elevator},
                                                                  {"arm", arm},
                                                                  {"singlejointedarm", arm},
                                                                  {"turret", turret},
                                                                  {"roller", roller},
                                                                  {"swervesteer", swerve_steer},
                                                                  {"swervesteering", swerve_steer},
                                                                  {"swervedrive", swerve_drive}};
  for (const auto& [name, kind] : names) {
    if (folded == name) {
      return kind;
    }
  }
  return refusal(ArgumentError::unknown_name, {}, "mechanism")
      .got("\"" + std::string(text) + "\"")
      .expected("elevator, arm, flywheel, roller, turret, swerve steer or swerve drive");
}

std::string_view position_unit(MechanismKind kind) {
  return kind == MechanismKind::elevator || kind == MechanismKind::swerve_drive ? "m" : "rad";
}

}  // namespace flyball::mechanisms
