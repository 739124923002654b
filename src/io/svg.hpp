#pragma once

#include <string_view>

namespace flyball::io {

/// Whether a text is one `<svg>` element that only draws: shapes and texts, each closed where it
/// should be, without scripts, handlers of events, styles, comments and links that lead elsewhere.
/// Such a text may stand in a page as it is. Private to io.
[[nodiscard]] bool is_plain_svg(std::string_view text);

}  // namespace flyball::io
