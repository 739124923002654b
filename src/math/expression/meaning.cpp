#include <array>
#include <span>
#include <utility>

#include "core/format.hpp"
#include "math/expression/syntax.hpp"

namespace flyball::expression {

namespace {

Meaning number_in(std::optional<SiDimension> dimension) {
  return {.truth = false, .certain = true, .dimension = dimension};
}

std::string words(const Meaning& meaning) {
  if (meaning.truth) {
    return "a comparison";
  }
  return !meaning.dimension ? "a number"
         : meaning.dimension->fits({}) && to_text(*meaning.dimension) == "1"
             ? "a plain number"
             : to_text(*meaning.dimension);
}

/// The meaning of each node from those of its operands.
class Checker {
 public:
  Checker(const SyntaxTree& tree, const SymbolTable& symbols, Complaints& complaints)
      : tree_(tree), symbols_(symbols), complaints_(complaints) {}

  Meaning run() {
    meanings_.reserve(tree_.nodes.size());
    for (const SyntaxNode& node : tree_.nodes) {
      meanings_.push_back(meaning_of(node));
    }
    return meanings_.back();
  }

 private:
  Meaning meaning_of(const SyntaxNode& node) {
    switch (node.kind) {
      case SyntaxNode::Kind::number:
        return {
            .truth = false, .certain = true, .dimension = SiDimension{}, .constant = node.number};
      case SyntaxNode::Kind::symbol:
        return symbols_[node.symbol].meaning;
      case SyntaxNode::Kind::call: {
        if (node.doubtful) {
          break;
        }
        Meaning result = by_rule(node);
        result.constant = constant(node);
        return result;
      }
      case SyntaxNode::Kind::mistake:
        break;
    }
    return {};
  }

  [[nodiscard]] std::uint32_t operand(const SyntaxNode& node, std::size_t k) const {
    return tree_.operands[node.first + k];
  }
  [[nodiscard]] const Meaning& of(const SyntaxNode& node, std::size_t k) const {
    return meanings_[operand(node, k)];
  }
  [[nodiscard]] Place place(const SyntaxNode& node, std::size_t k) const {
    return tree_.nodes[operand(node, k)].place;
  }

  [[nodiscard]] std::optional<double> constant(const SyntaxNode& node) const {
    std::array<double, 3> values{};
    if (node.count > 3 || (node.count == 3 && node.function->rule != UnitRule::choice)) {
      return std::nullopt;
    }
    for (std::size_t k = 0; k < node.count; ++k) {
      if (!of(node, k).constant) {
        return std::nullopt;
      }
      values[k] = *of(node, k).constant;
    }
    return apply<double>(node.function->operation, values[0], values[1], values[2]);
  }

  Meaning by_rule(const SyntaxNode& node) {
    const UnitRule rule = node.function->rule;
    if (rule == UnitRule::logic) {
      for (std::size_t k = 0; k < node.count; ++k) {
        require(node, k, true);
      }
      return {.truth = true, .certain = true};
    }
    if (rule == UnitRule::choice) {
      return choice(node);
    }
    for (std::size_t k = 0; k < node.count; ++k) {
      if (!require(node, k, false)) {
        return number_in(std::nullopt);
      }
    }
    const auto& a = of(node, 0).dimension;
    switch (rule) {
      case UnitRule::same:
        return number_in(common(node, 0));
      case UnitRule::compare:
        common(node, 0);
        return {.truth = true, .certain = true};
      case UnitRule::to_angle:
        common(node, 0);
        return number_in(si_dimension(Dimension::angle));
      case UnitRule::product:
      case UnitRule::quotient: {
        const auto& b = of(node, 1).dimension;
        if (!a || !b) {
          return number_in(std::nullopt);
        }
        return number_in(rule == UnitRule::product ? *a * *b : *a / *b);
      }
      case UnitRule::power:
        return number_in(raised(node));
      case UnitRule::root2:
      case UnitRule::root3:
        return number_in(a ? std::optional(power(*a, rule == UnitRule::root2 ? 0.5 : 1.0 / 3.0))
                           : std::nullopt);
      case UnitRule::plain:
      case UnitRule::arc:
        require_plain(node, 0, flyball::detail::format("which {} takes", node.function->name));
        return number_in(rule == UnitRule::arc ? si_dimension(Dimension::angle) : SiDimension{});
      default:
        return number_in(SiDimension{});
    }
  }

  /// Reports a comparison where a number belongs, or the other way round.
  bool require(const SyntaxNode& node, std::size_t k, bool truth) {
    const Meaning& meaning = of(node, k);
    if (!meaning.certain || meaning.truth == truth) {
      return true;
    }
    complaints_.add(
        Error(ExpressionError::wrong_type)
            .about(complaints_.quote(place(node, k)))
            .got(truth ? "a number" : "a comparison")
            .expected(truth ? "a comparison, such as x != 0" : "a number, such as if(x > 0, 1, 0)"),
        place(node, k));
    return false;
  }

  void require_plain(const SyntaxNode& node, std::size_t k, const std::string& reason) {
    const Meaning& meaning = of(node, k);
    if (meaning.dimension && !meaning.dimension->dimensionless()) {
      complaints_.add(Error(ExpressionError::unit_mismatch)
                          .about(complaints_.quote(place(node, k)))
                          .got("in " + words(meaning))
                          .expected("a plain number or an angle, " + reason),
                      place(node, k));
    }
  }

  /// The unit that all operands from the first on share; the first that differs is reported.
  std::optional<SiDimension> common(const SyntaxNode& node, std::size_t first) {
    std::size_t known = node.count;  // the first operand with a unit of its own
    bool unknown = false;
    for (std::size_t k = first; k < node.count; ++k) {
      const Meaning& meaning = of(node, k);
      if (!meaning.dimension) {
        unknown = true;
      } else if (known == node.count || of(node, known).fits_any()) {
        known = k;
      } else if (!meaning.fits_any() && !meaning.dimension->fits(*of(node, known).dimension)) {
        differ(node, known, k);
        return std::nullopt;
      }
    }
    return unknown || known == node.count ? std::nullopt : of(node, known).dimension;
  }

  void differ(const SyntaxNode& node, std::size_t one, std::size_t other) {
    // a > b is stored as b < a: tell them in the order of the text.
    if (place(node, other).offset < place(node, one).offset) {
      std::swap(one, other);
    }
    const Operation operation = node.function->operation;
    const bool binary =
        find_operator(operation) != nullptr && node.function == find_operator(operation);
    const std::string_view between = operation == Operation::add        ? "plus"
                                     : operation == Operation::subtract ? "minus"
                                     : binary && node.count == 2        ? "compared with"
                                                                        : "beside";
    complaints_.add(Error(ExpressionError::unit_mismatch)
                        .about(complaints_.quote(node.place))
                        .got(flyball::detail::format("{} {} {}", words(of(node, one)), between,
                                                     words(of(node, other))))
                        .expected("in one unit"),
                    binary && node.count == 2 ? node.mark : place(node, other));
  }

  std::optional<SiDimension> raised(const SyntaxNode& node) {
    require_plain(node, 1, "since it is an exponent");
    const auto& base = of(node, 0).dimension;
    const auto& exponent = of(node, 1).constant;
    if (!base || (exponent && std::isfinite(*exponent))) {
      return base ? std::optional(power(*base, *exponent)) : std::nullopt;
    }
    if (!base->dimensionless()) {
      complaints_.add(Error(ExpressionError::unit_mismatch)
                          .about(complaints_.quote(place(node, 1)))
                          .got("an exponent that varies")
                          .expected(flyball::detail::format(
                              "a number, since what it raises is in {}", words(of(node, 0)))),
                      place(node, 1));
      return std::nullopt;
    }
    return SiDimension{};
  }

  Meaning choice(const SyntaxNode& node) {
    require(node, 0, true);
    const Meaning& then = of(node, 1);
    const Meaning& otherwise = of(node, 2);
    if (then.certain && otherwise.certain && then.truth != otherwise.truth) {
      require(node, then.truth ? 1 : 2, false);
      return {};
    }
    if (then.truth || otherwise.truth) {
      return {.truth = true, .certain = true};
    }
    return {
        .truth = false, .certain = then.certain || otherwise.certain, .dimension = common(node, 1)};
  }

  const SyntaxTree& tree_;
  const SymbolTable& symbols_;
  Complaints& complaints_;
  std::vector<Meaning> meanings_;
};

}  // namespace

Meaning check_meaning(const SyntaxTree& tree, const SymbolTable& symbols, Complaints& complaints) {
  return Checker(tree, symbols, complaints).run();
}

}  // namespace flyball::expression
