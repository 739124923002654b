#pragma once

#include <concepts>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/coordinate.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>

namespace flyball {

/// One JSON text on one line, written from left to right: what every answer of Flyball is written
/// with (docs/schemas.md).
///
/// A double is the shortest text that reads back to it and always has a point or an exponent, so
/// that it stays a floating-point number in every reader; infinity is "inf" or "-inf", what is not
/// a number null. A matrix is a list of rows, a vector a list, a complex number [re, im]. Bytes
/// that are not UTF-8, which logs and problems may bring, are replaced by U+FFFD.
///
/// ```
/// JsonWriter json;
/// json.object([&] {
///   json.add("K", K);
///   json.list("points", points, [&](const Point& p) { json.object([&] { json.add("x", p.x); });
///   });
/// });
/// ```
class JsonWriter {
 public:
  /// A member of the object that is open.
  template <class T>
  void add(std::string_view name, const T& value) {
    key(name);
    write(value);
  }
  /// Members that are numbers.
  void add(std::initializer_list<std::pair<std::string_view, double>> numbers) {
    for (const auto& [name, value] : numbers) {
      add(name, value);
    }
  }
  /// An object of numbers.
  void add(std::string_view name,
           std::initializer_list<std::pair<std::string_view, double>> numbers) {
    object(name, [&] { add(numbers); });
  }
  /// A member that is JSON already.
  void add_json(std::string_view name, std::string_view json) {
    key(name);
    write_json(json);
  }

  /// A value: the whole text, an element of the list that is open, or what follows `key`.
  void write(double value);
  void write(std::string_view text);
  void write(const Eigen::MatrixXd& M);
  void write(const Eigen::VectorXd& values);
  void write(const Eigen::VectorXcd& values);
  void write(std::span<const double> values);
  /// Code, message and the evidence by its names.
  void write(const Error& error) { write(error, std::nullopt); }
  /// The same, and line and column where there is a place.
  void write(const QuotedError& error) { write(error, error.place); }
  /// Code, severity, message, and line and column where there is a place.
  void write(const Diagnostic& diagnostic);
  /// {"name": …, "unit": …}, the unit empty where there is none.
  void write(const Coordinate& coordinate);
  void write(const std::string& text) { write(std::string_view(text)); }
  void write(const char* text) { write(std::string_view(text)); }
  void write(const std::vector<double>& values) { write(std::span<const double>(values)); }
  template <std::integral T>
  void write(T value) {
    if constexpr (std::same_as<T, bool>) {
      write_json(value ? "true" : "false");
    } else {
      write_json(std::to_string(value));
    }
  }
  /// The value, or null.
  template <class T>
  void write(const std::optional<T>& value) {
    value ? write(*value) : write_json("null");
  }
  template <class T>
  void write(const std::vector<T>& values) {
    list(values, [this](const T& value) { write(value); });
  }
  /// A value that is JSON already.
  void write_json(std::string_view json);

  /// Between braces stands what `members` writes.
  template <class F>
  void object(const F& members) {
    open('{');
    members();
    close('}');
  }
  template <class F>
  void object(std::string_view name, const F& members) {
    key(name);
    object(members);
  }
  /// Between brackets stands what `each` writes of each element.
  template <class Range, class F>
  void list(const Range& elements, const F& each) {
    open('[');
    for (const auto& element : elements) {
      each(element);
    }
    close(']');
  }
  template <class Range, class F>
  void list(std::string_view name, const Range& elements, const F& each) {
    key(name);
    list(elements, each);
  }

  /// The name of the member whose value comes next.
  void key(std::string_view name);
  /// '{' or '[' and, once all is written that stands in it, '}' or ']'.
  void open(char bracket);
  void close(char bracket) { text_ += bracket; }

  /// Whether a number that was written is NaN or infinite.
  [[nodiscard]] bool all_finite() const noexcept { return all_finite_; }
  /// What has been written.
  [[nodiscard]] const std::string& text() const& { return text_; }
  [[nodiscard]] std::string text() && { return std::move(text_); }

 private:
  void separate();
  void write(const Error& error, const std::optional<Place>& place);
  void add(const std::optional<Place>& place);

  std::string text_;
  bool all_finite_ = true;
};

/// A double as `JsonWriter` writes it. @param value  Finite.
[[nodiscard]] std::string json_number(double value);

/// A text in quotes, escaped.
[[nodiscard]] std::string json_quoted(std::string_view text);

/// A refusal: {"schema": …, "error": {"code", "message", …evidence}, "diagnostics": […]}, and
/// `errors` with all of them where there are several.
[[nodiscard]] std::string refusal_json(std::string_view schema, const Errors& errors);

}  // namespace flyball
