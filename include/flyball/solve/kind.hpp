#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball {
class JsonWriter;
}

namespace flyball::solve {

class Problem;

/// What a field of a problem or of an answer holds, and how JSON writes it.
enum class FieldType {
  number,        ///< 0.5; infinities are "inf" and "-inf".
  integer,       ///< 3
  flag,          ///< true or false
  text,          ///< "words"
  texts,         ///< ["position", "velocity"]
  choice,        ///< One of a few texts.
  matrix,        ///< [[1, 0], [0, 1]]; of a problem also 1, which is 1 x 1.
  samples,       ///< A matrix with a row a sample; [1, 2] is its only column.
  list,          ///< [1, 2, 3]
  complex_list,  ///< [[-1, 2], [-1, -2]]; of a problem also -1, which is real.
  matrices,      ///< A list of matrices.
  record,        ///< Of an answer: numbers by name, {"w": 1.5, "gm": 3}; `choices` are the names.
  records,       ///< A list of such.
  system,        ///< {"A": …, "B": …, "C": …, "D": …}; C left out is the identity, D zero.
  transfer,      ///< {"num": …, "den": …} or {"expr": …}, of a problem with "dt" and "delay", zero
                 ///< if left out; an expression alone stands for one, too.
  transfers,     ///< Rows of them.
  objects,       ///< A list of objects with the fields `inner`.
};

/// What stands for a field that a problem leaves out. In an answer, everything but `refused` says
/// that the field may be missing.
enum class Absent { refused, nothing, zero, identity, number, first_choice };

/// One field: its name, its shape, its unit and a clause for people.
struct Field {
  std::string_view name;
  FieldType type = FieldType::number;
  /// Sizes as letters, numbers and sums ("n", "1", "n+p"): equal letters of one problem are equal
  /// sizes. What each counts is a table in src/solve/shape.cpp.
  std::string_view rows{};
  std::string_view columns{};
  std::string_view outputs{};  ///< Of a system, whose states are `rows` and inputs `columns`.
  std::string_view unit{};     ///< Empty for numbers without one, and where the user's units hold.
  std::string_view help{};
  std::string_view choices{};  ///< Of a choice, separated by spaces.
  Absent absent = Absent::refused;
  double otherwise = 0.0;  ///< The number that stands for one left out.
  bool unbounded = false;  ///< Of an answer: whether infinity and NaN say something.
  const std::vector<Field>* inner = nullptr;  ///< Of objects. They outlive it.
};

/// One kind of problem: everything that is known of it. The reader, the help, the documentation and
/// the JSON schema are made from this.
struct Kind {
  std::string_view name;      ///< Such as "dare".
  std::string_view help;      ///< What is solved, with its equation.
  std::vector<Field> fields;  ///< Of the problem, in the order in which they are read.
  std::vector<Field> answer;  ///< In the order in which they are written.
  std::string_view example;   ///< A problem that has an answer, as JSON on one line.
  /// Writes the answer to a problem whose fields are there and of the right shape.
  Expected<void> (*function)(const Problem& problem, JsonWriter& answer);
  std::string_view section{};  ///< Where it stands in the documentation, such as "Systems".
};

/// Why a problem whose fields are as they must be has no answer, beside what its function says.
enum class SolveError {
  overflow,        ///< A number of the answer is beyond the range of a double (no_answer).
  not_determined,  ///< The last digits of the data move the answer by more than 1e-4 of it.
  defect,          ///< Solving it threw.
};
[[nodiscard]] ErrorInfo error_info(SolveError code);

/// All kinds, in the order of the documentation.
[[nodiscard]] std::span<const Kind> kinds();

/// The kind of that name. @errors ArgumentError::unknown_name with the nearest name.
[[nodiscard]] Expected<const Kind*> find_kind(std::string_view name);

}  // namespace flyball::solve
