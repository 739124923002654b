#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>
#include <utility>

#include <flyball/core/text.hpp>
#include <flyball/math/expression/formula.hpp>

#include "classical/transfer_lexer.hpp"
#include "core/try.hpp"

namespace flyball::classical::detail {

using expression::ExpressionError;

namespace {

struct Spelling {
  std::string_view text;
  Token token;
};
// Longer ones before those that they begin with.
constexpr std::array spellings{
    Spelling{"**", Token::power}, Spelling{"+", Token::plus},    Spelling{"-", Token::minus},
    Spelling{"*", Token::times},  Spelling{"/", Token::divide},  Spelling{"^", Token::power},
    Spelling{"(", Token::open},   Spelling{")", Token::close},   Spelling{"[", Token::list},
    Spelling{"−", Token::minus},  Spelling{"·", Token::times},   Spelling{"⋅", Token::times},
    Spelling{"×", Token::times},  Spelling{"²", Token::squared}, Spelling{"³", Token::cubed},
    Spelling{"÷", Token::divide},
};

constexpr std::array<std::array<std::string_view, 2>, 8> elsewhere{{
    {",", "a decimal point is a point; commas stand between the coefficients of [1, 2]"},
    {";", "give one expression, without an end mark"},
    {"=", "give the right-hand side alone"},
    {"{", "write parentheses, (...)"},
    {"}", "write parentheses, (...)"},
    {"]", "write the [ that it closes"},
    {"'", "leave it out"},
    {"\"", "leave it out"},
}};

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

}  // namespace

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

std::size_t character_length(std::string_view text, std::size_t at) {
  std::size_t length = 1;
  while (at + length < text.size() &&
         (static_cast<unsigned char>(text[at + length]) & 0xC0U) == 0x80U) {
    ++length;
  }
  return length;
}

std::size_t blank_length(std::string_view text, std::size_t at) {
  const char c = text[at];
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' ? 1
         : text.substr(at).starts_with("\xC2\xA0")       ? 2
         : text.substr(at).starts_with("\xE2\x80\x89")   ? 3  // a thin space
                                                         : 0;
}

Error at_place(Error error, TextPlace place) {
  return std::move(error)
      .with("offset", static_cast<double>(place.offset))
      .with("length", static_cast<double>(place.length));
}

std::string quote(std::string_view text, TextPlace place) {
  constexpr std::size_t most = 60;
  const std::string_view words = text.substr(std::min(place.offset, text.size()), place.length);
  return "\"" + flyball::cut(printable(words), most) + "\"";
}

void TransferLexer::fail(Error error, TextPlace place) {
  if (!error_) {
    error_ = at_place(std::move(error).in(std::string(in_transfer_function)), place);
  }
  here_ = {Token::end, {text_.size(), 0}};
  at_ = text_.size();
}

void TransferLexer::next() {
  while (at_ < text_.size() && blank_length(text_, at_) > 0) {
    at_ += blank_length(text_, at_);
  }
  here_ = {Token::end, {at_, 0}};
  if (at_ >= text_.size()) {
    return;
  }
  const char c = text_[at_];
  if (is_digit(c) || (c == '.' && at_ + 1 < text_.size() && is_digit(text_[at_ + 1]))) {
    const auto number = read_number();
    if (number) {
      here_ = *number;
      at_ = here_.place.end();
    }
    return;
  }
  if (is_letter(c)) {
    std::size_t end = at_;
    while (end < text_.size() && is_letter(text_[end])) {
      ++end;
    }
    here_ = {Token::name, {at_, end - at_}};
    at_ = end;
    return;
  }
  if (c == ',' && calls_ > 0) {
    here_ = {Token::comma, {at_++, 1}};
    return;
  }
  for (const Spelling& spelling : spellings) {
    if (text_.substr(at_).starts_with(spelling.text)) {
      here_ = {spelling.token, {at_, spelling.text.size()}};
      at_ += spelling.text.size();
      return;
    }
  }
  stray();
}

void TransferLexer::stray() {
  const TextPlace place{at_, character_length(text_, at_)};
  const std::string_view symbol = text_.substr(place.offset, place.length);
  std::string hint = "leave it out";
  for (const auto& [character, advice] : elsewhere) {
    hint = symbol == character ? advice : hint;
  }
  if (symbol == "π") {
    hint = "write pi";
  }
  fail(Error(ExpressionError::stray_character)
           .about(quote(text_, place))
           .got("a character that transfer functions do not have")
           .hint(std::move(hint)),
       place);
}

std::optional<Lexeme> TransferLexer::read_number() {
  std::size_t end = at_;
  const auto digits = [&] {
    while (end < text_.size() && is_digit(text_[end])) {
      ++end;
    }
  };
  digits();
  if (end < text_.size() && text_[end] == '.') {
    ++end;
    digits();
  }
  if (end < text_.size() && (text_[end] == 'e' || text_[end] == 'E')) {
    const bool sign = end + 1 < text_.size() && (text_[end + 1] == '+' || text_[end + 1] == '-');
    const std::size_t first = end + (sign ? 2 : 1);
    if (first < text_.size() && is_digit(text_[first])) {
      end = first;
      digits();
    }
  }
  double value = 0.0;
  const auto status = std::from_chars(text_.data() + at_, text_.data() + end, value).ec;
  const bool again = end < text_.size() && text_[end] == '.';
  while (end < text_.size() && again && (text_[end] == '.' || is_digit(text_[end]))) {
    ++end;
  }
  const TextPlace place{at_, end - at_};
  if (again) {
    fail(Error(ExpressionError::malformed_number)
             .about(quote(text_, place))
             .got("a number with two points")
             .expected("digits with at most one point, such as 12.5 or 1.25e1"),
         place);
    return std::nullopt;
  }
  if (status == std::errc::result_out_of_range || !std::isfinite(value)) {
    fail(Error(ExpressionError::malformed_number)
             .about(quote(text_, place))
             .got("beyond the range of a double")
             .expected("between 1e-307 and 1e308"),
         place);
    return std::nullopt;
  }
  return Lexeme{Token::number, place, value};
}

}  // namespace flyball::classical::detail
