#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace flyball {

/// Levenshtein's distance: the fewest insertions, deletions and substitutions between two texts.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name nearest to a mistyped one, letters compared without case, or an empty text if none is
/// within a third of its length (at least two edits).
[[nodiscard]] std::string nearest_name(std::string_view wanted,
                                       std::span<const std::string_view> names);

}  // namespace flyball
