#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include <flyball/core/error.hpp>
#include <flyball/core/unit_algebra.hpp>
#include <flyball/math/expression/tape.hpp>

/// Formulas in text, checked for names and units, made into one tape. The language is described in
/// docs/formulas.md.
namespace flyball::expression {

/// Why a set of formulas cannot be used. Errors of a formula carry the evidence `offset` and
/// `length`: the place in its text, in bytes.
enum class ExpressionError {
  empty_formula,         ///< No text.
  too_large,             ///< A text of more than 100 000 bytes, or a tape of a million nodes.
  too_deep,              ///< More than 200 levels of parentheses, signs and powers.
  stray_character,       ///< A character that means nothing, or is no UTF-8.
  malformed_number,      ///< 1.2.3, or a number beyond a double's range.
  missing_operand,       ///< Nothing where a value belongs: "2*", "()".
  missing_operator,      ///< Two values side by side: "2x".
  unclosed_parenthesis,  ///< "(" without ")".
  unopened_parenthesis,  ///< ")" without "(".
  unexpected_symbol,     ///< A comma outside an argument list, a ":" without "?".
  assignment,            ///< "=" where only "==" has a meaning.
  chained_comparison,    ///< a < b < c.
  unknown_name,          ///< A name that is nobody's, or one defined later.
  unknown_function,      ///< A call of what is no function.
  wrong_arity,           ///< Too few or too many arguments.
  wrong_type,            ///< A comparison where a number belongs, or the other way round.
  unit_mismatch,         ///< Units that do not add up.
  unusable_name,         ///< A name that cannot be written in a formula, or is a function's.
  duplicate_name,        ///< Two things of one name.
  unknown_unit,          ///< A unit of the set that cannot be read.
  not_finite,            ///< A parameter that is NaN or infinite.
  no_counterpart,        ///< An operation that another language does not have.
};
[[nodiscard]] ErrorInfo error_info(ExpressionError code);

/// A name that formulas may use, whose value each evaluation gives, in SI.
struct Variable {
  std::string name{};
  std::string unit{};  ///< "m/s"; empty: not known, and not checked; "1": a plain number.
};

/// A name whose value stays for many evaluations.
struct Parameter {
  std::string name{};
  std::string unit{};
  double value = 0.0;  ///< In its unit.
};

/// A name = formula.
struct Formula {
  std::string name{};
  std::string text{};
  std::string unit{};  ///< What the result must be in; empty: anything. "m/s" + "/s" is "m/s/s".
};

/// What `compile` takes.
struct FormulaSet {
  std::vector<Variable> variables{};    ///< The tape's inputs.
  std::vector<Parameter> parameters{};  ///< The tape's parameters.
  std::vector<Formula> definitions{};   ///< Each usable by those after it and by the outputs.
  std::vector<Formula> outputs{};       ///< The tape's outputs. Their names are only for messages.
};

/// A set of formulas that can be evaluated.
struct CompiledFormulas {
  Tape tape;
  std::vector<double> parameters;                   ///< In SI, in order.
  std::vector<std::optional<SiDimension>> outputs;  ///< Of each output; nothing: not known.
};

/// Names, grammar and units checked, and the formulas made into one tape in which what they share
/// is computed once.
/// @return the tape, or every error found: `where` is the formula's name. A formula with a mistake
/// has only its first error of grammar in a place, and no complaint about what follows from it.
/// @errors ExpressionError.
/// Cost: linear in the text; allocates.
[[nodiscard]] tl::expected<CompiledFormulas, std::vector<Error>> compile(const FormulaSet& set);

/// Two lines that show the place of an error of a formula:
/// ```
/// -g/l*sin(theta) + u/(m*l^2
///                     ^ this parenthesis is not closed
/// ```
/// A long formula is cut to the part around the place. Empty for an error without a place.
[[nodiscard]] std::string caret_lines(std::string_view text, const Error& error);

}  // namespace flyball::expression
