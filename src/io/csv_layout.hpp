#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>

/// What the beginning of a table tells of the whole; private to io.
namespace flyball::io {

struct CsvLayout {
  struct Column {
    std::string name;
    std::string unit;
    bool text = false;  ///< Words, as far as the beginning tells.
  };
  char delimiter = ',';
  std::size_t clock = 0;  ///< The column of time.
  double scale = 1.0;     ///< s a unit of it.
  std::vector<Column> columns{};
  std::vector<Diagnostic> diagnostics{};
};

/// @param head  The first lines, whole. @return Nothing for a table that has to be read whole.
/// @errors As `parse_csv`.
[[nodiscard]] Expected<std::optional<CsvLayout>> csv_layout(std::string_view head,
                                                            const std::string& source);

/// A number as most tables have them, without blank space; nothing for all else.
[[nodiscard]] std::optional<double> plain_number(std::string_view cell);
/// A cell's value: a number, or true and false as 1 and 0.
[[nodiscard]] std::optional<double> cell_number(std::string_view cell);
/// Whether a cell is one in which loggers write that there is no value.
[[nodiscard]] bool is_blank_cell(std::string_view cell);

}  // namespace flyball::io
