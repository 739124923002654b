#include <flyball/math/expression/tape_builder.hpp>

#include <cmath>
#include <cstdlib>
#include <utility>

namespace flyball::expression {

namespace {

using enum Operation;

bool commutes(Operation operation) {
  switch (operation) {
    case add:
    case multiply:
    case hypot:
    case equal:
    case not_equal:
    case logical_and:
    case logical_or:
      return true;
    default:
      return false;
  }
}

}  // namespace

std::size_t TapeBuilder::Hash::operator()(const Node& node) const noexcept {
  std::uint64_t hash = static_cast<std::uint64_t>(node.operation);
  for (const std::uint32_t part : {node.a, node.b, node.c}) {
    hash = (hash ^ part) * 0x9E3779B97F4A7C15U;  // Fibonacci hashing
    hash ^= hash >> 29U;
  }
  return static_cast<std::size_t>(hash);
}

Slot TapeBuilder::intern(const Node& node) {
  const auto [found, is_new] = known_.try_emplace(node, static_cast<std::uint32_t>(nodes_.size()));
  if (is_new) {
    nodes_.push_back(node);
  }
  return {found->second};
}

std::optional<double> TapeBuilder::constant_value(Slot slot) const {
  const Node& node = nodes_[slot.index];
  return node.operation == Operation::constant ? std::optional(node.value()) : std::nullopt;
}

Slot TapeBuilder::constant(double value) {
  return intern(Node::constant(value));
}

Slot TapeBuilder::parameter(std::size_t number) {
  parameters_ = std::max(parameters_, number + 1);
  return intern({Operation::parameter, static_cast<std::uint32_t>(number), 0, 0});
}

Slot TapeBuilder::input(std::size_t number) {
  inputs_ = std::max(inputs_, number + 1);
  return intern({Operation::input, static_cast<std::uint32_t>(number), 0, 0});
}

Slot TapeBuilder::unary(Operation operation, Slot a) {
  if (const auto x = constant_value(a)) {
    return constant(apply<double>(operation, *x, 0.0, 0.0));
  }
  if (operation == negate && nodes_[a.index].operation == negate) {
    return {nodes_[a.index].a};
  }
  return intern({operation, a.index, 0, 0});
}

Slot TapeBuilder::binary(Operation operation, Slot a, Slot b) {
  const auto x = constant_value(a);
  const auto y = constant_value(b);
  if (x && y) {
    return constant(apply<double>(operation, *x, *y, 0.0));
  }
  if (const auto slot = simpler(operation, a, b)) {
    return *slot;
  }
  if (commutes(operation) && b.index < a.index) {
    std::swap(a, b);
  }
  return intern({operation, a.index, b.index, 0});
}

std::optional<Slot> TapeBuilder::simpler(Operation operation, Slot a, Slot b) {
  const auto x = constant_value(a);
  const auto y = constant_value(b);
  const auto negated = [&](Slot slot) -> std::optional<Slot> {
    const Node& node = nodes_[slot.index];
    return node.operation == negate ? std::optional(Slot{node.a}) : std::nullopt;
  };
  switch (operation) {
    case add:
      if (x == 0.0) {
        return b;
      }
      if (y == 0.0) {
        return a;
      }
      if (const auto minus = negated(b)) {
        return binary(subtract, a, *minus);
      }
      if (const auto minus = negated(a)) {
        return binary(subtract, b, *minus);
      }
      return std::nullopt;
    case subtract:
      if (x == 0.0) {
        return unary(negate, b);
      }
      if (y == 0.0) {
        return a;
      }
      if (const auto minus = negated(b)) {
        return binary(add, a, *minus);
      }
      return std::nullopt;
    case chain:
      if ((x && *x != 0.0 && std::isfinite(*x)) || (y && *y != 0.0 && std::isfinite(*y))) {
        return binary(multiply, a, b);
      }
      return std::nullopt;
    case multiply:
      if (x == 1.0) {
        return b;
      }
      if (y == 1.0) {
        return a;
      }
      if (x == -1.0) {
        return unary(negate, b);
      }
      if (y == -1.0) {
        return unary(negate, a);
      }
      return std::nullopt;
    case divide:
      if (y == 1.0) {
        return a;
      }
      if (y == -1.0) {
        return unary(negate, a);
      }
      return std::nullopt;
    case power:
      return y ? simpler_power(a, *y) : std::nullopt;
    default:
      return std::nullopt;
  }
}

std::optional<Slot> TapeBuilder::simpler_power(Slot base, double exponent) {
  if (exponent == 0.0) {
    return constant(1.0);
  }
  if (std::abs(exponent) == 0.5) {
    const Slot root = unary(sqrt, base);
    return exponent > 0.0 ? root : binary(divide, constant(1.0), root);
  }
  if (exponent != std::round(exponent) || std::abs(exponent) > 16.0) {
    return std::nullopt;
  }
  if (exponent < 0.0) {
    return binary(divide, constant(1.0), *simpler_power(base, -exponent));
  }
  std::optional<Slot> product;
  Slot square = base;
  for (int left = static_cast<int>(exponent); left > 0; left /= 2) {
    if (left % 2 == 1) {
      product = product ? binary(multiply, *product, square) : square;
    }
    if (left > 1) {
      square = binary(multiply, square, square);
    }
  }
  return product;
}

Slot TapeBuilder::select(Slot condition, Slot then, Slot otherwise) {
  if (const auto value = constant_value(condition)) {
    return *value == 0.0 ? otherwise : then;
  }
  return then == otherwise
             ? then
             : intern({Operation::select, condition.index, then.index, otherwise.index});
}

Slot TapeBuilder::node(const Node& node) {
  switch (node.operation) {
    case Operation::constant:
      return constant(node.value());
    case Operation::parameter:
      return parameter(node.a);
    case Operation::input:
      return input(node.a);
    case Operation::select:
      return select({node.a}, {node.b}, {node.c});
    default:
      return operand_count(node.operation) == 1 ? unary(node.operation, {node.a})
                                                : binary(node.operation, {node.a}, {node.b});
  }
}

Tape TapeBuilder::finish(std::span<const Slot> outputs) const {
  std::vector<bool> needed(nodes_.size(), false);
  for (const Slot output : outputs) {
    needed[output.index] = true;
  }
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    const int operands = needed[i] ? operand_count(nodes_[i].operation) : 0;
    for (int k = 0; k < operands; ++k) {
      needed[k == 0 ? nodes_[i].a : k == 1 ? nodes_[i].b : nodes_[i].c] = true;
    }
  }

  Tape tape;
  tape.inputs_ = inputs_;
  tape.parameters_ = parameters_;
  std::vector<std::uint32_t> moved(nodes_.size(), 0);
  const auto append = [&](std::size_t i) {
    Node node = nodes_[i];
    const int operands = operand_count(node.operation);
    node.a = operands > 0 ? moved[node.a] : node.a;
    node.b = operands > 1 ? moved[node.b] : node.b;
    node.c = operands > 2 ? moved[node.c] : node.c;
    moved[i] = static_cast<std::uint32_t>(tape.nodes_.size());
    tape.nodes_.push_back(node);
  };
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (needed[i] && nodes_[i].operation == Operation::constant) {
      append(i);
    }
  }
  tape.constants_ = tape.nodes_.size();
  // All parameters and inputs are there, in their order, needed or not.
  const auto append_all = [&](Operation kind, std::size_t count) {
    const std::size_t first = tape.nodes_.size();
    for (std::size_t k = 0; k < count; ++k) {
      tape.nodes_.push_back({kind, static_cast<std::uint32_t>(k), 0, 0});
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].operation == kind) {
        moved[i] = static_cast<std::uint32_t>(first + nodes_[i].a);
      }
    }
  };
  append_all(Operation::parameter, parameters_);

  std::vector<bool> varies(nodes_.size(), false);
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    const int operands = operand_count(node.operation);
    varies[i] = node.operation == Operation::input || (operands > 0 && varies[node.a]) ||
                (operands > 1 && varies[node.b]) || (operands > 2 && varies[node.c]);
    if (needed[i] && operands > 0 && !varies[i]) {
      append(i);
    }
  }
  tape.first_input_ = tape.nodes_.size();
  append_all(Operation::input, inputs_);
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (needed[i] && varies[i] && nodes_[i].operation != Operation::input) {
      append(i);
    }
  }
  for (const Slot output : outputs) {
    tape.outputs_.push_back({moved[output.index]});
  }
  return tape;
}

}  // namespace flyball::expression
