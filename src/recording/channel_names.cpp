#include <algorithm>
#include <array>

#include <flyball/core/quantity.hpp>

#include "recording/channel_names.hpp"

namespace flyball::recording {

using mechanisms::MechanismKind;

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

bool contains_any(std::string_view text, std::span<const std::string_view> words) {
  return std::any_of(words.begin(), words.end(), [&](std::string_view word) {
    return text.find(word) != std::string_view::npos;
  });
}

std::vector<std::string> words_of(std::string_view name) {
  const auto is_upper = [](char c) { return c >= 'A' && c <= 'Z'; };
  const auto is_letter = [&](char c) { return (c >= 'a' && c <= 'z') || is_upper(c); };
  std::vector<std::string> words;
  bool open = false;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!is_letter(name[i])) {
      open = false;
      continue;
    }
    // A word begins at a capital after a small letter: "LeftVolts" is left, volts.
    const bool capital = is_upper(name[i]) && i > 0 && !is_upper(name[i - 1]);
    if (!open || capital) {
      words.emplace_back();
      open = true;
    }
    words.back() += lower(name.substr(i, 1));
  }
  return words;
}

std::string position_unit_of_velocity(std::string_view unit) {
  const auto parsed = unit.empty() ? Expected<Unit>(Unit{}) : parse_unit(unit);
  if (!parsed) {
    return {};
  }
  if (parsed->dimension == Dimension::velocity) {
    return "m";
  }
  return parsed->dimension == Dimension::angular_velocity ? "rad" : std::string();
}

std::optional<MechanismKind> kind_from_name(std::string_view name) {
  const std::string text = lower(name);
  // What a swerve module's steering is called, and the routines of CTRE's swerve projects.
  constexpr std::array<std::string_view, 2> steer{"steer", "azimuth"};
  constexpr std::array<std::string_view, 2> drive{"sysidtranslation", "moduledrive"};
  constexpr std::array<std::string_view, 1> turret{"turret"};
  constexpr std::array<std::string_view, 1> roller{"roller"};
  if (contains_any(text, steer)) {
    return MechanismKind::swerve_steer;
  }
  if (contains_any(text, drive)) {
    return MechanismKind::swerve_drive;
  }
  if (contains_any(text, turret)) {
    return MechanismKind::turret;
  }
  if (contains_any(text, roller)) {
    return MechanismKind::roller;
  }
  constexpr std::array<std::string_view, 2> elevator{"elevator", "lift"};
  constexpr std::array<std::string_view, 2> flywheel{"flywheel", "shooter"};
  if (contains_any(text, elevator)) {
    return MechanismKind::elevator;
  }
  if (contains_any(text, flywheel)) {
    return MechanismKind::flywheel;
  }
  return std::nullopt;
}

Side side_of(std::string_view name) {
  for (const std::string& word : words_of(name)) {
    if (word == "l" || word.starts_with("left") || word.ends_with("left")) {
      return Side::left;
    }
    if (word == "r" || word.starts_with("right") || word.ends_with("right")) {
      return Side::right;
    }
  }
  return Side::none;
}

bool names_drivetrain(std::string_view name) {
  const std::vector<std::string> words = words_of(name);
  return std::any_of(words.begin(), words.end(), [](const std::string& word) {
    constexpr std::array<std::string_view, 4> whole{"drive", "driving", "chassis", "swerve"};
    constexpr std::array<std::string_view, 4> parts{"drivetrain", "drivebase", "drivesub",
                                                    "tankdrive"};
    return std::find(whole.begin(), whole.end(), word) != whole.end() || contains_any(word, parts);
  });
}

}  // namespace flyball::recording
