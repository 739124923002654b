#include <algorithm>
#include <cmath>

#include <flyball/math/expression/tape.hpp>

#include "optimization/problem/kinks.hpp"

namespace flyball::optimization::detail {

using expression::Node;
using expression::Operation;

namespace {

/// What makes matters worse: that a node grows, that it falls, or what is not known.
constexpr unsigned never = 0;
constexpr unsigned growing = 1;
constexpr unsigned falling = 2;
constexpr unsigned unknown = 4;

unsigned turned(unsigned worse) {
  return ((worse & growing) != 0 ? falling : never) | ((worse & falling) != 0 ? growing : never) |
         (worse & unknown);
}

bool is_number(const Node& node) {
  return node.operation == Operation::constant;
}

/// A sum's or a multiple's factors before a and b; 0: it is neither, or hangs on its operands
/// otherwise.
struct Factors {
  double a = 0.0;
  double b = 0.0;
};

Factors factors_of(const std::vector<Node>& nodes, const Node& node) {
  switch (node.operation) {
    case Operation::add:
      return {1.0, 1.0};
    case Operation::subtract:
      return {1.0, -1.0};
    case Operation::negate:
      return {-1.0, 0.0};
    case Operation::multiply:
      if (is_number(nodes[node.a])) {
        return {0.0, nodes[node.a].value()};
      }
      return {is_number(nodes[node.b]) ? nodes[node.b].value() : 0.0, 0.0};
    case Operation::divide:
      return {is_number(nodes[node.b]) ? 1.0 / nodes[node.b].value() : 0.0, 0.0};
    default:
      return {};
  }
}

/// e of √(e²).
bool is_root_of_square(const std::vector<Node>& nodes, const Node& node, std::uint32_t& e) {
  if (node.operation != Operation::sqrt) {
    return false;
  }
  const Node& square = nodes[node.a];
  const bool product = square.operation == Operation::multiply && square.a == square.b;
  const bool power = square.operation == Operation::power && is_number(nodes[square.b]) &&
                     nodes[square.b].value() == 2.0;
  e = square.a;
  return product || power;
}

}  // namespace

bool KinkFree::state(ExpressionGraph& graph, const Expression& of_cost, double sign,
                     const Constraints& of_constraints) {
  cost = {};
  constraints.clear();
  kinks_.clear();
  const std::size_t count = graph.nodes().size();
  std::vector<unsigned char> worse(count, never);
  const auto mark = [&](std::uint32_t node, unsigned how) {
    worse[node] = static_cast<unsigned char>(worse[node] | how);
  };
  if (!of_cost.is_constant()) {
    mark(of_cost.node(), sign > 0.0 ? growing : falling);
  }
  for (const Constraint& constraint : of_constraints) {  // c ≥ 0
    if (!constraint.value.is_constant()) {
      mark(constraint.value.node(), constraint.equality ? unknown : falling);
    }
  }
  // From what is stated down to what it is made of; operands come before what they are in.
  for (std::size_t i = count; i-- > 0;) {
    const std::vector<Node>& nodes = graph.nodes();
    const Node& node = nodes[i];
    const unsigned how = worse[i];
    const int operands = expression::operand_count(node.operation);
    if (how == never || operands == 0 ||
        graph.degree(static_cast<std::uint32_t>(i)) == Degree::constant) {
      continue;
    }
    std::uint32_t e = 0;
    const bool magnitude = node.operation == Operation::abs || is_root_of_square(nodes, node, e);
    const bool largest = node.operation == Operation::maximum;
    const bool least = node.operation == Operation::minimum;
    if (((magnitude || largest) && how == growing) || (least && how == falling)) {
      kinks_.push_back(static_cast<std::uint32_t>(i));
      mark(node.a, magnitude ? unknown : how);
      if (!magnitude) {
        mark(node.b, how);
      }
      continue;
    }
    const Factors factors = factors_of(nodes, node);
    for (int k = 0; k < operands; ++k) {
      const double factor = k == 0 ? factors.a : k == 1 ? factors.b : 0.0;
      mark(k == 0   ? node.a
           : k == 1 ? node.b
                    : node.c,
           factor > 0.0   ? how
           : factor < 0.0 ? turned(how)
                          : unknown);
    }
  }
  if (kinks_.empty()) {
    return false;
  }
  std::reverse(kinks_.begin(), kinks_.end());  // inner ones first

  // Sums of what has become a variable, written anew.
  std::vector<std::uint32_t> now(count);
  const auto of = [&](const Expression& value) {
    return value.is_constant() ? value : Expression(&graph, now[value.node()]);
  };
  const auto hold = [&](Operation operation, std::uint32_t a, std::uint32_t b) {
    constraints.push_back({Expression(&graph, graph.binary(operation, a, b)), false});
  };
  Constraints held;
  std::swap(constraints, held);
  auto kink = kinks_.begin();
  for (std::uint32_t i = 0; i < count; ++i) {
    now[i] = i;
    if (worse[i] == never) {
      continue;
    }
    const Node node = graph.nodes()[i];
    if (kink != kinks_.end() && *kink == i) {
      ++kink;
      auto [known, is_new] = variable_of_.try_emplace(i, 0U);
      if (is_new) {
        known->second = graph.input();
      }
      const std::uint32_t t = now[i] = known->second;
      std::uint32_t e = node.a;
      if (node.operation == Operation::abs || is_root_of_square(graph.nodes(), node, e)) {
        hold(Operation::subtract, t, e);
        hold(Operation::add, t, e);
      } else if (node.operation == Operation::maximum) {
        hold(Operation::subtract, t, now[node.a]);
        hold(Operation::subtract, t, now[node.b]);
      } else {
        hold(Operation::subtract, now[node.a], t);
        hold(Operation::subtract, now[node.b], t);
      }
      continue;
    }
    const int operands = expression::operand_count(node.operation);
    const bool moved =
        (operands > 0 && now[node.a] != node.a) || (operands > 1 && now[node.b] != node.b);
    if (moved) {
      now[i] = operands == 1 ? graph.unary(node.operation, now[node.a])
                             : graph.binary(node.operation, now[node.a], now[node.b]);
    }
  }
  std::swap(constraints, held);
  cost = of(of_cost);
  for (const Constraint& constraint : of_constraints) {
    constraints.push_back({of(constraint.value), constraint.equality});
  }
  constraints.insert(constraints.end(), held.begin(), held.end());
  return true;
}

void KinkFree::start(ExpressionGraph& graph) const {
  const expression::Tape tape = graph.tape(kinks_);
  std::vector<double> work(tape.size());
  std::vector<double> values(kinks_.size());
  tape.prepare<double>(graph.parameter_values, work);
  tape.evaluate<double>(graph.values, values, work);
  for (std::size_t k = 0; k < kinks_.size(); ++k) {
    graph.values[graph.nodes()[variable_of_.at(kinks_[k])].a] =
        std::isfinite(values[k]) ? values[k] : 0.0;
  }
}

bool KinkFree::is_own(const ExpressionGraph& graph, std::size_t variable) const {
  return std::any_of(variable_of_.begin(), variable_of_.end(),
                     [&](const auto& known) { return graph.nodes()[known.second].a == variable; });
}

}  // namespace flyball::optimization::detail
