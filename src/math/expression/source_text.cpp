#include <flyball/math/expression/source_text.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/math/expression/formula.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/expression/function_table.hpp"

namespace flyball::expression {

namespace {

using enum Operation;

/// Longer texts get a name.
constexpr std::size_t longest = 80;

/// How tightly a text holds together; operands that hold less get parentheses.
enum Strength : int {
  choice,
  disjunction,
  conjunction,
  relation,
  sum,
  product,
  minus_sign,
  exponent,
  whole
};

bool is_truth(Operation operation) {
  return operation >= less && operation <= logical_not;
}

/// Functions whose text names an operand twice.
bool repeats_operands(Operation operation, Language language) {
  const bool java = language == Language::java;
  return (operation == Operation::sign && language != Language::formula) ||
         (operation == modulo && language != Language::formula) ||
         (java && (operation == Operation::asinh || operation == Operation::acosh ||
                   operation == Operation::atanh || operation == Operation::round));
}

/// The name of a function of one or two operands in a language's own library.
std::string function_name(Operation operation, Language language) {
  std::string_view name;
  for (const Function& function : functions) {
    if (function.operation == operation && name.empty()) {
      name = function.name;
    }
  }
  const bool own = language == Language::formula;
  const bool c = language == Language::c;
  if (operation == Operation::abs && language != Language::java && !own) {
    name = "fabs";
  } else if (c && (operation == minimum || operation == maximum)) {
    name = operation == minimum ? "fmin" : "fmax";
  } else if (operation == Operation::remainder && language == Language::java) {
    name = "IEEEremainder";
  }
  return (own || c ? "" : language == Language::cpp ? "std::" : "Math.") + std::string(name);
}

class Writer {
 public:
  Writer(const Tape& tape, std::span<const std::string> inputs,
         std::span<const std::string> parameters, Language language)
      : tape_(tape), inputs_(inputs), parameters_(parameters), language_(language) {}

  SourceText run() {
    choose_prefix();
    count_uses();
    texts_.resize(tape_.size());
    for (std::size_t i = 0; i < tape_.size(); ++i) {
      const Node& node = tape_.nodes()[i];
      texts_[i] = write(node);
      const bool computed = operand_count(node.operation) > 0;
      if (computed &&
          (uses_[i] > 1 || named_[i] || (inner_[i] && texts_[i].text.size() > longest))) {
        const std::string name =
            flyball::detail::format("{}{}", prefix_, result_.definitions.size() + 1);
        result_.definitions.push_back({name, std::move(texts_[i].text), is_truth(node.operation)});
        texts_[i] = {name, whole};
      }
    }
    for (const Slot output : tape_.output_slots()) {
      result_.outputs.push_back(number({output.index}).text);
    }
    return std::move(result_);
  }

 private:
  struct Text {
    std::string text;
    Strength strength = whole;
  };

  void choose_prefix() {
    const auto taken = [&](const std::string& name) {
      return name.starts_with(prefix_) &&
             name.find_first_not_of("0123456789", prefix_.size()) == std::string::npos;
    };
    while (std::any_of(inputs_.begin(), inputs_.end(), taken) ||
           std::any_of(parameters_.begin(), parameters_.end(), taken)) {
      prefix_ += "t";
    }
  }

  void count_uses() {
    uses_.resize(tape_.size());
    named_.resize(tape_.size());
    inner_.resize(tape_.size());
    for (const Node& node : tape_.nodes()) {
      const std::array operands{node.a, node.b, node.c};
      for (int k = 0; k < operand_count(node.operation); ++k) {
        const std::uint32_t operand = operands[static_cast<std::size_t>(k)];
        ++uses_[operand];
        inner_[operand] = true;
        named_[operand] = named_[operand] || repeats_operands(node.operation, language_);
      }
    }
    for (const Slot output : tape_.output_slots()) {
      ++uses_[output.index];
    }
  }

  [[nodiscard]] bool own() const { return language_ == Language::formula; }

  Text literal(double value) const {
    const bool java = language_ == Language::java;
    if (std::isnan(value)) {
      return own()                      ? Text{"0/0", product}
             : java                     ? Text{"Double.NaN"}
             : language_ == Language::c ? Text{"NAN"}
                                        : Text{"std::numeric_limits<double>::quiet_NaN()"};
    }
    if (std::isinf(value)) {
      const Text infinite = own()  ? Text{"1/0", product}
                            : java ? Text{"Double.POSITIVE_INFINITY"}
                            : language_ == Language::c
                                ? Text{"INFINITY"}
                                : Text{"std::numeric_limits<double>::infinity()"};
      return value > 0.0
                 ? infinite
                 : Text{"-" + infinite.text, infinite.strength == whole ? minus_sign : product};
    }
    std::string digits = flyball::detail::format("{}", value);
    if (!own() && digits.find_first_of(".e") == std::string::npos) {
      digits += ".0";
    }
    return {digits, std::signbit(value) ? minus_sign : whole};
  }

  /// An operand as a number, a truth being 1 or 0.
  Text number(Slot slot) {
    Text text = texts_[slot.index];
    if (!is_truth(tape_.nodes()[slot.index].operation)) {
      return text;
    }
    return own() ? Text{flyball::detail::format("if({}, 1, 0)", text.text)}
                 : Text{flyball::detail::format("{} ? 1.0 : 0.0", at_least(text, disjunction)),
                        choice};
  }

  /// An operand as a truth, a number being true where it is not 0.
  Text truth(Slot slot) {
    const Text text = texts_[slot.index];
    return is_truth(tape_.nodes()[slot.index].operation)
               ? text
               : Text{flyball::detail::format("{} != {}", at_least(text, sum), literal(0.0).text),
                      relation};
  }

  static std::string at_least(const Text& text, int strength) {
    return text.strength >= strength ? text.text : "(" + text.text + ")";
  }

  Text infix(const Node& node, std::string_view symbol, Strength strength) {
    return {flyball::detail::format("{}{}{}", at_least(number({node.a}), strength), symbol,
                                    at_least(number({node.b}), strength + 1)),
            strength};
  }
  Text logic(const Node& node, std::string_view symbol, Strength strength) {
    return {flyball::detail::format("{} {} {}", at_least(truth({node.a}), strength), symbol,
                                    at_least(truth({node.b}), strength + 1)),
            strength};
  }

  Text write(const Node& node) {
    switch (node.operation) {
      case constant:
        return literal(node.value());
      case parameter:
        return {parameters_[node.a]};
      case input:
        return {inputs_[node.a]};
      case add:
        return infix(node, " + ", sum);
      case subtract:
        return infix(node, " - ", sum);
      case multiply:
      case chain:
        return infix(node, "*", product);
      case divide:
        return infix(node, "/", product);
      case negate:
        return {"-" + at_least(number({node.a}), exponent), minus_sign};
      case less:
        return infix(node, " < ", relation);
      case less_equal:
        return infix(node, " <= ", relation);
      case equal:
        return infix(node, " == ", relation);
      case not_equal:
        return infix(node, " != ", relation);
      case logical_and:
        return logic(node, own() ? "and" : "&&", conjunction);
      case logical_or:
        return logic(node, own() ? "or" : "||", disjunction);
      case logical_not:
        return {(own() ? "not " : "!") + at_least(truth({node.a}), whole),
                own() ? conjunction : minus_sign};
      case select:
        return own() ? Text{flyball::detail::format("if({}, {}, {})", truth({node.a}).text,
                                                    number({node.b}).text, number({node.c}).text)}
                     : Text{flyball::detail::format("{} ? {} : {}",
                                                    at_least(truth({node.a}), disjunction),
                                                    at_least(number({node.b}), disjunction),
                                                    at_least(number({node.c}), choice)),
                            choice};
      default:
        return call(node);
    }
  }

  Text call(const Node& node) {
    const std::string a = number({node.a}).text;
    const std::string b = operand_count(node.operation) > 1 ? number({node.b}).text : "";
    if (own() && node.operation == power) {
      return {flyball::detail::format("{}^{}", at_least(number({node.a}), whole),
                                      at_least(number({node.b}), whole)),
              exponent};
    }
    if (repeats_operands(node.operation, language_)) {
      return repeated(node);
    }
    if (language_ == Language::java && node.operation == Operation::log2) {
      return {flyball::detail::format("Math.log({})/Math.log(2.0)", a), product};
    }
    const std::string name = function_name(node.operation, language_);
    return {b.empty() ? flyball::detail::format("{}({})", name, a)
                      : flyball::detail::format("{}({}, {})", name, a, b)};
  }

  /// Functions that the language lacks, from those that it has.
  Text repeated(const Node& node) {
    const std::string a = at_least(number({node.a}), whole);
    switch (node.operation) {
      case Operation::sign:
        return {flyball::detail::format("{0} > 0.0 ? 1.0 : {0} < 0.0 ? -1.0 : {0}", a), choice};
      case modulo: {
        const std::string b = at_least(number({node.b}), whole);
        return {flyball::detail::format("{0} - {1}*{2}({0}/{1})", a, b,
                                        function_name(Operation::floor, language_)),
                sum};
      }
      case Operation::asinh:
        return {
            flyball::detail::format("Math.copySign(Math.log1p(Math.abs({0}) + "
                                    "{0}*{0}/(1.0 + Math.hypot(1.0, {0}))), {0})",
                                    a)};
      case Operation::acosh:
        return {flyball::detail::format("Math.log({0} + Math.sqrt(({0} - 1.0)*({0} + 1.0)))", a)};
      case Operation::atanh:
        return {flyball::detail::format("0.5*Math.log1p(2.0*{0}/(1.0 - {0}))", a), product};
      default:  // round
        return {flyball::detail::format("Math.copySign(Math.floor(Math.abs({0}) + 0.5), {0})", a)};
    }
  }

  const Tape& tape_;
  std::span<const std::string> inputs_;
  std::span<const std::string> parameters_;
  Language language_;
  std::string prefix_ = "t";
  std::vector<std::size_t> uses_;
  std::vector<bool> named_;  // a function names it twice
  std::vector<bool> inner_;  // an operand, rather than an output alone
  std::vector<Text> texts_;
  SourceText result_;
};

}  // namespace

Expected<SourceText> source_text(const Tape& tape, std::span<const std::string> inputs,
                                 std::span<const std::string> parameters, Language language) {
  const auto check = [](std::string_view what, std::size_t got,
                        std::size_t wanted) -> Expected<void> {
    if (got >= wanted) {
      return {};
    }
    return refusal(ArgumentError::wrong_shape, "source_text", what)
        .got(flyball::detail::format("{} names", got))
        .expected(flyball::detail::format("{}, one for each", wanted));
  };
  FLYBALL_CHECK(check("inputs", inputs.size(), tape.inputs()));
  FLYBALL_CHECK(check("parameters", parameters.size(), tape.parameters()));
  for (const Node& node : tape.nodes()) {
    if (language == Language::java && node.operation == erf) {
      return refusal(ExpressionError::no_counterpart, "source_text", "erf")
          .got("not in Java's library")
          .hint("leave it out of the formula, or write C++");
    }
  }
  return Writer(tape, inputs, parameters, language).run();
}

}  // namespace flyball::expression
