#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace flyball::report {

/// What a terminal shows: code points, which is what our texts are made of.
[[nodiscard]] std::size_t display_width(std::string_view text);

/// Broken at spaces into lines of at most `width`; a word that is longer stands alone.
[[nodiscard]] std::vector<std::string> wrap(std::string_view text, std::size_t width);

/// & < > " ' as entities and control characters as a replacement mark: text from a log cannot
/// become markup.
[[nodiscard]] std::string escape_html(std::string_view text);

}  // namespace flyball::report
