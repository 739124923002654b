#include <algorithm>
#include <array>
#include <utility>

#include "core/format.hpp"
#include "math/expression/infix.hpp"
#include "math/expression/syntax.hpp"
#include "math/expression/token.hpp"

namespace flyball::expression {

namespace {

constexpr int deepest = 200;

/// Precedence climbing over the tokens. Every way down goes through `expression`, which counts
/// levels.
class Parser {
 public:
  Parser(std::string_view text, const SymbolTable& symbols, Complaints& complaints)
      : text_(text),
        symbols_(symbols),
        complaints_(complaints),
        tokens_(tokens_of(text, complaints)) {}

  SyntaxTree run() {
    if (here().kind == TokenKind::end) {
      if (!complaints_.any()) {
        complaints_.add(
            Error(ExpressionError::empty_formula).hint("write a number if it is constant"),
            here().place);
      }
      mistake(here().place);
      return std::move(tree_);
    }
    std::uint32_t whole = expression(choice);
    while (here().kind != TokenKind::end) {
      const Token token = take();
      if (token.kind == TokenKind::close) {
        complaints_.add(Error(ExpressionError::unopened_parenthesis)
                            .hint("remove it, or write the ( that it closes"),
                        token.place);
        whole = infixes(whole, choice);
      } else {
        unexpected(token);
        whole = here().kind == TokenKind::end ? mistake(token.place) : expression(choice);
      }
    }
    if (whole + 1 != tree_.nodes.size()) {
      mistake({0, text_.size()});  // the last node is the whole
    }
    return std::move(tree_);
  }

 private:
  [[nodiscard]] const Token& here() const { return tokens_[at_]; }
  Token take() { return tokens_[at_ + 1 < tokens_.size() ? at_++ : at_]; }
  [[nodiscard]] std::string_view spelled(Place place) const {
    return text_.substr(place.offset, place.length);
  }

  std::uint32_t push(SyntaxNode node) {
    tree_.nodes.push_back(node);
    return static_cast<std::uint32_t>(tree_.nodes.size() - 1);
  }
  std::uint32_t mistake(Place place) {
    return push({.kind = SyntaxNode::Kind::mistake, .place = place, .mark = place});
  }
  std::uint32_t call(const Function& function, Place mark, Place place,
                     std::span<const std::uint32_t> operands, bool doubtful = false) {
    const auto first = static_cast<std::uint32_t>(tree_.operands.size());
    tree_.operands.insert(tree_.operands.end(), operands.begin(), operands.end());
    return push({.kind = SyntaxNode::Kind::call,
                 .place = place,
                 .mark = mark,
                 .function = &function,
                 .first = first,
                 .count = static_cast<std::uint32_t>(operands.size()),
                 .doubtful = doubtful});
  }
  [[nodiscard]] Place place_of(std::uint32_t node) const { return tree_.nodes[node].place; }

  void unexpected(const Token& token) {
    const bool comma = token.kind == TokenKind::comma;
    complaints_.add(Error(ExpressionError::unexpected_symbol)
                        .about(complaints_.quote(token.place))
                        .got("out of place")
                        .hint(comma ? "commas stand between arguments; a decimal point is a point"
                                    : "write condition ? a : b"),
                    token.place);
  }

  std::uint32_t expression(int weakest) {
    if (++depth_ > deepest) {
      complaints_.add(Error(ExpressionError::too_deep)
                          .got(flyball::detail::format("more than {} levels", deepest))
                          .hint("name an inner part as a definition of its own"),
                      here().place);
      complaints_.stop();
      at_ = tokens_.size() - 1;
    }
    const std::uint32_t result = infixes(prefix(), weakest);
    --depth_;
    return result;
  }

  std::uint32_t prefix() {
    const Token token = here();
    switch (token.kind) {
      case TokenKind::minus:
      case TokenKind::logical_not: {
        take();
        const bool minus = token.kind == TokenKind::minus;
        const std::uint32_t operand = expression(minus ? sign : negation);
        return call(*find_operator(minus ? Operation::negate : Operation::logical_not), token.place,
                    token.place.to(place_of(operand)), std::array{operand});
      }
      case TokenKind::plus:
        take();
        return expression(sign);
      case TokenKind::number:
        take();
        return push({.kind = SyntaxNode::Kind::number,
                     .place = token.place,
                     .mark = token.place,
                     .number = token.value});
      case TokenKind::name:
        take();
        return here().kind == TokenKind::open ? named_call(token) : name(token);
      case TokenKind::open:
        return group();
      default:
        complaints_.add(Error(ExpressionError::missing_operand)
                            .hint(token.kind == TokenKind::end
                                      ? "write a value at the end"
                                      : flyball::detail::format("write a value before {}",
                                                                complaints_.quote(token.place))),
                        token.place);
        return mistake({token.place.offset, 0});
    }
  }

  std::uint32_t infixes(std::uint32_t left, int weakest) {
    bool compared = false;
    while (const auto infix = infix_of(here().kind)) {
      if (infix->precedence < weakest) {
        break;
      }
      const Token token = here();
      const Place whole_so_far = place_of(left);
      const bool side_by_side = token.kind == TokenKind::number || token.kind == TokenKind::name ||
                                token.kind == TokenKind::open ||
                                token.kind == TokenKind::logical_not;
      if (side_by_side) {
        missing_operator(token);
      } else {
        take();
      }
      if (infix->precedence == choice) {
        left = conditional(left, token);
        continue;
      }
      const bool compares = infix->precedence == comparison;
      const bool doubtful =
          side_by_side || (compares && compared) || token.kind == TokenKind::assign;
      if (compares && compared) {
        complaints_.add(
            Error(ExpressionError::chained_comparison).hint("write a < b and b < c for a < b < c"),
            token.place);
      }
      if (token.kind == TokenKind::assign) {
        complaints_.add(Error(ExpressionError::assignment)
                            .hint("write == to compare; a formula is its right-hand side alone"),
                        token.place);
      }
      compared = compares;
      const std::uint32_t right = right_of(token, *infix);
      const Place place = whole_so_far.to(place_of(right));
      const std::array operands{infix->exchanged ? right : left, infix->exchanged ? left : right};
      left = call(*find_operator(infix->operation), token.place, place, operands, doubtful);
    }
    return left;
  }

  std::uint32_t right_of(const Token& token, const Infix& infix) {
    if (token.kind == TokenKind::squared || token.kind == TokenKind::cubed) {
      return push({.kind = SyntaxNode::Kind::number,
                   .place = token.place,
                   .mark = token.place,
                   .number = token.kind == TokenKind::squared ? 2.0 : 3.0});
    }
    // Powers are taken from the right, all others from the left.
    return expression(infix.precedence == exponentiation ? exponentiation : infix.precedence + 1);
  }

  std::uint32_t conditional(std::uint32_t condition, const Token& question) {
    const std::uint32_t then = expression(choice);
    if (here().kind != TokenKind::colon) {
      complaints_.add(Error(ExpressionError::missing_operand)
                          .about("?")
                          .got("without a : and a second value")
                          .hint("write condition ? a : b"),
                      question.place);
      return mistake(place_of(condition).to(place_of(then)));
    }
    take();
    const std::uint32_t otherwise = expression(choice);
    return call(*find_operator(Operation::select), question.place,
                place_of(condition).to(place_of(otherwise)),
                std::array{condition, then, otherwise});
  }

  void missing_operator(const Token& token) {
    const Token& before = tokens_[at_ - 1];
    const std::string_view word = spelled(token.place);
    const std::string pair = complaints_.quote(before.place.to(token.place));
    complaints_.add(
        Error(ExpressionError::missing_operator)
            .about(pair)
            .got("two values without an operator between them")
            .hint(word == "if" || word == "else"
                      ? std::string("write if(condition, a, b) or condition ? a : b")
                      : flyball::detail::format("write \"{}*{}\" for the product",
                                                shortened(before.place), shortened(token.place))),
        token.place);
  }
  [[nodiscard]] std::string shortened(Place place) const {
    const std::string quoted = complaints_.quote(place);
    return quoted.substr(1, quoted.size() - 2);
  }

  std::uint32_t name(const Token& token) {
    const std::string_view word = spelled(token.place);
    if (const auto symbol = symbols_.find(word); symbol && symbols_[*symbol].usable) {
      return push({.kind = SyntaxNode::Kind::symbol,
                   .place = token.place,
                   .mark = token.place,
                   .symbol = *symbol});
    } else if (symbol) {
      complaints_.add(Error(ExpressionError::unknown_name)
                          .about(complaints_.quote(token.place))
                          .got("a definition that comes later, or this one")
                          .hint("define it before its use"),
                      token.place);
    } else if (find_function(word) != nullptr) {
      complaints_.add(Error(ExpressionError::wrong_arity)
                          .about(complaints_.quote(token.place))
                          .got("a function without arguments")
                          .hint(flyball::detail::format("write {}(...)", word)),
                      token.place);
    } else {
      const std::string nearest = symbols_.nearest(word, false);
      complaints_.add(
          Error(ExpressionError::unknown_name)
              .about(complaints_.quote(token.place))
              .got("not known")
              .expected("a variable, a parameter or a definition")
              .hint(nearest.empty() ? std::string("declare it, or check its spelling")
                                    : flyball::detail::format("did you mean \"{}\"?", nearest)),
          token.place);
    }
    return mistake(token.place);
  }

  std::uint32_t group() {
    const Place open = take().place;
    std::uint32_t inner = expression(choice);
    while (here().kind == TokenKind::comma || here().kind == TokenKind::colon) {
      unexpected(take());
      inner = expression(choice);
    }
    close(open);
    // The parentheses are part of what they enclose, for messages.
    tree_.nodes[inner].place = open.to(tokens_[at_ - 1].place);
    return inner;
  }

  void close(Place open) {
    if (here().kind == TokenKind::close) {
      take();
    } else {
      complaints_.add(
          Error(ExpressionError::unclosed_parenthesis).hint("write the ) that closes it"), open);
    }
  }

  std::uint32_t named_call(const Token& token) {
    const std::string_view word = spelled(token.place);
    const Function* const function = find_function(word);
    if (function == nullptr && symbols_.find(word)) {
      return name(token);  // the missing operator is reported behind it
    }
    const Place open = take().place;
    std::vector<std::uint32_t> arguments;
    if (here().kind != TokenKind::close) {
      arguments.push_back(expression(choice));
      while (here().kind == TokenKind::comma || here().kind == TokenKind::colon) {
        if (here().kind == TokenKind::colon) {
          unexpected(here());
        }
        take();
        arguments.push_back(expression(choice));
      }
    }
    close(open);
    const Place place = token.place.to(tokens_[at_ - 1].place);
    if (function == nullptr) {
      const std::string nearest = symbols_.nearest(word, true);
      complaints_.add(
          Error(ExpressionError::unknown_function)
              .about(complaints_.quote(token.place))
              .got("not a function")
              .hint(nearest.empty() ? std::string("write a product with *")
                                    : flyball::detail::format("did you mean \"{}\"?", nearest)),
          token.place);
      return mistake(place);
    }
    const int count = static_cast<int>(arguments.size());
    if (count < function->fewest || (function->most > 0 && count > function->most)) {
      complaints_.add(
          Error(ExpressionError::wrong_arity)
              .about(flyball::detail::format("\"{}\"", word))
              .got(flyball::detail::format("given {}", count_of(count)))
              .expected(flyball::detail::format("given {}{}{}", count_of(function->fewest),
                                                function->most == 0 ? " or more" : "",
                                                word == "if" ? ": if(condition, a, b)" : "")),
          place);
      return mistake(place);
    }
    return call(*function, token.place, place, arguments);
  }
  static std::string count_of(int count) {
    return flyball::detail::format("{} argument{}", count, count == 1 ? "" : "s");
  }

  std::string_view text_;
  const SymbolTable& symbols_;
  Complaints& complaints_;
  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  int depth_ = 0;
  SyntaxTree tree_;
};

}  // namespace

SyntaxTree parse(std::string_view text, const SymbolTable& symbols, Complaints& complaints) {
  return Parser(text, symbols, complaints).run();
}

}  // namespace flyball::expression
