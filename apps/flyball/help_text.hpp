#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace flyball::app {

/// The help of CLI11, whose entries have their name in the first 30 bytes of a line and what it
/// means behind it, with that folded at a width, and paragraphs of which a line is wider; lines
/// that are indented stay. Names that are not ASCII are as wide as they look. @param width Columns;
/// below 60 what an entry means stands under its name.
[[nodiscard]] std::string folded_help(std::string_view help, std::size_t width);

}  // namespace flyball::app
