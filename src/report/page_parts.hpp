#pragma once

#include <string_view>

namespace flyball::report {

/// What a page is dressed in: src/report/page, and dygraphs as Debian has it (libjs-dygraphs).
extern const std::string_view page_style;   ///< Contrast of text at least 4.5 in both schemes.
extern const std::string_view page_script;  ///< Plots, and buttons to copy code.
extern const std::string_view dygraphs_script;

}  // namespace flyball::report
