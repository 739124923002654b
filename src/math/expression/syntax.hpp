#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <flyball/core/unit_algebra.hpp>
#include <flyball/math/expression/tape_builder.hpp>

#include "math/expression/complaints.hpp"
#include "math/expression/function_table.hpp"

namespace flyball::expression {

/// What is known of a value without computing it.
struct Meaning {
  bool truth = false;                      ///< A comparison, rather than a number.
  bool certain = false;                    ///< Whether it is known which of the two.
  std::optional<SiDimension> dimension{};  ///< Of a number; nothing: not known.
  std::optional<double> constant{};        ///< Its value, if the formula alone gives it.

  /// A literal zero has any unit.
  [[nodiscard]] bool fits_any() const noexcept { return constant == 0.0; }
};

/// What a name stands for.
struct Symbol {
  enum class Kind : std::uint8_t { variable, parameter, definition, constant };

  std::string name;
  Kind kind = Kind::variable;
  std::size_t number = 0;  ///< Among its kind.
  Meaning meaning{};
  bool usable = true;  ///< A definition: once it was read.
  Slot slot{};         ///< A definition's value.
};

/// The names of a set, and pi, π, e and tau behind them.
class SymbolTable {
 public:
  SymbolTable();

  /// Adds a name; false if there is one already that is not a constant's.
  bool add(Symbol symbol);
  [[nodiscard]] std::optional<std::uint32_t> find(std::string_view name) const;
  [[nodiscard]] Symbol& operator[](std::uint32_t index) { return symbols_[index]; }
  [[nodiscard]] const Symbol& operator[](std::uint32_t index) const { return symbols_[index]; }
  /// The usable name nearest to one, or nothing.
  [[nodiscard]] std::string nearest(std::string_view name, bool among_functions) const;

 private:
  std::vector<Symbol> symbols_;
  std::unordered_map<std::string, std::uint32_t> by_name_;
};

/// A part of a formula. Parts stand behind their operands.
struct SyntaxNode {
  enum class Kind : std::uint8_t { number, symbol, call, mistake };

  Kind kind = Kind::mistake;
  Place place;  ///< All of it.
  Place mark;   ///< Its operator or function.
  const Function* function = nullptr;
  double number = 0.0;
  std::uint32_t symbol = 0;
  std::uint32_t first = 0;  ///< Its operands in SyntaxTree::operands.
  std::uint32_t count = 0;
  bool doubtful = false;  ///< Made of a mistake: what it means is not asked.
};

/// A formula taken apart; its last node is the whole.
struct SyntaxTree {
  std::vector<SyntaxNode> nodes;
  std::vector<std::uint32_t> operands;
};

/// Takes a formula apart. Where it has mistakes they are reported, and the tree has what could be
/// made of the rest.
[[nodiscard]] SyntaxTree parse(std::string_view text, const SymbolTable& symbols,
                               Complaints& complaints);

/// What a formula computes; units that do not fit are reported.
[[nodiscard]] Meaning check_meaning(const SyntaxTree& tree, const SymbolTable& symbols,
                                    Complaints& complaints);

/// Writes a formula without mistakes on a tape.
[[nodiscard]] Slot write_on(TapeBuilder& tape, const SyntaxTree& tree, const SymbolTable& symbols);

}  // namespace flyball::expression
