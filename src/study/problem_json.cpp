#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "study/problem_json.hpp"

namespace flyball::study {

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

}  // namespace

void ProblemReader::fail(const char* name, std::string got, std::string expected) {
  if (status_) {
    status_ = tl::unexpected(Error(ArgumentError::malformed)
                                 .in(std::string(kind_))
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
      fail(name, fmt::format("{} as row {}", kind_of(row), i), expected);
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

void AnswerWriter::begin(const Json* id) {
  text_ = "{";
  empty_ = true;
  if (id != nullptr) {
    key("id");
    text_ += id->dump(-1, ' ', false, Json::error_handler_t::replace);
  }
}

void AnswerWriter::key(std::string_view name) {
  if (!empty_) {
    text_ += ',';
  }
  empty_ = false;
  text_ += '"';
  text_ += name;
  text_ += "\":";
}

void AnswerWriter::number(double value) {
  if (std::isfinite(value)) {
    fmt::format_to(std::back_inserter(text_), "{}", value);
  } else {
    text_ += std::isnan(value) ? "null" : value > 0.0 ? "\"inf\"" : "\"-inf\"";
  }
}

void AnswerWriter::add(std::string_view name, const Eigen::MatrixXd& M) {
  key(name);
  text_ += '[';
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    text_ += i == 0 ? "[" : ",[";
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      if (j > 0) {
        text_ += ',';
      }
      number(M(i, j));
    }
    text_ += ']';
  }
  text_ += ']';
}

void AnswerWriter::add(std::string_view name, const Eigen::VectorXcd& values) {
  key(name);
  text_ += '[';
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    text_ += i == 0 ? "[" : ",[";
    number(values(i).real());
    text_ += ',';
    number(values(i).imag());
    text_ += ']';
  }
  text_ += ']';
}

void AnswerWriter::add_list(std::string_view name, const Eigen::VectorXd& values) {
  key(name);
  text_ += '[';
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (i > 0) {
      text_ += ',';
    }
    number(values(i));
  }
  text_ += ']';
}

void AnswerWriter::add(std::string_view name, double value) {
  key(name);
  number(value);
}

void AnswerWriter::add(std::string_view name, bool value) {
  key(name);
  text_ += value ? "true" : "false";
}

void AnswerWriter::add_json(std::string_view name, const std::string& json) {
  key(name);
  text_ += json;
}

void AnswerWriter::add(const Error& error) {
  nlohmann::ordered_json json = {{"code", std::string(error.code())},
                                 {"message", to_string(error)}};
  const auto plain = [](double value) -> nlohmann::ordered_json {
    if (std::isfinite(value)) {
      return value;
    }
    return std::isnan(value) ? nlohmann::ordered_json(nullptr)
                             : nlohmann::ordered_json(value > 0.0 ? "inf" : "-inf");
  };
  for (const Evidence& evidence : error.evidence()) {
    if (json.contains(evidence.name)) {
      continue;
    }
    if (evidence.values.size() == 1) {
      json[evidence.name] = plain(evidence.values.front());
    } else if (evidence.values.empty()) {
      json[evidence.name] = evidence.text;
    } else {
      for (const double value : evidence.values) {
        json[evidence.name].push_back(plain(value));
      }
    }
  }
  add_json("error", json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

std::string AnswerWriter::end() {
  text_ += '}';
  return std::move(text_);
}

}  // namespace flyball::study
