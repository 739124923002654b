#pragma once

#include <string_view>

#include <flyball/core/expected.hpp>

namespace flyball::mechanisms {

/// The one-degree-of-freedom mechanisms of sections 6.9 to 6.11, and those that are built like
/// them.
enum class MechanismKind {
  flywheel,      ///< Theorem 6.10.1: velocity; radians; no gravity.
  elevator,      ///< Theorem 6.9.1: position and velocity; metres; constant gravity.
  arm,           ///< Theorem 6.11.1: angle and rate; radians; gravity with cos θ.
  turret,        ///< An arm about a vertical axis: angle and rate; radians; no gravity.
  roller,        ///< A flywheel that is slow, and moves what it touches: velocity; radians.
  swerve_steer,  ///< What turns a swerve module: a turret that turns endlessly.
  swerve_drive,  ///< A swerve module's wheel on the floor: velocity; metres; no gravity.
};

/// "flywheel", "elevator", "arm", "turret", "roller", "swerve steer", "swerve drive".
[[nodiscard]] std::string_view to_string(MechanismKind kind);

/// Reads those names (and "single-jointed arm", "simple"), in any case, with any or no sign between
/// their words.
/// @errors ArgumentError::unknown_name with the known kinds as hint.
[[nodiscard]] Expected<MechanismKind> parse_mechanism_kind(std::string_view text);

/// Whether the velocity is what is controlled, and the only state.
[[nodiscard]] constexpr bool controls_velocity(MechanismKind kind) noexcept {
  return kind == MechanismKind::flywheel || kind == MechanismKind::roller ||
         kind == MechanismKind::swerve_drive;
}

/// Whether gravity acts on it.
[[nodiscard]] constexpr bool has_gravity(MechanismKind kind) noexcept {
  return kind == MechanismKind::elevator || kind == MechanismKind::arm;
}

/// Whether angles a turn apart are one place of it: its way there may be the shorter one.
[[nodiscard]] constexpr bool turns_endlessly(MechanismKind kind) noexcept {
  return kind == MechanismKind::turret || kind == MechanismKind::swerve_steer;
}

/// The SI unit of a kind's position: "m" or "rad".
[[nodiscard]] std::string_view position_unit(MechanismKind kind);

}  // namespace flyball::mechanisms
