#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace flyball {

/// Where something stands in a text; both counted from 1, columns in characters.
struct Place {
  std::size_t line = 1;
  std::size_t column = 1;
};

/// How much a diagnostic matters.
enum class Severity { info, warning, error };

[[nodiscard]] std::string_view to_string(Severity severity);

/// Something worth telling about data that was still usable (or the reason why it was not).
struct Diagnostic {
  std::string code{};  ///< A stable snake_case identifier, such as "repeated_rows".
  Severity severity = Severity::info;
  std::string message{};  ///< One sentence: what was seen, how much of it, what was done about it.
  std::optional<Place> place{};  ///< In the file that it is about, if it is about a place.
};

}  // namespace flyball
