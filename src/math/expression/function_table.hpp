#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <flyball/math/expression/operation.hpp>

namespace flyball::expression {

/// What a function or an operator asks of its operands' units, and makes of them.
enum class UnitRule : std::uint8_t {
  same,     ///< All equal; the result's too.
  compare,  ///< All equal; the result is a truth.
  logic,    ///< Truths.
  product,
  quotient,
  power,
  root2,
  root3,
  plain,     ///< Plain numbers or angles; the result is a plain number.
  to_angle,  ///< All equal; the result is an angle.
  arc,       ///< A plain number; the result is an angle.
  sign,      ///< Anything; the result is a plain number.
  choice,    ///< A truth, then two equal ones.
};

/// A function or an operator: how it is written, how many operands it takes, what they may be.
struct Function {
  std::string_view name;
  Operation operation;
  int fewest;
  int most;  ///< 0: any number.
  UnitRule rule;
};

/// Functions by name, those with several names several times. `clamp` and `if` are written with
/// their own operands in mind: min(max(x, low), high), and a choice.
inline constexpr std::array functions{
    Function{"sin", Operation::sin, 1, 1, UnitRule::plain},
    Function{"cos", Operation::cos, 1, 1, UnitRule::plain},
    Function{"tan", Operation::tan, 1, 1, UnitRule::plain},
    Function{"asin", Operation::asin, 1, 1, UnitRule::arc},
    Function{"acos", Operation::acos, 1, 1, UnitRule::arc},
    Function{"atan", Operation::atan, 1, 1, UnitRule::arc},
    Function{"atan2", Operation::atan2, 2, 2, UnitRule::to_angle},
    Function{"sinh", Operation::sinh, 1, 1, UnitRule::plain},
    Function{"cosh", Operation::cosh, 1, 1, UnitRule::plain},
    Function{"tanh", Operation::tanh, 1, 1, UnitRule::plain},
    Function{"asinh", Operation::asinh, 1, 1, UnitRule::plain},
    Function{"acosh", Operation::acosh, 1, 1, UnitRule::plain},
    Function{"atanh", Operation::atanh, 1, 1, UnitRule::plain},
    Function{"exp", Operation::exp, 1, 1, UnitRule::plain},
    Function{"expm1", Operation::expm1, 1, 1, UnitRule::plain},
    Function{"log", Operation::log, 1, 1, UnitRule::plain},
    Function{"ln", Operation::log, 1, 1, UnitRule::plain},
    Function{"log1p", Operation::log1p, 1, 1, UnitRule::plain},
    Function{"log2", Operation::log2, 1, 1, UnitRule::plain},
    Function{"log10", Operation::log10, 1, 1, UnitRule::plain},
    Function{"erf", Operation::erf, 1, 1, UnitRule::plain},
    Function{"sqrt", Operation::sqrt, 1, 1, UnitRule::root2},
    Function{"cbrt", Operation::cbrt, 1, 1, UnitRule::root3},
    Function{"hypot", Operation::hypot, 2, 0, UnitRule::same},
    Function{"abs", Operation::abs, 1, 1, UnitRule::same},
    Function{"sign", Operation::sign, 1, 1, UnitRule::sign},
    Function{"floor", Operation::floor, 1, 1, UnitRule::same},
    Function{"ceil", Operation::ceil, 1, 1, UnitRule::same},
    Function{"round", Operation::round, 1, 1, UnitRule::same},
    Function{"min", Operation::minimum, 2, 0, UnitRule::same},
    Function{"max", Operation::maximum, 2, 0, UnitRule::same},
    Function{"clamp", Operation::maximum, 3, 3, UnitRule::same},
    Function{"pow", Operation::power, 2, 2, UnitRule::power},
    Function{"mod", Operation::modulo, 2, 2, UnitRule::same},
    Function{"remainder", Operation::remainder, 2, 2, UnitRule::same},
    Function{"if", Operation::select, 3, 3, UnitRule::choice},
};

/// The operators, found by their operation and number of operands. `>` and `>=` are `<` and `<=`
/// with their operands exchanged.
inline constexpr std::array operators{
    Function{"-", Operation::negate, 1, 1, UnitRule::same},
    Function{"not", Operation::logical_not, 1, 1, UnitRule::logic},
    Function{"+", Operation::add, 2, 2, UnitRule::same},
    Function{"-", Operation::subtract, 2, 2, UnitRule::same},
    Function{"*", Operation::multiply, 2, 2, UnitRule::product},
    Function{"/", Operation::divide, 2, 2, UnitRule::quotient},
    Function{"^", Operation::power, 2, 2, UnitRule::power},
    Function{"<", Operation::less, 2, 2, UnitRule::compare},
    Function{"<=", Operation::less_equal, 2, 2, UnitRule::compare},
    Function{"==", Operation::equal, 2, 2, UnitRule::compare},
    Function{"!=", Operation::not_equal, 2, 2, UnitRule::compare},
    Function{"and", Operation::logical_and, 2, 2, UnitRule::logic},
    Function{"or", Operation::logical_or, 2, 2, UnitRule::logic},
    Function{"?", Operation::select, 3, 3, UnitRule::choice},
};

[[nodiscard]] constexpr const Function* find_function(std::string_view name) noexcept {
  for (const Function& function : functions) {
    if (function.name == name) {
      return &function;
    }
  }
  return nullptr;
}

[[nodiscard]] constexpr const Function* find_operator(Operation operation) noexcept {
  for (const Function& function : operators) {
    if (function.operation == operation) {
      return &function;
    }
  }
  return nullptr;
}

}  // namespace flyball::expression
