#include <fmt/format.h>

#include "core/try.hpp"
#include "core/wording.hpp"
#include "solve/shape.hpp"

namespace flyball::solve {

using Eigen::Index;

namespace {

/// What a letter counts, in words; nothing for those that only say which sizes agree.
std::string_view word_of(std::string_view size) {
  return size == "n"   ? "states"
         : size == "m" ? "inputs"
         : size == "p" ? "outputs"
         : size == "k" ? "samples"
         : size == "1" ? "1"
                       : "";
}

/// "states x inputs"; "states + outputs"; empty where a letter has no word.
std::string words_of(std::string_view size) {
  std::string words;
  for (const std::string_view letter : text::split(size, "+")) {
    const std::string_view word = word_of(letter);
    if (word.empty()) {
      return {};
    }
    words += words.empty() ? "" : " + ";
    words += word;
  }
  return words;
}

std::string meaning_of(const Field& field) {
  const std::string rows = words_of(field.rows);
  const std::string columns = words_of(field.columns);
  return rows.empty() || columns.empty() ? std::string() : fmt::format("{} x {}", rows, columns);
}

}  // namespace

Index Sizes::value_of(std::string_view size) const {
  Index sum = 0;
  for (const std::string_view part : text::split(size, "+")) {
    const char first = part.front();
    const Index term =
        first >= 'a' && first <= 'z' ? known_[static_cast<std::size_t>(first - 'a')] : first - '0';
    if (term < 0) {
      return -1;
    }
    sum += term;
  }
  return sum;
}

Index Sizes::bind(std::string_view size, Index actual) {
  const Index value = value_of(size);
  if (value < 0 && size.size() == 1) {
    known_[static_cast<std::size_t>(size.front() - 'a')] = actual;
  }
  return value < 0 ? actual : value;
}

Expected<void> check_shape_of(const Eigen::MatrixXd& M, const Field& field, Sizes& sizes,
                              std::string_view where, std::string_view name) {
  if (M.size() == 0) {
    return refusal(ArgumentError::empty, where, name).got("empty").expected("at least one number");
  }
  if (field.rows == field.columns && !sizes.knows(field.rows)) {
    FLYBALL_CHECK(check_square(M, where, name));
  }
  const Index rows = sizes.bind(field.rows, M.rows());
  const Index columns = sizes.bind(field.columns, M.cols());
  if (M.rows() != rows || M.cols() != columns) {
    return check_shape(M, rows, columns, where, name, meaning_of(field));
  }
  return check_finite(M, where, name);
}

std::string shape_of(const Field& field) {
  switch (field.type) {
    case FieldType::matrix:
    case FieldType::samples:
      return fmt::format("{} x {}", field.rows, field.columns);
    case FieldType::matrices:
      return fmt::format("each {} x {}", field.rows, field.columns);
    case FieldType::list:
    case FieldType::complex_list:
      return std::string(field.rows);
    case FieldType::system:
      return fmt::format("{} states, {} inputs, {} outputs", field.rows, field.columns,
                         field.outputs);
    default:
      return {};
  }
}

}  // namespace flyball::solve
