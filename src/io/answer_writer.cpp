#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "io/answer_writer.hpp"
#include "io/json.hpp"

namespace flyball {

using Json = nlohmann::json;

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

void AnswerWriter::matrix(const Eigen::MatrixXd& M) {
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

void AnswerWriter::add(std::string_view name, const Eigen::MatrixXd& M) {
  key(name);
  matrix(M);
}

void AnswerWriter::add_list(std::string_view name, const std::vector<Eigen::MatrixXd>& matrices) {
  key(name);
  text_ += '[';
  for (std::size_t k = 0; k < matrices.size(); ++k) {
    text_ += k == 0 ? "" : ",";
    matrix(matrices[k]);
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

void AnswerWriter::add_text(std::string_view name, std::string_view text) {
  add_json(name, dump(std::string(text)));
}

void AnswerWriter::add_json(std::string_view name, const std::string& json) {
  key(name);
  text_ += json;
}

void AnswerWriter::add(const Error& error) {
  add_json("error", dump(json_of(error)));
}

std::string AnswerWriter::end() {
  text_ += '}';
  return std::move(text_);
}

}  // namespace flyball
