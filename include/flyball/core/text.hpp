#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace flyball {

/// At most that many characters of a UTF-8 text, whole ones; "…" says that there were more.
[[nodiscard]] std::string cut(std::string_view text, std::size_t most);

/// Control characters (among them the escape that colours a terminal) as '?', except the newline,
/// and what is not UTF-8 as U+FFFD.
[[nodiscard]] std::string printable(std::string_view text);

/// A UTF-8 text in ASCII, for a terminal that shows nothing else: "m/s^2", "+-", "Ohm", "sigma";
/// '?' for what has no such spelling.
[[nodiscard]] std::string ascii(std::string_view text);

/// A message, printable, in which what it quotes is cut to 80 characters, a word of 240 or more to
/// its two ends, and the whole to 4000: what comes from outside may be of any length.
[[nodiscard]] std::string shortened(std::string_view message);

/// Levenshtein's distance: the fewest insertions, deletions and substitutions between two texts.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name nearest to a mistyped one, letters compared without case, or an empty text if none is
/// within a third of its length (at least two edits).
[[nodiscard]] std::string nearest_name(std::string_view wanted,
                                       std::span<const std::string_view> names);

}  // namespace flyball
