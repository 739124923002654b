#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include <flyball/core/expected.hpp>

namespace flyball::solve {

/// The JSON object that a text is.
/// @param where  The kind of problem or the file, for messages. @param what  "problem" or "model".
/// @errors ArgumentError::malformed: no JSON, with the place; no object; nesting that no problem
/// has.
[[nodiscard]] Expected<nlohmann::json> parse_object(std::string_view text, std::string_view where,
                                                    std::string_view what);

}  // namespace flyball::solve
