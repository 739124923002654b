#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/recording/trajectory_file.hpp>

#include "recording/table_fault.hpp"

namespace flyball::recording {

namespace {

std::string_view bare(std::string_view cell) {
  constexpr std::string_view blanks = " \t\r\"";
  const std::size_t from = cell.find_first_not_of(blanks);
  return from == std::string_view::npos
             ? std::string_view()
             : cell.substr(from, cell.find_last_not_of(blanks) - from + 1);
}

std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  std::size_t from = 0;
  while (true) {
    const std::size_t to = line.find(separator, from);
    cells.push_back(line.substr(from, to - from));
    if (to == std::string_view::npos) {
      return cells;
    }
    from = to + 1;
  }
}

/// "x" of "X (m)"; empty for a column that no motion has.
std::string name_of(std::string_view cell) {
  constexpr std::array<std::string_view, 11> known{"time", "t",     "x",  "y",  "heading", "vx",
                                                   "vy",   "omega", "ax", "ay", "alpha"};
  const std::string_view plain = bare(cell);
  std::string name(bare(plain.substr(0, plain.find_first_of("(["))));
  std::transform(name.begin(), name.end(), name.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return std::find(known.begin(), known.end(), name) != known.end() ? name : "";
}

std::optional<double> number_of(std::string_view cell, char separator) {
  std::string text(bare(cell));
  if (separator != ',') {
    std::replace(text.begin(), text.end(), ',', '.');
  }
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  const bool whole = !text.empty() && end == text.c_str() + text.size() && std::isfinite(value);
  return whole ? std::optional(value) : std::nullopt;
}

}  // namespace

std::optional<QuotedError> table_fault(std::string_view text, const std::string& source) {
  std::vector<std::string> names;
  char separator = ',';
  std::optional<double> before;
  std::size_t number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    begin = end + 1;
    ++number;
    if (bare(line).empty() || bare(line).front() == '#') {
      continue;
    }
    const auto fault = [&](std::string_view cell, Error error) {
      const auto offset = static_cast<std::size_t>(cell.data() - line.data());
      const Place place{number, offset + 1};
      QuotedError quoted{
          std::move(error).in(fmt::format("{}:{}:{}", source, place.line, place.column)),
          {},
          place};
      if (line.size() < 80 && printable(line) == line) {
        quoted.excerpt =
            fmt::format("{:>5} | {}\n{:>5} | {}{}", number, line, "", std::string(offset, ' '),
                        std::string(std::max<std::size_t>(cell.size(), 1), '^'));
      }
      return quoted;
    };
    if (names.empty()) {
      for (const char one : {';', '\t'}) {
        separator = std::count(line.begin(), line.end(), one) >
                            std::count(line.begin(), line.end(), separator)
                        ? one
                        : separator;
      }
      for (const std::string_view cell : cells_of(line, separator)) {
        names.push_back(name_of(cell));
      }
      continue;
    }
    const std::vector<std::string_view> cells = cells_of(line, separator);
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (names[k].empty()) {
        continue;
      }
      if (k >= cells.size()) {
        return fault(line,
                     Error(TrajectoryFileError::wrong_sample)
                         .about("the row")
                         .got(fmt::format("of {} cells", cells.size()))
                         .expected(fmt::format("of {}, a number in each column", names.size())));
      }
      const std::string_view cell = bare(cells[k]).empty() ? cells[k] : bare(cells[k]);
      const std::optional<double> value = number_of(cell, separator);
      if (!value) {
        return fault(cell, Error(TrajectoryFileError::wrong_sample)
                               .about(names[k])
                               .got(fmt::format("\"{}\"", cut(printable(bare(cell)), 40)))
                               .expected("a number"));
      }
      if (names[k] != "time" && names[k] != "t") {
        continue;
      }
      if (before && !(*value > *before)) {
        return fault(cell, Error(TrajectoryFileError::time_order)
                               .about(names[k])
                               .got(format_number(*value) + " s")
                               .expected(fmt::format("more than the {} s of the row before it",
                                                     format_number(*before))));
      }
      before = value;
    }
  }
  return std::nullopt;
}

}  // namespace flyball::recording
