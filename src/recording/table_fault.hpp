#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <flyball/core/errors.hpp>

namespace flyball::recording {

/// The first cell at which a table of a motion goes wrong, with its line and column: one that is no
/// number, one too few in a row, a time that does not go on. Of columns that a motion has (time, x,
/// y, heading, …); nothing where no such cell is found. Cost: O(size).
[[nodiscard]] std::optional<QuotedError> table_fault(std::string_view text,
                                                     const std::string& source);

}  // namespace flyball::recording
