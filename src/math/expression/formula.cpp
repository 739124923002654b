#include <flyball/math/expression/formula.hpp>

#include <cmath>
#include <utility>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "math/expression/syntax.hpp"
#include "math/expression/token.hpp"

namespace flyball::expression {

namespace {

constexpr std::size_t longest_text = 100'000;
constexpr std::size_t most_nodes = 1'000'000;

/// One set on its way to a tape: first the names, then the formulas in order.
class Compiler {
 public:
  explicit Compiler(const FormulaSet& set)
      : set_(set), tape_(set.variables.size(), set.parameters.size()) {}

  tl::expected<CompiledFormulas, std::vector<Error>> run() {
    declare_all();
    for (std::size_t k = 0; k < set_.definitions.size(); ++k) {
      const auto [meaning, slot] = read(set_.definitions[k], true);
      if (const auto index = definitions_[k]) {
        Symbol& symbol = symbols_[*index];
        symbol.meaning = meaning;
        symbol.slot = slot;
        symbol.usable = true;
      }
    }
    std::vector<Slot> outputs;
    for (const Formula& formula : set_.outputs) {
      const auto [meaning, slot] = read(formula, false);
      outputs.push_back(slot);
      result_.outputs.push_back(meaning.dimension);
    }
    if (!errors_.empty()) {
      return tl::unexpected(std::move(errors_));
    }
    result_.tape = tape_.finish(outputs);
    return std::move(result_);
  }

 private:
  void declare_all() {
    for (std::size_t k = 0; k < set_.variables.size(); ++k) {
      const Variable& variable = set_.variables[k];
      const auto unit = unit_of(variable.name, variable.unit);
      declare({.name = variable.name,
               .kind = Symbol::Kind::variable,
               .number = k,
               .meaning = {.certain = true, .dimension = dimension_of(unit)}});
    }
    for (std::size_t k = 0; k < set_.parameters.size(); ++k) {
      const Parameter& parameter = set_.parameters[k];
      const auto unit = unit_of(parameter.name, parameter.unit);
      const double value = unit ? parameter.value * unit->factor : parameter.value;
      if (!std::isfinite(value)) {
        errors_.push_back(Error(ExpressionError::not_finite)
                              .about(parameter.name)
                              .got(detail::format("{}", value))
                              .expected("finite"));
      }
      result_.parameters.push_back(value);
      declare({.name = parameter.name,
               .kind = Symbol::Kind::parameter,
               .number = k,
               .meaning = {.certain = true, .dimension = dimension_of(unit)}});
    }
    for (std::size_t k = 0; k < set_.definitions.size(); ++k) {
      definitions_.push_back(declare({.name = set_.definitions[k].name,
                                      .kind = Symbol::Kind::definition,
                                      .number = k,
                                      .usable = false}));
    }
  }

  static std::optional<SiDimension> dimension_of(const std::optional<SiUnit>& unit) {
    return unit ? std::optional(unit->dimension) : std::nullopt;
  }

  /// The unit of something, nothing if it is not said or cannot be read.
  std::optional<SiUnit> unit_of(const std::string& name, const std::string& text) {
    if (text.empty()) {
      return std::nullopt;
    }
    auto unit = parse_si_unit(text);
    if (!unit) {
      errors_.push_back(Error(ExpressionError::unknown_unit)
                            .about(name)
                            .got(detail::format("in \"{}\"", text))
                            .hint(to_string(unit.error())));
      return std::nullopt;
    }
    return *unit;
  }

  /// @return where the name stands, nothing if it cannot be had.
  std::optional<std::uint32_t> declare(Symbol symbol) {
    const std::string name = symbol.name;
    if (!is_name(name)) {
      errors_.push_back(Error(ExpressionError::unusable_name)
                            .about(detail::format("\"{}\"", name))
                            .got("not a name")
                            .expected("letters, digits and underscores, a letter first"));
      return std::nullopt;
    }
    if (find_function(name) != nullptr) {
      errors_.push_back(Error(ExpressionError::unusable_name)
                            .about(detail::format("\"{}\"", name))
                            .got("the name of a function")
                            .hint("choose another name"));
      return std::nullopt;
    }
    if (!symbols_.add(std::move(symbol))) {
      errors_.push_back(Error(ExpressionError::duplicate_name)
                            .about(detail::format("\"{}\"", name))
                            .got("given to two of the variables, parameters and definitions")
                            .hint("choose another name for one of them"));
      return std::nullopt;
    }
    return symbols_.find(name);
  }

  std::pair<Meaning, Slot> read(const Formula& formula, bool is_definition) {
    Complaints complaints(formula.name, formula.text, errors_);
    const Place whole{0, formula.text.size()};
    const auto unit = unit_of(formula.name, formula.unit);
    if (formula.text.size() > longest_text) {
      complaints.add(Error(ExpressionError::too_large)
                         .got(detail::format("{} bytes of text", formula.text.size()))
                         .expected(detail::format("at most {}", longest_text))
                         .hint("name parts of it as definitions"),
                     {0, 1});
      return {};
    }
    const SyntaxTree tree = parse(formula.text, symbols_, complaints);
    const bool readable = !complaints.any();
    Meaning meaning = check_meaning(tree, symbols_, complaints);
    if (readable && meaning.truth && (!is_definition || unit)) {
      complaints.add(Error(ExpressionError::wrong_type)
                         .about(complaints.quote(whole))
                         .got("a comparison")
                         .expected("a number, such as if(x > 0, 1, 0)"),
                     whole);
    }
    if (unit && meaning.dimension && !meaning.fits_any() &&
        !meaning.dimension->fits(unit->dimension)) {
      complaints.add(Error(ExpressionError::unit_mismatch)
                         .about(complaints.quote(whole))
                         .got("in " + to_text(*meaning.dimension))
                         .expected(detail::format("in {}, the unit of {}", to_text(unit->dimension),
                                                  formula.name)),
                     whole);
    }
    if (unit) {
      meaning.dimension = unit->dimension;
      meaning.certain = true;
    }
    if (!errors_.empty()) {
      meaning.constant = complaints.any() ? std::nullopt : meaning.constant;
      return {meaning, {}};
    }
    const Slot slot = write_on(tape_, tree, symbols_);
    if (tape_.size() > most_nodes) {
      complaints.add(Error(ExpressionError::too_large)
                         .got(detail::format("more than {} operations", most_nodes))
                         .hint("use fewer formulas"),
                     {0, 1});
    }
    return {meaning, slot};
  }

  const FormulaSet& set_;
  TapeBuilder tape_;
  SymbolTable symbols_;
  std::vector<std::optional<std::uint32_t>> definitions_;
  std::vector<Error> errors_;
  CompiledFormulas result_;
};

}  // namespace

tl::expected<CompiledFormulas, std::vector<Error>> compile(const FormulaSet& set) {
  return Compiler(set).run();
}

ErrorInfo error_info(ExpressionError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"empty_formula", "the formula is empty", ErrorKind::misuse},
      {"too_large", "the formula is too large", ErrorKind::misuse},
      {"too_deep", "the formula is nested too deeply here", ErrorKind::misuse},
      {"stray_character", "this character means nothing here", ErrorKind::misuse},
      {"malformed_number", "this number cannot be read", ErrorKind::misuse},
      {"missing_operand", "a value is missing here", ErrorKind::misuse},
      {"missing_operator", "an operator is missing here", ErrorKind::misuse},
      {"unclosed_parenthesis", "this parenthesis is not closed", ErrorKind::misuse},
      {"unopened_parenthesis", "this parenthesis was not opened", ErrorKind::misuse},
      {"unexpected_symbol", "this symbol is out of place", ErrorKind::misuse},
      {"assignment", "= assigns, and nothing can be assigned here", ErrorKind::misuse},
      {"chained_comparison", "this comparison compares a comparison", ErrorKind::misuse},
      {"unknown_name", "this name is not known", ErrorKind::misuse},
      {"unknown_function", "this function is not known", ErrorKind::misuse},
      {"wrong_arity", "the number of arguments does not fit", ErrorKind::misuse},
      {"wrong_type", "comparisons and numbers are mixed", ErrorKind::misuse},
      {"unit_mismatch", "the units do not add up", ErrorKind::misuse},
      {"unusable_name", "the name cannot be used in formulas", ErrorKind::misuse},
      {"duplicate_name", "the name is given twice", ErrorKind::misuse},
      {"unknown_unit", "the unit cannot be read", ErrorKind::misuse},
      {"not_finite", "NaN or infinity", ErrorKind::misuse},
      {"no_counterpart", "the language has no such operation", ErrorKind::misuse},
  };
  return detail::info_of(code, "expression", rows);
}

}  // namespace flyball::expression
