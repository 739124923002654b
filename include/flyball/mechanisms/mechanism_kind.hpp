#pragma once

#include <string_view>

#include <flyball/core/expected.hpp>

namespace flyball::mechanisms {

/// The one-degree-of-freedom mechanisms of sections 6.9 to 6.11.
enum class MechanismKind {
  flywheel,  ///< Theorem 6.10.1: velocity; radians; no gravity.
  elevator,  ///< Theorem 6.9.1: position and velocity; metres; constant gravity.
  arm,       ///< Theorem 6.11.1: angle and rate; radians; gravity with cos θ.
};

/// "flywheel", "elevator", "arm".
[[nodiscard]] std::string_view to_string(MechanismKind kind);

/// Reads "flywheel", "elevator", "arm" (and "single-jointed arm", "simple"), in any case.
/// @errors ArgumentError::unknown_name with the known kinds as hint.
[[nodiscard]] Expected<MechanismKind> parse_mechanism_kind(std::string_view text);

/// The SI unit of a kind's position: "m" or "rad".
[[nodiscard]] std::string_view position_unit(MechanismKind kind);

}  // namespace flyball::mechanisms
