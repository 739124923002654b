#include <numbers>
#include <utility>

#include <flyball/core/text.hpp>

#include "math/expression/syntax.hpp"

namespace flyball::expression {

SymbolTable::SymbolTable() {
  const auto constant = [&](const char* name, double value) {
    add({.name = name,
         .kind = Symbol::Kind::constant,
         .meaning = {.certain = true, .dimension = SiDimension{}, .constant = value}});
  };
  constant("pi", std::numbers::pi);
  constant("π", std::numbers::pi);
  constant("e", std::numbers::e);
  constant("tau", 2.0 * std::numbers::pi);
}

bool SymbolTable::add(Symbol symbol) {
  const auto number = static_cast<std::uint32_t>(symbols_.size());
  const auto [found, is_new] = by_name_.try_emplace(symbol.name, number);
  if (!is_new) {
    if (symbols_[found->second].kind != Symbol::Kind::constant) {
      return false;
    }
    found->second = number;
  }
  symbols_.push_back(std::move(symbol));
  return true;
}

std::optional<std::uint32_t> SymbolTable::find(std::string_view name) const {
  const auto found = by_name_.find(std::string(name));
  return found == by_name_.end() ? std::nullopt : std::optional(found->second);
}

std::string SymbolTable::nearest(std::string_view name, bool among_functions) const {
  constexpr std::size_t longest = 64;
  if (name.size() > longest) {
    return "";
  }
  std::vector<std::string_view> names;
  if (among_functions) {
    for (const Function& function : functions) {
      names.push_back(function.name);
    }
  } else {
    for (const Symbol& symbol : symbols_) {
      if (symbol.usable && symbol.name.size() <= longest) {
        names.push_back(symbol.name);
      }
    }
  }
  return nearest_name(name, names);
}

Slot write_on(TapeBuilder& tape, const SyntaxTree& tree, const SymbolTable& symbols) {
  std::vector<Slot> slots;
  slots.reserve(tree.nodes.size());
  const auto symbol_slot = [&](const Symbol& symbol) {
    switch (symbol.kind) {
      case Symbol::Kind::variable:
        return tape.input(symbol.number);
      case Symbol::Kind::parameter:
        return tape.parameter(symbol.number);
      case Symbol::Kind::definition:
        return symbol.slot;
      case Symbol::Kind::constant:
        break;
    }
    return tape.constant(symbol.meaning.constant.value_or(0.0));
  };
  const auto call_slot = [&](const SyntaxNode& node) {
    const auto operand = [&](std::uint32_t k) { return slots[tree.operands[node.first + k]]; };
    const Operation operation = node.function->operation;
    if (operation == Operation::select) {
      return tape.select(operand(0), operand(1), operand(2));
    }
    if (node.count == 1) {
      return tape.unary(operation, operand(0));
    }
    Slot result = tape.binary(operation, operand(0), operand(1));
    if (node.function->name == "clamp") {
      return tape.binary(Operation::minimum, result, operand(2));
    }
    for (std::uint32_t k = 2; k < node.count; ++k) {
      result = tape.binary(operation, result, operand(k));
    }
    return result;
  };
  for (const SyntaxNode& node : tree.nodes) {
    slots.push_back(node.kind == SyntaxNode::Kind::number   ? tape.constant(node.number)
                    : node.kind == SyntaxNode::Kind::symbol ? symbol_slot(symbols[node.symbol])
                                                            : call_slot(node));
  }
  return slots.back();
}

}  // namespace flyball::expression
