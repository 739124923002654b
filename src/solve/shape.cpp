#include <fmt/format.h>

#include "core/try.hpp"
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
  while (!size.empty()) {
    const std::size_t plus = size.find('+');
    const std::string_view word = word_of(size.substr(0, plus));
    if (word.empty()) {
      return {};
    }
    words += words.empty() ? "" : " + ";
    words += word;
    size = plus == std::string_view::npos ? std::string_view() : size.substr(plus + 1);
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
  while (!size.empty()) {
    const std::size_t plus = size.find('+');
    const char first = size.front();
    Index term = first - '0';
    if (first >= 'a' && first <= 'z') {
      term = known_[static_cast<std::size_t>(first - 'a')];
    }
    if (term < 0) {
      return -1;
    }
    sum += term;
    size = plus == std::string_view::npos ? std::string_view() : size.substr(plus + 1);
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

std::vector<std::string_view> words_of_choice(std::string_view choices) {
  std::vector<std::string_view> words;
  while (!choices.empty()) {
    const std::size_t space = choices.find(' ');
    words.push_back(choices.substr(0, space));
    choices = space == std::string_view::npos ? std::string_view() : choices.substr(space + 1);
  }
  return words;
}

}  // namespace flyball::solve
