#pragma once

#include <optional>

#include <flyball/math/expression/operation.hpp>

#include "math/expression/token.hpp"

namespace flyball::expression {

/// How tightly an operator binds.
enum Precedence : int {
  choice = 1,
  disjunction,
  conjunction,
  negation,
  comparison,
  sum,
  product,
  sign,
  exponentiation,
};

struct Infix {
  Precedence precedence;
  Operation operation;
  bool exchanged = false;
};

/// What a token means between two values; side by side they are taken for a product.
[[nodiscard]] constexpr std::optional<Infix> infix_of(TokenKind kind) {
  using enum TokenKind;
  switch (kind) {
    case plus:
      return Infix{sum, Operation::add};
    case minus:
      return Infix{sum, Operation::subtract};
    case times:
    case number:
    case name:
    case open:
    case logical_not:
      return Infix{product, Operation::multiply};
    case divide:
      return Infix{product, Operation::divide};
    case power:
    case squared:
    case cubed:
      return Infix{exponentiation, Operation::power};
    case less:
      return Infix{comparison, Operation::less};
    case less_equal:
      return Infix{comparison, Operation::less_equal};
    case greater:
      return Infix{comparison, Operation::less, true};
    case greater_equal:
      return Infix{comparison, Operation::less_equal, true};
    case equal:
    case assign:
      return Infix{comparison, Operation::equal};
    case not_equal:
      return Infix{comparison, Operation::not_equal};
    case logical_and:
      return Infix{conjunction, Operation::logical_and};
    case logical_or:
      return Infix{disjunction, Operation::logical_or};
    case question:
      return Infix{choice, Operation::select};
    default:
      return std::nullopt;
  }
}

}  // namespace flyball::expression
