#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/text.hpp>

#include "solve/json_value.hpp"

namespace flyball::solve {

using Eigen::Index;
using Json = nlohmann::json;

namespace {

/// "[0, 1]" and "[[0], [1]]" for a message, of long lists the first numbers.
std::pair<std::string, std::string> flat_and_column(const Json& list) {
  constexpr std::size_t most = 4;
  std::string flat;
  std::string column;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string separator = i == 0 ? "" : ", ";
    if (i == most) {
      flat += ", ...";
      column += ", ...";
      break;
    }
    const std::string entry = list[i].is_structured() ? kind_of(list[i]) : list[i].dump();
    flat += separator + entry;
    column += fmt::format("{}[{}]", separator, entry);
  }
  return {'[' + flat + ']', '[' + column + ']'};
}

}  // namespace

std::string kind_of(const Json& value) {
  if (value.is_structured()) {
    return value.is_array() ? fmt::format("a list of {}", value.size()) : "an object";
  }
  const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  return fmt::format("{} ({})", value.type_name(), cut(text, 40));
}

bool read_number(const Json& value, double& number) {
  if (value.is_number()) {
    number = value.get<double>();
    return true;
  }
  if (value.is_string()) {
    const std::string& text = value.get_ref<const std::string&>();
    constexpr double infinity = std::numeric_limits<double>::infinity();
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

Verdict read_rows(const Json& value, Eigen::MatrixXd& M) {
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
  for (Index i = 0; i < rows; ++i) {
    const Json& row = value[static_cast<std::size_t>(i)];
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
    for (Index j = 0; j < columns; ++j) {
      const Json& entry = row[static_cast<std::size_t>(j)];
      if (!read_number(entry, M(i, j))) {
        return Complaint{fmt::format("{} as entry ({}, {})", kind_of(entry), i, j), "a number"};
      }
    }
  }
  return {};
}

Verdict read_column(const Json& value, Eigen::MatrixXd& column) {
  if (!value.is_array()) {
    return Complaint{kind_of(value), "a list of numbers"};
  }
  column.resize(static_cast<Index>(value.size()), 1);
  for (Index i = 0; i < column.rows(); ++i) {
    const Json& entry = value[static_cast<std::size_t>(i)];
    if (!read_number(entry, column(i, 0))) {
      return Complaint{fmt::format("{} as entry {}", kind_of(entry), i), "a number"};
    }
  }
  return {};
}

Verdict read_complex_list(const Json& value, Eigen::VectorXcd& list) {
  constexpr const char* expected = "a list of numbers or of [re, im]";
  if (!value.is_array()) {
    return Complaint{kind_of(value), expected};
  }
  list.resize(static_cast<Index>(value.size()));
  for (Index i = 0; i < list.size(); ++i) {
    const Json& entry = value[static_cast<std::size_t>(i)];
    double re = 0.0;
    double im = 0.0;
    const bool pair = entry.is_array() && entry.size() == 2;
    if (!(pair ? read_number(entry[0], re) && read_number(entry[1], im) : read_number(entry, re))) {
      return Complaint{fmt::format("{} as entry {}", kind_of(entry), i), expected};
    }
    list(i) = {re, im};
  }
  return {};
}

Verdict read_texts(const Json& value, std::vector<std::string>& texts) {
  if (!value.is_array() || !std::all_of(value.begin(), value.end(),
                                        [](const Json& entry) { return entry.is_string(); })) {
    return Complaint{kind_of(value), "a list of texts, such as [\"position\", \"velocity\"]"};
  }
  texts = value.get<std::vector<std::string>>();
  return {};
}

}  // namespace flyball::solve
