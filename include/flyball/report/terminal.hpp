#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <flyball/core/document.hpp>

namespace flyball::report {

/// How a terminal is written to.
struct TerminalStyle {
  bool color = false;       ///< ANSI colours; without them the text has no escape byte.
  std::size_t width = 100;  ///< Columns; tables and sentences are folded to it.
  bool ascii = false;       ///< Nothing but ASCII, for a terminal that shows no more.
};

/// A document as text for a terminal: the verdict with its reasons, then facts and tables. A
/// table that is wider than the terminal is folded: its first column again beside each part. UTF-8;
/// control characters that a log brought are shown as '?'. A title that is empty has no line.
/// @param report_folder  Where the report was written; empty if nowhere.
[[nodiscard]] std::string to_terminal(const Document& document, const TerminalStyle& style = {},
                                      std::string_view report_folder = {});

}  // namespace flyball::report
