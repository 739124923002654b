#include <flyball/io/number_table.hpp>

#include <cmath>

#include <fmt/format.h>

#include <flyball/io/log_error.hpp>

#include "core/try.hpp"
#include "io/text.hpp"

namespace flyball {

namespace {

constexpr std::string_view separators = " \t,;";

/// The next cell of a line, which it is cut from.
std::string_view next_cell(std::string_view& line) {
  const std::size_t begin = std::min(line.find_first_not_of(separators), line.size());
  const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
  const std::string_view cell = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return cell;
}

}  // namespace

Expected<NumberTable> parse_number_table(std::string_view text, const std::string& source,
                                         std::size_t columns) {
  NumberTable table;
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) {
    text.remove_prefix(byte_order_mark.size());
  }
  int number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    const bool ended = end < text.size();
    std::string_view line = io::trim(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.front() == '#' || line.front() == '%') {
      continue;
    }
    const std::string_view whole = line;
    std::vector<double> row;
    bool words = false;
    bool cut = !ended && !table.rows.empty();
    while (row.size() < columns) {
      const std::string_view cell = next_cell(line);
      if (cell.empty()) {
        break;
      }
      const auto value = io::parse_number(cell);
      if (!value || !std::isfinite(*value)) {
        words = true;
        cut = cut && cell.find_first_not_of("+-.0123456789eE") == std::string_view::npos;
        break;
      }
      row.push_back(*value);
    }
    if (row.empty() && words && table.rows.empty()) {
      continue;  // The header.
    }
    if (row.size() < columns && cut && line.empty()) {
      table.cut_line = number;
      break;
    }
    if (row.size() < columns) {
      return refusal(LogError::malformed, fmt::format("{}:{}", source, number), "the row")
          .got("\"" + io::printable(whole) + "\"")
          .expected(fmt::format("{} finite numbers, separated by blanks, tabs or commas", columns));
    }
    table.rows.push_back(std::move(row));
    table.lines.push_back(number);
  }
  if (table.rows.empty()) {
    return refusal(LogError::no_data, source, "the table")
        .got("no row of numbers")
        .expected(fmt::format("rows of {} numbers", columns));
  }
  return table;
}

}  // namespace flyball
