#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>

#include "core/try.hpp"
#include "core/wording.hpp"
#include "solve/shape.hpp"

namespace flyball::solve {

using Eigen::Index;

namespace {

constexpr std::array letters{Letter{'n', "states"},
                             Letter{'m', "inputs"},
                             Letter{'p', "outputs"},
                             Letter{'k', "samples"},
                             Letter{'a', "states of the first system (forward)"},
                             Letter{'b', "states of the second system (back)"},
                             Letter{'c', "signals from the first system to the second"},
                             Letter{'u', "inputs of the second system"},
                             Letter{'y', "outputs of the second system"},
                             Letter{'s', "states of the loop, or poles"},
                             Letter{'r', "states that are kept"},
                             Letter{'d', "states with those of the delay"},
                             Letter{'h', "modes that are hidden"},
                             Letter{'g', "gain crossovers"},
                             Letter{'f', "phase crossovers"},
                             Letter{'q', "inputs of the reference model"},
                             Letter{'i', "rows of A"},
                             Letter{'j', "rows of B"},
                             Letter{'v', "coefficients"},
                             Letter{'e', "equations"},
                             Letter{'z', "parameters, orders or zeros"},
                             Letter{'o', "coefficients of B, or of a denominator"},
                             Letter{'t', "coefficients of C"},
                             Letter{'x', "coefficients of D"},
                             Letter{'T', "dead times"},
                             Letter{'F', "coefficients of W3"},
                             Letter{'G', "coefficients of W3's denominator"},
                             Letter{'K', "blocks"},
                             Letter{'l', "numbers"},
                             Letter{'w', "frequencies"},
                             Letter{'P', "points"}};

/// "states x inputs"; "states + outputs".
std::string words_of(std::string_view size) {
  std::string words;
  for (const std::string_view term : text::split(size, "+")) {
    const auto letter = std::find_if(letters.begin(), letters.end(), [&](const Letter& known) {
      return term == std::string_view(&known.letter, 1);
    });
    words += words.empty() ? "" : " + ";
    words += letter == letters.end() ? term : letter->counts;
  }
  return words;
}

std::string meaning_of(const Field& field) {
  const std::string rows = words_of(field.rows);
  const std::string columns = words_of(field.columns);
  return fmt::format("{} x {}", rows, columns);
}

}  // namespace

std::span<const Letter> all_letters() {
  return letters;
}

std::vector<Letter> letters_of(const Kind& kind) {
  std::string sizes;
  for (const std::vector<Field>& fields : {kind.fields, kind.answer}) {
    for (const Field& field : fields) {
      sizes.append(field.rows).append(field.columns).append(field.outputs);
    }
  }
  std::vector<Letter> used;
  std::copy_if(letters.begin(), letters.end(), std::back_inserter(used), [&](const Letter& letter) {
    return sizes.find(letter.letter) != std::string::npos;
  });
  return used;
}

Index Sizes::value_of(std::string_view size) const {
  const auto of = [&](char first) {
    const bool digit = first >= '0' && first <= '9';
    return digit ? Index{first - '0'} : known_[static_cast<std::size_t>(first)];
  };
  if (size.size() == 1) {
    return of(size.front());
  }
  Index sum = 0;
  for (const std::string_view part : text::split(size, "+")) {
    const Index term = of(part.front());
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
    known_[static_cast<std::size_t>(size.front())] = actual;
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
    case FieldType::transfers:
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
