#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball {

/// A table of numbers without a fixed header, row by row.
struct NumberTable {
  std::vector<std::vector<double>> rows{};
  std::vector<int> lines{};  ///< Of each row, from 1.
  int cut_line = 0;          ///< The last line, where the text ends within it; 0: it does not.
};

/// Reads rows of numbers: separated by blanks, tabs, commas or semicolons; lines that are empty,
/// begin with '#' or '%', or are words before the first row are left out, and so is a last line
/// that the text ends in the middle of.
/// @param columns  How many numbers each row has at least; what follows is left out.
/// @errors LogError::malformed with the line: fewer numbers, words, what is not finite;
///         LogError::no_data without a row.
[[nodiscard]] Expected<NumberTable> parse_number_table(std::string_view text,
                                                       const std::string& source,
                                                       std::size_t columns);

}  // namespace flyball
