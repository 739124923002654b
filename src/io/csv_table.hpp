#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>

/// Text into rows of cells; private to io.
namespace flyball::io {

struct CsvTable {
  char delimiter = ',';
  std::vector<std::vector<std::string>> rows;  ///< Without blank lines and lines of '#'.
  std::vector<std::size_t> lines;              ///< The line that each row began on, from 1.
};

/// Splits text by RFC 4180, leniently: the delimiter is told from the first line, line ends may be
/// LF, CRLF or CR, a quote in the middle of a cell is a character like others.
///
/// Debian ships no header-only CSV reader that tells delimiters and decimal commas apart; the
/// hundred lines that it takes are ours.
/// @errors LogError::malformed for a quote that is never closed.
[[nodiscard]] Expected<CsvTable> split_csv(std::string_view text, const std::string& source);

}  // namespace flyball::io
