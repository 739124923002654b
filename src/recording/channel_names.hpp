#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/mechanisms/mechanism_kind.hpp>

/// What the names and units of a log's channels give away.
namespace flyball::recording {

/// ASCII letters made small.
[[nodiscard]] std::string lower(std::string_view text);

[[nodiscard]] bool contains_any(std::string_view text, std::span<const std::string_view> words);

/// "left", "volts" of "LeftVolts", "left_volts" and "/left/volts"; digits are no letters.
[[nodiscard]] std::vector<std::string> words_of(std::string_view name);

/// "Rotation" of "Rotation per Second"; empty if the unit is no velocity.
[[nodiscard]] std::string position_unit_of_velocity(std::string_view unit);

/// A kind that a name gives away ("ElevatorSubsystem", "shooter flywheel"), if any.
[[nodiscard]] std::optional<mechanisms::MechanismKind> kind_from_name(std::string_view name);

enum class Side { none, left, right };

/// The side that a name says in one of its words: "Distance L", "RightVolts", "frontleft".
[[nodiscard]] Side side_of(std::string_view name);

/// Whether a name is that of a drivetrain: "DriveSubsystem", "swerve", "Drivetrain".
[[nodiscard]] bool names_drivetrain(std::string_view name);

}  // namespace flyball::recording
