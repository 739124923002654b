#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>

#include "core/format.hpp"
#include "math/expression/token.hpp"

namespace flyball::expression {

namespace {

struct Spelling {
  std::string_view text;
  TokenKind kind;
};

// Longer ones before those that they begin with.
constexpr std::array spellings{
    Spelling{"**", TokenKind::power},         Spelling{"<=", TokenKind::less_equal},
    Spelling{">=", TokenKind::greater_equal}, Spelling{"==", TokenKind::equal},
    Spelling{"!=", TokenKind::not_equal},     Spelling{"&&", TokenKind::logical_and},
    Spelling{"||", TokenKind::logical_or},    Spelling{"+", TokenKind::plus},
    Spelling{"-", TokenKind::minus},          Spelling{"*", TokenKind::times},
    Spelling{"/", TokenKind::divide},         Spelling{"^", TokenKind::power},
    Spelling{"<", TokenKind::less},           Spelling{">", TokenKind::greater},
    Spelling{"=", TokenKind::assign},         Spelling{"!", TokenKind::logical_not},
    Spelling{"?", TokenKind::question},       Spelling{":", TokenKind::colon},
    Spelling{",", TokenKind::comma},          Spelling{"(", TokenKind::open},
    Spelling{")", TokenKind::close},          Spelling{"−", TokenKind::minus},
    Spelling{"·", TokenKind::times},          Spelling{"⋅", TokenKind::times},
    Spelling{"×", TokenKind::times},          Spelling{"²", TokenKind::squared},
    Spelling{"³", TokenKind::cubed},          Spelling{"≤", TokenKind::less_equal},
    Spelling{"≥", TokenKind::greater_equal},  Spelling{"≠", TokenKind::not_equal},
};

// What people write elsewhere, and what it is here.
constexpr std::array<std::array<std::string_view, 2>, 8> elsewhere{{
    {"%", "write mod(a, b) for the remainder, and 0.01 for a percent"},
    {"&", "write and, or &&"},
    {"|", "write or, or ||; abs(x) for |x|"},
    {"[", "write parentheses, (...)"},
    {"]", "write parentheses, (...)"},
    {"{", "write parentheses, (...)"},
    {"}", "write parentheses, (...)"},
    {";", "write one formula, without an end mark"},
}};

bool is_digit(char32_t c) {
  return c >= U'0' && c <= U'9';
}

/// Letters of Unicode by block: Latin, Greek, Cyrillic and what follows but punctuation, arrows,
/// operators, private use and invalid codes; combining marks and subscripts go with letters.
bool is_letter(char32_t c) {
  if (c < 0x80) {
    return (c >= U'a' && c <= U'z') || (c >= U'A' && c <= U'Z') || c == U'_';
  }
  if (c < 0xC0) {
    return c == 0xAA || c == 0xB5 || c == 0xBA;
  }
  const bool operators = c == 0xD7 || c == 0xF7 || (c >= 0x2000 && c < 0x2070) ||
                         (c >= 0x2190 && c < 0x2C00) || (c >= 0x3000 && c < 0x3005) ||
                         (c >= 0xD800 && c < 0xF900) || c >= 0xFE00;
  return !operators || (c >= 0x1D400 && c < 0x1D800) || (c >= 0x20000 && c < 0x30000);
}

std::size_t name_length(std::string_view text, std::size_t at) {
  const std::size_t start = at;
  while (at < text.size()) {
    const Character c = character_at(text, at);
    if (!is_letter(c.code) && !(at > start && is_digit(c.code))) {
      break;
    }
    at += c.length;
  }
  return at - start;
}

class Lexer {
 public:
  Lexer(std::string_view text, Complaints& complaints) : text_(text), complaints_(complaints) {}

  std::vector<Token> run() {
    while (at_ < text_.size()) {
      const Character c = character_at(text_, at_);
      if (c.code == U' ' || c.code == U'\t' || c.code == U'\r' || c.code == U'\n' ||
          c.code == 0xA0) {
        at_ += c.length;
      } else if (is_digit(c.code) || (c.code == U'.' && digit(at_ + 1))) {
        number();
      } else if (const std::size_t length = name_length(text_, at_); length > 0) {
        name(length);
      } else if (const Spelling* spelling = spelling_here()) {
        push(spelling->kind, spelling->text.size());
      } else {
        stray(c);
      }
    }
    push(TokenKind::end, 0);
    return std::move(tokens_);
  }

 private:
  [[nodiscard]] bool digit(std::size_t at) const {
    return at < text_.size() && text_[at] >= '0' && text_[at] <= '9';
  }

  void push(TokenKind kind, std::size_t length, double value = 0.0) {
    tokens_.push_back({kind, {at_, length}, value});
    at_ += length;
  }

  void skip_digits(std::size_t& at) const {
    while (digit(at)) {
      ++at;
    }
  }

  void number() {
    std::size_t end = at_;
    skip_digits(end);
    if (end < text_.size() && text_[end] == '.') {
      ++end;
      skip_digits(end);
    }
    if (end < text_.size() && (text_[end] == 'e' || text_[end] == 'E')) {
      const bool sign = end + 1 < text_.size() && (text_[end + 1] == '+' || text_[end + 1] == '-');
      if (digit(end + (sign ? 2 : 1))) {
        end += sign ? 2 : 1;
        skip_digits(end);
      }
    }
    double value = 0.0;
    const auto [last, status] = std::from_chars(text_.data() + at_, text_.data() + end, value);
    const bool again = end < text_.size() && text_[end] == '.';
    while (end < text_.size() && (text_[end] == '.' || (again && digit(end)))) {
      ++end;
    }
    const Place place{at_, end - at_};
    if (again) {
      complaints_.add(Error(ExpressionError::malformed_number)
                          .about(complaints_.quote(place))
                          .got("a number with two points")
                          .expected("digits with at most one point, such as 12.5 or 1.25e1"),
                      place);
    } else if (status == std::errc::result_out_of_range || !std::isfinite(value)) {
      complaints_.add(Error(ExpressionError::malformed_number)
                          .about(complaints_.quote(place))
                          .got("beyond the range of a double")
                          .expected("between 1e-307 and 1e308"),
                      place);
    }
    push(TokenKind::number, place.length, value);
  }

  void name(std::size_t length) {
    const std::string_view word = text_.substr(at_, length);
    const TokenKind kind = word == "and"   ? TokenKind::logical_and
                           : word == "or"  ? TokenKind::logical_or
                           : word == "not" ? TokenKind::logical_not
                                           : TokenKind::name;
    push(kind, length);
  }

  [[nodiscard]] const Spelling* spelling_here() const {
    for (const Spelling& spelling : spellings) {
      if (text_.substr(at_).starts_with(spelling.text)) {
        return &spelling;
      }
    }
    return nullptr;
  }

  void stray(Character c) {
    const Place place{at_, c.length};
    std::string_view hint = "leave it out";
    for (const auto& [symbol, advice] : elsewhere) {
      hint = text_.substr(at_, c.length) == symbol ? advice : hint;
    }
    complaints_.add(Error(ExpressionError::stray_character)
                        .about(complaints_.quote(place))
                        .got(c.code == 0xFFFD ? "no character of UTF-8"
                                              : "a character that formulas do not have")
                        .hint(std::string(hint)),
                    place);
    at_ += c.length;
  }

  std::string_view text_;
  Complaints& complaints_;
  std::size_t at_ = 0;
  std::vector<Token> tokens_;
};

}  // namespace

std::vector<Token> tokens_of(std::string_view text, Complaints& complaints) {
  return Lexer(text, complaints).run();
}

bool is_name(std::string_view text) {
  return !text.empty() && name_length(text, 0) == text.size() && text != "and" && text != "or" &&
         text != "not";
}

}  // namespace flyball::expression
