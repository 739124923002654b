#pragma once

#include <cstdint>
#include <vector>

#include <flyball/math/expression/tape.hpp>

#include "optimization/problem/flat_problem.hpp"

/// What flattening a problem, and giving a flat one other numbers, have in common.
namespace flyball::optimization::detail {

/// A node and what it is multiplied by.
struct Part {
  std::uint32_t node;
  double factor;
};

/// The value of a node of constant degree, of those of its operands.
inline double number_of(const ExpressionGraph& graph, std::uint32_t i,
                        const std::vector<double>& numbers) {
  using expression::Operation;
  const expression::Node& node = graph.nodes()[i];
  if (node.operation == Operation::constant) {
    return node.value();
  }
  if (node.operation == Operation::parameter) {
    return graph.parameter_values[node.a];
  }
  const int operands = expression::operand_count(node.operation);
  return expression::apply<double>(node.operation, numbers[node.a],
                                   operands > 1 ? numbers[node.b] : 0.0,
                                   operands > 2 ? numbers[node.c] : 0.0);
}

/// Sums and multiples are taken apart: numbers are added to `offset`, linear parts go to
/// `linear(variable, factor)`, others to `leaf(Part)`.
template <class Linear, class Leaf>
void take_apart(const ExpressionGraph& graph, const std::vector<double>& numbers,
                std::vector<Part>& stack, Part root, double& offset, Linear&& linear, Leaf&& leaf) {
  using expression::Operation;
  const expression::Node* const nodes = graph.nodes().data();
  stack.clear();
  // What a node leads to first is gone to at once, only what comes after waits.
  for (Part at = root;;) {
    const auto [i, c] = at;
    const expression::Node& node = nodes[i];
    bool goes_on = false;
    const auto go = [&](std::uint32_t to, double factor) {
      at = {to, factor};
      goes_on = true;
    };
    if (graph.degree(i) == Degree::constant) {
      offset += c * numbers[i];
    } else {
      switch (node.operation) {
        case Operation::input:
          linear(static_cast<int>(node.a), c);
          break;
        case Operation::add:
          stack.push_back({node.b, c});
          go(node.a, c);
          break;
        case Operation::subtract:
          stack.push_back({node.b, -c});
          go(node.a, c);
          break;
        case Operation::negate:
          go(node.a, -c);
          break;
        case Operation::multiply:
          if (graph.degree(node.a) == Degree::constant) {
            go(node.b, c * numbers[node.a]);
          } else if (graph.degree(node.b) == Degree::constant) {
            go(node.a, c * numbers[node.b]);
          } else {
            leaf(at);
          }
          break;
        case Operation::divide:
          if (graph.degree(node.b) == Degree::constant) {
            go(node.a, c / numbers[node.b]);
          } else {
            leaf(at);
          }
          break;
        case Operation::power:
          if (graph.degree(i) == Degree::linear) {  // x¹
            go(node.a, c);
          } else {
            leaf(at);
          }
          break;
        default:
          leaf(at);
          break;
      }
    }
    if (!goes_on) {
      if (stack.empty()) {
        return;
      }
      at = stack.back();
      stack.pop_back();
    }
  }
}

/// Narrows the variable's bounds; notes where no number is left between them.
void state_bound(FlatProblem& flat, const BoundStatement& bound);

}  // namespace flyball::optimization::detail
