#pragma once

#include <string_view>

#include <flyball/core/expected.hpp>

#include "solve/json_tree.hpp"

namespace flyball::solve {

/// The JSON object that a text is.
/// @param where  The kind of problem or the file, for messages. @param what  "problem" or "model".
/// @errors ArgumentError::malformed: no JSON, with the place; no object; nesting that no problem
/// has.
[[nodiscard]] Expected<JsonTree> parse_object(std::string_view text, std::string_view where,
                                              std::string_view what);

}  // namespace flyball::solve
