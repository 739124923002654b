#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <flyball/core/diagnostic.hpp>

namespace flyball {

/// Line and column of a byte of a text. @param offset  In bytes; past the end is the end.
[[nodiscard]] Place place_of(std::string_view text, std::size_t offset);

/// A key that an object has again.
struct RepeatedKey {
  std::string key;
  std::size_t at = 0;  ///< The byte that the second begins at.
};

/// The first of them in a JSON text, also in one that is cut off; of two values that one key has a
/// reader would take either. Objects more than 64 brackets deep are not looked at.
/// Cost: O(size) and a copy of the keys.
[[nodiscard]] std::optional<RepeatedKey> repeated_key(std::string_view json);

/// A JSON text with what a terminal would obey in its strings (DEL, C1 controls, marks of the
/// direction of writing, byte order marks) as escapes: it reads as the same values.
[[nodiscard]] std::string json_escaped(std::string_view json);

/// A member of the outermost object as it is written; nothing where there is none.
/// @param json  A JSON object, which may be cut off: then so may be what is found.
[[nodiscard]] std::optional<std::string_view> written_member(std::string_view json,
                                                             std::string_view key);

/// The same, if it is a number, a word or a string.
/// @param json  A JSON object without a mistake.
[[nodiscard]] std::optional<std::string_view> scalar_member(std::string_view json,
                                                            std::string_view key);

}  // namespace flyball
