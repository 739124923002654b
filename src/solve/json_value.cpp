#include <limits>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/text.hpp>
#include <flyball/io/json_writer.hpp>

#include "core/constants.hpp"
#include "solve/json_value.hpp"

namespace flyball::solve {

using Eigen::Index;

namespace {

/// A number, text or word as JSON has it.
std::string written(JsonValue value) {
  switch (value.type()) {
    case JsonType::number:
      return fmt::format("{}", value.number());
    case JsonType::string:
      return json_quoted(value.text());
    case JsonType::boolean:
      return value.number() != 0.0 ? "true" : "false";
    default:
      return "null";
  }
}

std::string_view name_of(JsonType type) {
  return type == JsonType::number    ? "number"
         : type == JsonType::string  ? "string"
         : type == JsonType::boolean ? "boolean"
                                     : "null";
}

/// "[0, 1]" and "[[0], [1]]" for a message, of long lists the first numbers.
std::pair<std::string, std::string> flat_and_column(JsonValue list) {
  constexpr std::size_t most = 4;
  std::string flat;
  std::string column;
  std::size_t i = 0;
  for (const JsonValue value : list) {
    const std::string separator = i == 0 ? "" : ", ";
    if (i++ == most) {
      flat += ", ...";
      column += ", ...";
      break;
    }
    const std::string entry = value.is_structured() ? kind_of(value) : written(value);
    flat += separator + entry;
    column += fmt::format("{}[{}]", separator, entry);
  }
  return {'[' + flat + ']', '[' + column + ']'};
}

}  // namespace

std::string kind_of(JsonValue value) {
  if (value.is_structured()) {
    return value.is_array() ? fmt::format("a list of {}", value.size()) : "an object";
  }
  return fmt::format("{} ({})", name_of(value.type()), cut(written(value), 40));
}

bool read_number(JsonValue value, double& number) {
  if (value.is_number()) {
    number = value.number();
    return true;
  }
  if (value.is_string()) {
    const std::string_view text = value.text();
    if (text == "inf" || text == "-inf") {
      number = text[0] == '-' ? -infinity : infinity;
      return true;
    }
    if (text == "nan") {
      number = std::numeric_limits<double>::quiet_NaN();
      return true;
    }
  }
  return false;
}

Verdict read_rows(JsonValue value, Eigen::MatrixXd& M) {
  constexpr const char* expected = "a list of rows of numbers, such as [[1, 0], [0, 1]]";
  double scalar = 0.0;
  if (read_number(value, scalar)) {
    M.setConstant(1, 1, scalar);
    return {};
  }
  if (!value.is_array()) {
    return Complaint{kind_of(value), expected};
  }
  const auto rows = static_cast<Index>(value.size());
  Index i = 0;
  for (const JsonValue row : value) {
    if (!row.is_array()) {
      double entry = 0.0;
      if (i == 0 && read_number(row, entry)) {
        const auto [flat, column] = flat_and_column(value);
        return Complaint{fmt::format("{}, without rows", flat),
                         fmt::format("a list of rows: {} is a column, [{}] a row", column, flat)};
      }
      return Complaint{fmt::format("{} as row {}", kind_of(row), i), expected};
    }
    const auto columns = static_cast<Index>(row.size());
    if (i == 0) {
      M.resize(rows, columns);
    } else if (columns != M.cols()) {
      return Complaint{fmt::format("{} numbers in row 0 and {} in row {}", M.cols(), columns, i),
                       "rows of one length"};
    }
    Index j = 0;
    for (const JsonValue entry : row) {
      if (!read_number(entry, M(i, j))) {
        return Complaint{fmt::format("{} as entry ({}, {})", kind_of(entry), i, j), "a number"};
      }
      ++j;
    }
    ++i;
  }
  return {};
}

Verdict read_column(JsonValue value, Eigen::MatrixXd& column) {
  if (!value.is_array()) {
    return Complaint{kind_of(value), "a list of numbers"};
  }
  column.resize(static_cast<Index>(value.size()), 1);
  Index i = 0;
  for (const JsonValue entry : value) {
    if (!read_number(entry, column(i, 0))) {
      return Complaint{fmt::format("{} as entry {}", kind_of(entry), i), "a number"};
    }
    ++i;
  }
  return {};
}

Verdict read_complex_list(JsonValue value, Eigen::VectorXcd& list) {
  constexpr const char* expected = "a list of numbers or of [re, im]";
  if (!value.is_array()) {
    return Complaint{kind_of(value), expected};
  }
  list.resize(static_cast<Index>(value.size()));
  Index i = 0;
  for (const JsonValue entry : value) {
    double re = 0.0;
    double im = 0.0;
    const bool pair = entry.is_array() && entry.size() == 2;
    const auto imaginary = [&] { return *++entry.begin(); };
    if (!(pair ? read_number(entry.front(), re) && read_number(imaginary(), im)
               : read_number(entry, re))) {
      return Complaint{fmt::format("{} as entry {}", kind_of(entry), i), expected};
    }
    list(i++) = {re, im};
  }
  return {};
}

Verdict read_texts(JsonValue value, std::vector<std::string>& texts) {
  bool all = value.is_array();
  for (const JsonValue entry : value) {
    all = all && entry.is_string();
    texts.emplace_back(all ? entry.text() : std::string_view());
  }
  if (!all) {
    return Complaint{kind_of(value), "a list of texts, such as [\"position\", \"velocity\"]"};
  }
  return {};
}

}  // namespace flyball::solve
