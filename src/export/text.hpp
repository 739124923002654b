#pragma once

#include <string>
#include <string_view>

#include <flyball/mechanisms/mechanism_kind.hpp>

/// Pieces of text that the sources of all languages are made of.
namespace flyball::exports {

/// A number as source code: its digits, with a decimal point or an exponent ("12.0", never "12").
/// @param digits  Significant ones; 0 for as many as it takes to read back the same double.
[[nodiscard]] std::string literal(double value, int digits = 0);

/// "Elevator", "SwerveSteer".
[[nodiscard]] std::string capitalized(mechanisms::MechanismKind kind);

/// One line that cannot end a comment, whatever a log says: no line break, no control character, no
/// backslash.
[[nodiscard]] std::string comment_text(std::string_view text);

}  // namespace flyball::exports
