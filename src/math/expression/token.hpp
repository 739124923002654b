#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "math/expression/complaints.hpp"

namespace flyball::expression {

enum class TokenKind : std::uint8_t {
  number,
  name,
  plus,
  minus,
  times,
  divide,
  power,
  squared,  ///< "²" and "³": a power with its exponent.
  cubed,
  less,
  less_equal,
  greater,
  greater_equal,
  equal,
  not_equal,
  assign,
  logical_and,
  logical_or,
  logical_not,
  question,
  colon,
  comma,
  open,
  close,
  end,
};

struct Token {
  TokenKind kind = TokenKind::end;
  Place place;
  double value = 0.0;  ///< Of a number.
};

/// The tokens of a formula, the last of kind `end`. Characters that are none are reported and left
/// out.
[[nodiscard]] std::vector<Token> tokens_of(std::string_view text, Complaints& complaints);

/// Whether a text is one name: a letter or underscore, then letters, digits and underscores, where
/// letters are those of any language.
[[nodiscard]] bool is_name(std::string_view text);

}  // namespace flyball::expression
