#include <flyball/io/json_writer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/io/json_text.hpp>

namespace flyball {

namespace {

void append_number(std::string& text, double value) {
  std::array<char, 32> digits;  // at most 24: "-2.2250738585072014e-308"
  const char* const end = fmt::format_to(digits.data(), "{}", value);
  text.append(static_cast<const char*>(digits.data()), end);
  const auto is_mark = [](char c) { return c == '.' || c == 'e'; };
  if (std::none_of(static_cast<const char*>(digits.data()), end, is_mark)) {
    text += ".0";
  }
}

void append_quoted(std::string& text, std::string_view value) {
  const bool plain = std::all_of(value.begin(), value.end(), [](char c) {
    return c >= ' ' && c < '\x7F' && c != '"' && c != '\\';
  });
  if (plain) {
    text += '"';
    text += value;
    text += '"';
  } else {
    text += json_escaped(
        nlohmann::json(value).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
}

}  // namespace

std::string json_number(double value) {
  std::string text;
  append_number(text, value);
  return text;
}

std::string json_quoted(std::string_view text) {
  std::string quoted;
  append_quoted(quoted, text);
  return quoted;
}

std::string refusal_json(std::string_view schema, const Errors& errors) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", schema);
    json.add("error", errors.all().front());
    if (errors.all().size() > 1) {
      json.add("errors", errors.all());
    }
    json.add("diagnostics", errors.diagnostics());
  });
  return std::move(json).text();
}

void JsonWriter::separate() {
  if (!text_.empty() && text_.back() != '{' && text_.back() != '[' && text_.back() != ':') {
    text_ += ',';
  }
}

void JsonWriter::key(std::string_view name) {
  separate();
  append_quoted(text_, name);
  text_ += ':';
}

void JsonWriter::open(char bracket) {
  separate();
  text_ += bracket;
}

void JsonWriter::write_json(std::string_view json) {
  separate();
  text_ += json;
}

void JsonWriter::write(double value) {
  separate();
  if (std::isfinite(value)) {
    append_number(text_, value);
  } else {
    all_finite_ = false;
    text_ += std::isnan(value) ? "null" : value > 0.0 ? "\"inf\"" : "\"-inf\"";
  }
}

void JsonWriter::write(std::string_view text) {
  separate();
  append_quoted(text_, text);
}

void JsonWriter::write(const Eigen::MatrixXd& M) {
  open('[');
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    open('[');
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      write(M(i, j));
    }
    close(']');
  }
  close(']');
}

void JsonWriter::write(std::span<const double> values) {
  list(values, [this](double value) { write(value); });
}

void JsonWriter::write(const Eigen::VectorXd& values) {
  write(std::span<const double>(values.data(), static_cast<std::size_t>(values.size())));
}

void JsonWriter::write(const Eigen::VectorXcd& values) {
  list(values, [this](const std::complex<double>& value) {
    open('[');
    write(value.real());
    write(value.imag());
    close(']');
  });
}

void JsonWriter::write(const Coordinate& coordinate) {
  object([&] {
    add("name", coordinate.name);
    add("unit", coordinate.unit);
  });
}

void JsonWriter::add(const std::optional<Place>& place) {
  if (place) {
    add("line", place->line);
    add("column", place->column);
  }
}

void JsonWriter::write(const Error& error, const std::optional<Place>& place) {
  object([&] {
    std::vector<std::string_view> names{"code", "message"};
    add("code", error.code());
    add("message", to_string(error));
    if (place) {
      add(place);
      names.insert(names.end(), {"line", "column"});
    }
    for (const Evidence& evidence : error.evidence()) {
      if (std::find(names.begin(), names.end(), evidence.name) != names.end()) {
        continue;
      }
      names.push_back(evidence.name);
      if (evidence.values.empty()) {
        add(evidence.name, evidence.text);
      } else if (evidence.values.size() == 1) {
        add(evidence.name, evidence.values.front());
      } else {
        add(evidence.name, evidence.values);
      }
    }
  });
}

void JsonWriter::write(const Diagnostic& diagnostic) {
  object([&] {
    add("code", diagnostic.code);
    add("severity", to_string(diagnostic.severity));
    add("message", diagnostic.message);
    add(diagnostic.place);
  });
}

}  // namespace flyball
