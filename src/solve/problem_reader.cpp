#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>

#include "solve/problem_reader.hpp"

namespace flyball::solve {

namespace {

using Json = nlohmann::json;

/// What stands there, in a few words; lists and objects may be of any size.
std::string kind_of(const Json& value) {
  if (value.is_structured()) {
    return value.is_array() ? fmt::format("a list of {}", value.size()) : "an object";
  }
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > 40) {
    text = text.substr(0, 37) + "...";
  }
  return fmt::format("{} ({})", value.type_name(), text);
}

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> list;
  while (!text.empty()) {
    const std::size_t space = text.find(' ');
    list.push_back(text.substr(0, space));
    text = space == std::string_view::npos ? std::string_view() : text.substr(space + 1);
  }
  return list;
}

bool contains(std::string_view list, std::string_view word) {
  while (!list.empty()) {
    const std::size_t space = list.find(' ');
    if (list.substr(0, space) == word) {
      return true;
    }
    list = space == std::string_view::npos ? std::string_view() : list.substr(space + 1);
  }
  return false;
}

/// Brackets of a text that are open at once, strings left out. Writing a value (an id) recurses.
int depth_of(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool quoted = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (quoted) {
      if (c == '\\') {
        ++k;
      } else if (c == '"') {
        quoted = false;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++depth);
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return deepest;
}

Error malformed(std::string_view where, std::string_view what, std::string got,
                std::string expected) {
  return Error(ArgumentError::malformed)
      .in(std::string(where))
      .about("the " + std::string(what))
      .got(std::move(got))
      .expected(std::move(expected));
}

/// What is wrong at a byte, counted from 1 and one past the end for a text that ends too soon.
std::string complaint(std::string_view text, std::size_t byte) {
  if (byte > text.size()) {
    return text.find_first_not_of(" \t\r\n") == std::string_view::npos ? "empty" : "cut off";
  }
  const std::string_view before = text.substr(0, byte - 1);
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t column = before.size() - (before.rfind('\n') + 1) + 1;
  return line == 1 ? fmt::format("not JSON from character {} on", column)
                   : fmt::format("not JSON from line {}, character {} on", line, column);
}

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

Expected<Json> parse_object(std::string_view text, std::string_view where, std::string_view what) {
  constexpr int deepest = 64;
  if (const int depth = depth_of(text); depth > deepest) {
    return tl::unexpected(malformed(where, what,
                                    fmt::format("{} brackets within each other", depth),
                                    fmt::format("at most {}", deepest)));
  }
  constexpr const char* example = "one JSON object, such as {\"A\": [[0, 1], [0, -2]], …}";
  try {
    Json object = Json::parse(text);
    if (!object.is_object()) {
      return tl::unexpected(malformed(where, what, kind_of(object), example));
    }
    return object;
  } catch (const Json::parse_error& problem) {
    return tl::unexpected(malformed(where, what, complaint(text, problem.byte), example));
  } catch (const Json::exception&) {
    return tl::unexpected(malformed(where, what, "not to be read: a number is beyond 1.8e308",
                                    "numbers that a double holds"));
  }
}

Expected<void> check_fields(const Json& object, std::string_view where, std::string_view required,
                            std::string_view optional) {
  for (const auto& [name, value] : object.items()) {
    if (name == "id" || contains(required, name) || contains(optional, name)) {
      continue;
    }
    std::vector<std::string_view> known = words(required);
    const std::vector<std::string_view> more = words(optional);
    known.insert(known.end(), more.begin(), more.end());
    const std::string nearest = nearest_name(name, known);
    return tl::unexpected(
        Error(ArgumentError::unknown_name)
            .in(std::string(where))
            .about("field")
            .got("\"" + name.substr(0, 40) + "\"")
            .expected(fmt::format("one of {}", fmt::join(known, ", ")))
            .hint(nearest.empty() ? "take it out" : "did you mean \"" + nearest + "\"?"));
  }
  for (const std::string_view name : words(required)) {
    const auto found = object.find(name);
    if (found == object.end() || found->is_null()) {
      return tl::unexpected(
          Error(ArgumentError::malformed)
              .in(std::string(where))
              .about(std::string(name))
              .got("left out")
              .expected(fmt::format("there, as are all of {}", fmt::join(words(required), ", "))));
    }
  }
  return {};
}

void ProblemReader::fail(const char* name, std::string got, std::string expected) {
  if (status_) {
    status_ = tl::unexpected(Error(ArgumentError::malformed)
                                 .in(std::string(where_))
                                 .about(name)
                                 .got(std::move(got))
                                 .expected(std::move(expected)));
  }
}

bool ProblemReader::has(const char* name) const {
  const auto found = object_.find(name);
  return found != object_.end() && !found->is_null();
}

bool ProblemReader::read(const Json& value, double& number) {
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

Eigen::MatrixXd ProblemReader::matrix(const char* name) {
  const Json& value = object_.at(name);
  Eigen::MatrixXd M;
  double scalar = 0.0;
  if (read(value, scalar)) {
    return Eigen::MatrixXd::Constant(1, 1, scalar);
  }
  constexpr const char* expected = "a list of rows of numbers, such as [[1, 0], [0, 1]]";
  if (!value.is_array()) {
    fail(name, kind_of(value), expected);
    return M;
  }
  const auto rows = static_cast<Eigen::Index>(value.size());
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Json& row = value[static_cast<std::size_t>(i)];
    if (!row.is_array()) {
      double entry = 0.0;
      if (i == 0 && read(row, entry)) {
        const auto [list, column] = flat_and_column(value);
        fail(name, fmt::format("{}, without rows", list),
             fmt::format("a list of rows: {} is a column, [{}] a row", column, list));
      } else {
        fail(name, fmt::format("{} as row {}", kind_of(row), i), expected);
      }
      return {};
    }
    const auto columns = static_cast<Eigen::Index>(row.size());
    if (i == 0) {
      M.resize(rows, columns);
    } else if (columns != M.cols()) {
      fail(name, fmt::format("{} numbers in row 0 and {} in row {}", M.cols(), columns, i),
           "rows of one length");
      return {};
    }
    for (Eigen::Index j = 0; j < columns; ++j) {
      const Json& entry = row[static_cast<std::size_t>(j)];
      if (!read(entry, M(i, j))) {
        fail(name, fmt::format("{} as entry ({}, {})", kind_of(entry), i, j), "a number");
        return {};
      }
    }
  }
  return M;
}

Eigen::MatrixXd ProblemReader::columns(const char* name) {
  const Json& value = object_.at(name);
  if (!value.is_array() || value.empty() || value.front().is_array()) {
    return matrix(name);
  }
  Eigen::MatrixXd column(static_cast<Eigen::Index>(value.size()), 1);
  for (Eigen::Index i = 0; i < column.rows(); ++i) {
    const Json& entry = value[static_cast<std::size_t>(i)];
    if (!read(entry, column(i, 0))) {
      fail(name, fmt::format("{} as entry {}", kind_of(entry), i), "a number");
      return {};
    }
  }
  return column;
}

Eigen::MatrixXd ProblemReader::matrix_or_zero(const char* name, Eigen::Index rows,
                                              Eigen::Index columns) {
  return has(name) ? matrix(name) : Eigen::MatrixXd(Eigen::MatrixXd::Zero(rows, columns));
}

Eigen::MatrixXd ProblemReader::matrix_or_identity(const char* name, Eigen::Index size) {
  return has(name) ? matrix(name) : Eigen::MatrixXd(Eigen::MatrixXd::Identity(size, size));
}

double ProblemReader::number(const char* name) {
  double value = 0.0;
  if (!read(object_.at(name), value)) {
    fail(name, kind_of(object_.at(name)), "a number");
  }
  return value;
}

std::string ProblemReader::text(const char* name) {
  const Json& value = object_.at(name);
  if (!value.is_string()) {
    fail(name, kind_of(value), "a text");
    return {};
  }
  return value.get<std::string>();
}

std::vector<std::string> ProblemReader::names(const char* name) {
  std::vector<std::string> list;
  if (!has(name)) {
    return list;
  }
  const Json& value = object_.at(name);
  const bool texts = value.is_array() && std::all_of(value.begin(), value.end(),
                                                     [](const Json& n) { return n.is_string(); });
  if (!texts) {
    fail(name, kind_of(value), "a list of texts, such as [\"position\", \"velocity\"]");
    return list;
  }
  return value.get<std::vector<std::string>>();
}

TimeDomain ProblemReader::domain(const char* name) {
  const std::string text = this->text(name);
  if (status_ && text != "continuous" && text != "discrete") {
    status_ = tl::unexpected(Error(ArgumentError::unknown_name)
                                 .in(std::string(where_))
                                 .about(name)
                                 .got("\"" + text.substr(0, 40) + "\"")
                                 .expected("\"continuous\" or \"discrete\""));
  }
  return text == "discrete" ? TimeDomain::discrete : TimeDomain::continuous;
}

ContinuousSystem<> ProblemReader::system() {
  ContinuousSystem<> system;
  system.A = matrix("A");
  system.B = matrix("B");
  system.C = matrix_or_identity("C", system.A.rows());
  system.D = matrix_or_zero("D", system.C.rows(), system.B.cols());
  return system;
}

Eigen::VectorXcd ProblemReader::complex_list(const char* name) {
  constexpr const char* expected = "a list of numbers or of [re, im]";
  const Json& value = object_.at(name);
  if (!value.is_array()) {
    fail(name, kind_of(value), expected);
    return {};
  }
  Eigen::VectorXcd list(static_cast<Eigen::Index>(value.size()));
  for (Eigen::Index i = 0; i < list.size(); ++i) {
    const Json& entry = value[static_cast<std::size_t>(i)];
    double re = 0.0;
    double im = 0.0;
    const bool pair = entry.is_array() && entry.size() == 2;
    if (!(pair ? read(entry[0], re) && read(entry[1], im) : read(entry, re))) {
      fail(name, fmt::format("{} as entry {}", kind_of(entry), i), expected);
      return {};
    }
    list(i) = {re, im};
  }
  return list;
}

}  // namespace flyball::solve
