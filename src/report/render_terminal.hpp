#pragma once

#include <string>
#include <string_view>

#include <flyball/report/terminal.hpp>

#include "report/document.hpp"

namespace flyball::report {

/// A table as aligned text, each line indented by two spaces.
[[nodiscard]] std::string render_table(const Table& table, const TerminalStyle& style);

/// The whole document. @param report_folder  Named at the end, if not empty.
[[nodiscard]] std::string render_terminal(const Document& document, const TerminalStyle& style,
                                          std::string_view report_folder);

}  // namespace flyball::report
