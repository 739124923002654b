#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <flyball/classical/transfer_expression.hpp>
#include <flyball/core/text.hpp>
#include <flyball/math/expression/formula.hpp>

#include "classical/transfer_lexer.hpp"
#include "classical/transfer_syntax.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical::detail {

namespace {

using expression::ExpressionError;
using flyball::detail::format;

constexpr std::size_t longest = 10'000;
constexpr int deepest = 400;  // two a parenthesis

class Parser : TransferLexer {
 public:
  explicit Parser(std::string_view text) : TransferLexer(text) {}

  Expected<TransferSyntax> run() {
    if (text_.size() > longest) {
      return refusal(ExpressionError::too_large, in_transfer_function, "the expression")
          .got(format("{} bytes long", text_.size()))
          .expected(format("at most {}", longest));
    }
    next();
    if (here_.token == Token::end && !error_) {
      fail(Error(ExpressionError::empty_formula)
               .about("the expression")
               .got("empty")
               .expected("a transfer function such as 2/(s^2 + 3*s + 2)*exp(-0.1*s)"),
           here_.place);
    }
    if (!error_) {
      sum();
      if (!error_ && here_.token == Token::close) {
        fail(Error(ExpressionError::unopened_parenthesis)
                 .about(quote(text_, here_.place))
                 .got("closing nothing")
                 .hint("remove it, or write the ( that it closes"),
             here_.place);
      }
    }
    if (error_) {
      return tl::unexpected(*std::move(error_));
    }
    return std::move(syntax_);
  }

 private:
  std::size_t push(TransferNode node) {
    syntax_.nodes.push_back(std::move(node));
    return syntax_.nodes.size() - 1;
  }
  [[nodiscard]] const TextPlace& place_of(std::size_t node) const {
    return syntax_.nodes[node].place;
  }
  std::size_t binary(TransferNode::Kind kind, std::size_t a, std::size_t b) {
    return error_ ? 0 : push({.kind = kind, .place = place_of(a).to(place_of(b)), .a = a, .b = b});
  }

  std::size_t too_deep() {
    fail(Error(ExpressionError::too_deep)
             .about("the expression")
             .got(format("nested more than {} levels deep", deepest / 2))
             .hint("multiply the inner parts out"),
         here_.place);
    return 0;
  }

  std::size_t sum() {
    if (++depth_ > deepest) {
      return too_deep();
    }
    std::size_t left = product();
    while (!error_ && (here_.token == Token::plus || here_.token == Token::minus)) {
      const bool plus = here_.token == Token::plus;
      next();
      const std::size_t right = product();
      left = binary(plus ? TransferNode::Kind::add : TransferNode::Kind::subtract, left, right);
    }
    --depth_;
    return left;
  }

  [[nodiscard]] bool begins_value() const {
    return here_.token == Token::number || here_.token == Token::name ||
           here_.token == Token::open || here_.token == Token::list;
  }
  [[nodiscard]] std::string_view word() const {
    return text_.substr(here_.place.offset, here_.place.length);
  }

  std::size_t product() {
    std::size_t left = signed_power();
    std::size_t divisor = 0;
    bool divided = false;
    while (!error_) {
      if (here_.token == Token::times || here_.token == Token::divide) {
        const bool divides = here_.token == Token::divide;
        next();
        const std::size_t right = signed_power();
        left = binary(divides ? TransferNode::Kind::divide : TransferNode::Kind::multiply, left,
                      right);
        divisor = right;
        divided = divides;
      } else if (begins_value()) {
        // A dead time is never meant to stand below.
        const bool dead_time = here_.token == Token::name && (word() == "exp" || word() == "e");
        const std::size_t right = signed_power();
        if (!error_ && divided && !dead_time) {
          ambiguous(place_of(divisor), place_of(right));
          break;
        }
        left = binary(TransferNode::Kind::multiply, left, right);
        divided = false;
      } else {
        break;
      }
    }
    return left;
  }

  void ambiguous(TextPlace divisor, TextPlace factor) {
    const auto words = [&](TextPlace place) {
      const std::string quoted = quote(text_, place);
      return quoted.substr(1, quoted.size() - 2);
    };
    fail(Error(TransferTextError::ambiguous_division)
             .about(format("\"/{}\"", words(divisor.to(factor))))
             .got("a division by a product without a sign")
             .hint(format("write /({0}*{1}) to divide by both, or /{0}*{1} to divide by the first",
                          words(divisor), words(factor))),
         divisor.to(factor));
  }

  std::size_t signed_power() {
    bool negative = false;
    const TextPlace first = here_.place;
    while (!error_ && (here_.token == Token::minus || here_.token == Token::plus)) {
      negative = negative != (here_.token == Token::minus);
      next();
    }
    const std::size_t value = power();
    return negative && !error_ ? push({.kind = TransferNode::Kind::negate,
                                       .place = first.to(place_of(value)),
                                       .a = value})
                               : value;
  }

  std::size_t power() {
    if (++depth_ > deepest) {
      return too_deep();
    }
    std::size_t base = primary();
    while (!error_ && (here_.token == Token::squared || here_.token == Token::cubed)) {
      const std::size_t exponent =
          push({.place = here_.place, .number = here_.token == Token::squared ? 2.0 : 3.0});
      next();
      base = binary(TransferNode::Kind::power, base, exponent);
    }
    if (!error_ && here_.token == Token::power) {
      next();
      const bool bare = here_.token != Token::open && here_.token != Token::name;
      const std::size_t exponent = signed_power();
      if (!error_ && bare && syntax_.nodes[base].kind == TransferNode::Kind::euler &&
          begins_value()) {
        fail(Error(TransferTextError::ambiguous_division)
                 .about(quote(text_, place_of(base).to(here_.place)))
                 .got("a power whose end is not clear")
                 .hint("write the exponent in parentheses, such as e^(-0.1*s)"),
             place_of(base).to(here_.place));
      }
      if (!error_) {
        base = binary(TransferNode::Kind::power, base, exponent);
      }
    }
    --depth_;
    return base;
  }

  std::size_t primary() {
    const Lexeme lexeme = here_;
    switch (lexeme.token) {
      case Token::number:
        next();
        return push({.place = lexeme.place, .number = lexeme.number});
      case Token::name:
        return name(lexeme.place);
      case Token::open:
        next();
        return group(lexeme.place);
      case Token::list:
        return coefficients();
      default:
        break;
    }
    const bool at_end = lexeme.token == Token::end;
    const std::string what = at_end ? "write a value at the end"
                                    : format("write a value before {}", quote(text_, lexeme.place));
    fail(Error(ExpressionError::missing_operand)
             .about(at_end ? std::string("the expression") : quote(text_, lexeme.place))
             .got(at_end ? "ending where a value belongs" : "standing where a value belongs")
             .hint(what),
         lexeme.place);
    return 0;
  }

  /// What follows "(", which ends with its ")".
  std::size_t group(TextPlace open) {
    const std::size_t inner = sum();
    if (error_) {
      return 0;
    }
    if (here_.token != Token::close) {
      not_closed(open);
      return 0;
    }
    // The parentheses are part of what they enclose, for messages.
    syntax_.nodes[inner].place = open.to(here_.place);
    next();
    return inner;
  }

  /// feedback(G, H), or feedback(G) with H = 1.
  std::size_t feedback(TextPlace place) {
    if (here_.token != Token::open) {
      fail(Error(ExpressionError::missing_operand)
               .about(quote(text_, place))
               .got("a function without an argument")
               .hint("write feedback(G, H) for G/(1 + G*H)"),
           place);
      return 0;
    }
    const TextPlace open = here_.place;
    ++calls_;
    next();
    const std::size_t forward = sum();
    std::size_t back = 0;
    if (!error_ && here_.token == Token::comma) {
      next();
      back = sum();
    } else if (!error_) {
      back = push({.place = open, .number = 1.0});
    }
    --calls_;
    if (error_) {
      return 0;
    }
    if (here_.token == Token::comma) {
      fail(Error(ExpressionError::stray_character)
               .about(quote(text_, here_.place))
               .got("before a third argument")
               .hint("write feedback(G, H) for G/(1 + G*H)"),
           here_.place);
      return 0;
    }
    if (here_.token != Token::close) {
      not_closed(open);
      return 0;
    }
    const TextPlace whole = place.to(here_.place);
    next();
    return push({.kind = TransferNode::Kind::feedback, .place = whole, .a = forward, .b = back});
  }

  void not_closed(TextPlace open) {
    fail(Error(ExpressionError::unclosed_parenthesis)
             .about("\"(\"")
             .got("not closed")
             .hint("write the ) that closes it"),
         open);
  }

  std::size_t name(TextPlace place) {
    const std::string_view word = text_.substr(place.offset, place.length);
    next();
    if (word == "s" || word == "z") {
      if (syntax_.variable == 0) {
        syntax_.variable = word.front();
        syntax_.first_use = place;
      } else if (syntax_.variable != word.front()) {
        fail(Error(TransferTextError::both_variables)
                 .about(quote(text_, place))
                 .got(format("in an expression of {}", syntax_.variable))
                 .expected("of s (continuous) or of z (discrete), not of both")
                 .hint("discretize the part in s first (flyball solve c2d)"),
             place);
      }
      return push({.kind = TransferNode::Kind::variable, .place = place});
    }
    if (word == "e") {
      return push({.kind = TransferNode::Kind::euler, .place = place, .number = std::numbers::e});
    }
    if (word == "pi") {
      return push({.place = place, .number = std::numbers::pi});
    }
    if (word == "feedback") {
      return feedback(place);
    }
    if (word == "exp" || word == "sqrt") {
      if (here_.token != Token::open) {
        fail(Error(ExpressionError::missing_operand)
                 .about(quote(text_, place))
                 .got("a function without an argument")
                 .hint(word == "exp" ? "write exp(-0.1*s)" : "write sqrt(2)"),
             place);
        return 0;
      }
      const TextPlace open = here_.place;
      next();
      const std::size_t inner = group(open);
      if (error_) {
        return 0;
      }
      return push({.kind = word == "exp" ? TransferNode::Kind::exponential
                                         : TransferNode::Kind::square_root,
                   .place = place.to(place_of(inner)),
                   .a = inner});
    }
    unknown(word, place);
    return 0;
  }

  void unknown(std::string_view word, TextPlace place) {
    static constexpr std::array<std::string_view, 7> known{"s",  "z", "exp",     "sqrt",
                                                           "pi", "e", "feedback"};
    std::string hint;
    if (word == "S" || word == "p" || word == "P") {
      hint = "write s for the Laplace variable";
    } else if (word == "Z" || word == "q") {
      hint = "write z for the shift by one sample";
    } else if (word == "inf" || word == "nan" || word == "Inf" || word == "NaN") {
      hint = "numbers must be finite";
    } else if (word == "j" || word == "i" || word == "w" || word == "omega" || word == "jw") {
      hint = "write s, not jω: the coefficients are real";
    } else if (std::all_of(word.begin(), word.end(), [](char c) { return c == 's'; }) ||
               std::all_of(word.begin(), word.end(), [](char c) { return c == 'z'; })) {
      hint = format("write {}^{} for the power", word.front(), word.size());
    } else if (here_.token == Token::open && (word.front() == 's' || word.front() == 'z') &&
               word.size() == 1) {
      hint = "write a product";
    } else {
      const std::string nearest = word.size() > 1 ? nearest_name(word, known) : std::string();
      hint = nearest.empty() ? "put its number in" : format("did you mean \"{}\"?", nearest);
    }
    fail(Error(ExpressionError::unknown_name)
             .about(quote(text_, place))
             .got("not known")
             .expected("s or z, a number, exp(-T*s), sqrt(2) or pi")
             .hint(std::move(hint)),
         place);
  }

  /// "[1 -2, 3]": what MATLAB, Octave and NumPy users have at hand.
  std::size_t coefficients() {
    const TextPlace open = here_.place;
    TransferNode node;
    node.kind = TransferNode::Kind::coefficients;
    // here_ is "[": from now on by characters, for blanks count.
    bool wanted = false;  // after a comma
    while (!error_) {
      while (at_ < text_.size() && blank_length(text_, at_) > 0) {
        at_ += blank_length(text_, at_);
      }
      const char c = at_ < text_.size() ? text_[at_] : '\0';
      if (at_ >= text_.size()) {
        fail(Error(ExpressionError::unclosed_parenthesis)
                 .about("\"[\"")
                 .got("not closed")
                 .hint("write the ] that closes it"),
             open);
      } else if (c == ']') {
        finish_coefficients(node, open, wanted);
        break;
      } else if (c == ',') {
        if (wanted || node.list.empty()) {
          missing_coefficient();
        }
        wanted = true;
        ++at_;
      } else {
        wanted = false;
        coefficient(node);
      }
    }
    return error_ ? 0 : push(std::move(node));
  }

  void missing_coefficient() {
    fail(Error(ExpressionError::missing_operand)
             .about("a coefficient")
             .got("missing")
             .hint("write 0 for a power that is not there"),
         {at_, 1});
  }

  void finish_coefficients(TransferNode& node, TextPlace open, bool wanted) {
    const TextPlace close{at_, 1};
    if (node.list.empty()) {
      fail(Error(ExpressionError::missing_operand)
               .about("\"[]\"")
               .got("without coefficients")
               .expected("coefficients in descending powers, such as [1 2] for s + 2"),
           open.to(close));
      return;
    }
    if (wanted) {
      missing_coefficient();
      return;
    }
    ++at_;
    node.place = open.to(close);
    next();
  }

  void coefficient(TransferNode& node) {
    double sign = 1.0;
    const std::size_t start = at_;
    while (at_ < text_.size() &&
           (text_[at_] == '-' || text_[at_] == '+' || text_.substr(at_).starts_with("−"))) {
      sign = text_[at_] == '+' ? sign : -sign;
      at_ += character_length(text_, at_);
    }
    const bool digits = at_ < text_.size() && (is_digit(text_[at_]) || text_[at_] == '.');
    const auto number = digits ? read_number() : std::nullopt;
    if (error_) {
      return;
    }
    if (!number) {
      const std::size_t at = std::min(at_, text_.size() - 1);
      const TextPlace place{at, character_length(text_, at)};
      fail(Error(ExpressionError::malformed_number)
               .about(quote(text_, TextPlace{start, 0}.to(place)))
               .got("no coefficient")
               .expected("numbers between blanks or commas, such as [1 3.5 -2]"),
           place);
      return;
    }
    at_ = number->place.end();
    node.list.push_back(sign * number->number);
  }

  int depth_ = 0;
  TransferSyntax syntax_;
};

}  // namespace

Expected<TransferSyntax> parse_transfer_syntax(std::string_view text) {
  return Parser(text).run();
}

}  // namespace flyball::classical::detail
