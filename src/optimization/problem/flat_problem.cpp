#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include <flyball/math/expression/tape_builder.hpp>

#include "core/constants.hpp"
#include "optimization/problem/flat_problem.hpp"
#include "optimization/problem/flat_walk.hpp"

namespace flyball::optimization::detail {

using expression::Node;
using expression::Operation;
using expression::Slot;
using expression::TapeBuilder;

namespace {

/// Codes of a key beside those of operations.
enum Code : std::uint32_t { of_variable = 2000, of_number };

struct KeyHash {
  std::size_t operator()(const std::vector<std::uint32_t>& key) const noexcept {
    std::uint64_t hash = key.size();
    for (const std::uint32_t part : key) {
      hash = (hash ^ part) * 0x9E3779B97F4A7C15U;
      hash ^= hash >> 29U;
    }
    return static_cast<std::size_t>(hash);
  }
};

class Flattener {
 public:
  Flattener(const ExpressionGraph& graph, FlatProblem& flat)
      : graph_(graph),
        nodes_(graph.nodes().data()),
        flat_(flat),
        numbers_(flat.numbers),
        seen_(graph.nodes().size(), 0),
        local_(graph.nodes().size(), 0),
        column_at_(static_cast<std::size_t>(flat.variables), -1) {
    // Values of what does not depend on variables, and what depends on parameters.
    const std::size_t nodes = graph.nodes().size();
    numbers_.assign(nodes, 0.0);
    if (graph.parameters() > 0) {
      parametric_.assign(nodes, 0);
    }
    for (std::uint32_t i = 0; i < nodes; ++i) {
      if (graph.degree(i) == Degree::constant) {
        numbers_[i] = number_of(graph, i, numbers_);
      }
      if (graph.parameters() > 0 && depends(nodes_[i])) {
        parametric_[i] = 1;
        if (graph.degree(i) == Degree::constant) {
          flat.parametric_nodes.push_back(i);
        }
      }
    }
  }

  void cost(std::uint32_t root, double sign) {
    flat_.cost_coefficients.assign(static_cast<std::size_t>(flat_.variables), 0.0);
    flat_.cost_is_parametric = is_parametric(root);
    take_apart(
        graph_, numbers_, stack_, Part{root, sign}, flat_.cost_offset,
        [&](int variable, double c) {
          flat_.cost_coefficients[static_cast<std::size_t>(variable)] += c;
        },
        [&](const Part& part) {  // terms of the cost are each their own
          leaves_.assign(1, part);
          term(leaves_, -1);
          if (flat_.cost_is_parametric) {
            flat_.cost_terms.push_back({term_shape_, term_});
          }
        });
  }

  void constraint(std::uint32_t root, bool equality, int number) {
    const int row = flat_.rows();
    number_ = number;
    double offset = 0.0;
    const std::size_t begin = flat_.columns.size();
    leaves_.clear();
    take_apart(
        graph_, numbers_, stack_, Part{root, 1.0}, offset,
        [&](int variable, double c) {
          int& at = column_at_[static_cast<std::size_t>(variable)];
          if (at >= static_cast<int>(begin)) {
            flat_.coefficients[static_cast<std::size_t>(at)] += c;
            return;
          }
          at = static_cast<int>(flat_.columns.size());
          flat_.columns.push_back(variable);
          flat_.coefficients.push_back(c);
        },
        [&](const Part& part) { leaves_.push_back(part); });
    for (std::size_t i = begin; i < flat_.columns.size(); ++i) {
      column_at_[static_cast<std::size_t>(flat_.columns[i])] = -1;
    }
    const std::size_t count = flat_.columns.size() - begin;
    if (!std::isfinite(offset) || (count > 0 && !std::isfinite(flat_.coefficients.back()))) {
      flat_.not_finite = flat_.not_finite == -1 ? number : flat_.not_finite;
    }
    if (count <= 1 && leaves_.empty()) {
      const double slope = count == 1 ? flat_.coefficients.back() : 0.0;
      const int variable = count == 1 ? flat_.columns.back() : 0;
      flat_.columns.resize(begin);
      flat_.coefficients.resize(begin);
      flat_.bounds.push_back({variable, slope, offset, equality, number});
      state_bound(flat_, flat_.bounds.back());
      if (is_parametric(root)) {
        flat_.parametric.push_back({number, -1, flat_.bounds.size() - 1, -1, 0});
      }
      return;
    }
    if (!leaves_.empty()) {
      term(leaves_, row);
    }
    if (is_parametric(root)) {
      flat_.parametric.push_back(
          {number, row, 0, leaves_.empty() ? -1 : static_cast<std::ptrdiff_t>(term_shape_), term_});
    }
    flat_.offsets.push_back(offset);
    flat_.row_start.push_back(static_cast<int>(flat_.columns.size()));
    flat_.equality.push_back(equality ? 1 : 0);
    flat_.constraint.push_back(number);
  }

 private:
  /// A weighted sum that is not linear: its key is its operations, in an order of their own, with
  /// its variables and numbers by their places; terms of one key are of one shape.
  void term(const std::vector<Part>& roots, int row) {
    key_.clear();
    variables_.clear();
    data_.clear();
    data_nodes_.clear();
    ++stamp_;
    next_local_ = 0;
    order_.clear();
    visit_.clear();
    for (std::size_t k = roots.size(); k-- > 0;) {
      visit_.push_back(roots[k].node);
    }
    while (!visit_.empty()) {
      const std::uint32_t i = visit_.back();
      if (seen_[i] == stamp_) {
        visit_.pop_back();
        continue;
      }
      const Node& node = nodes_[i];
      const bool is_number = graph_.degree(i) == Degree::constant;
      const int operands = is_number ? 0 : expression::operand_count(node.operation);
      bool ready = true;
      for (int k = operands; k-- > 0;) {
        const std::uint32_t operand = k == 0 ? node.a : k == 1 ? node.b : node.c;
        if (seen_[operand] != stamp_ && !is_exponent(node, k)) {
          visit_.push_back(operand);
          ready = false;
        }
      }
      if (!ready) {
        continue;
      }
      visit_.pop_back();
      seen_[i] = stamp_;
      local_[i] = next_local_++;
      order_.push_back(i);
      if (is_number) {
        key_.push_back(of_number);
        data_.push_back(numbers_[i]);
        data_nodes_.push_back(i);
      } else if (node.operation == Operation::input) {
        key_.push_back(of_variable);
        variables_.push_back(static_cast<int>(node.a));
      } else {
        key_.push_back(static_cast<std::uint32_t>(node.operation));
        for (int k = 0; k < operands; ++k) {
          if (is_exponent(node, k)) {
            flat_.structure_is_parametric = flat_.structure_is_parametric || is_parametric(node.b);
            const Node exponent = Node::constant(numbers_[node.b]);
            key_.push_back(exponent.a);
            key_.push_back(exponent.b);
          } else {
            key_.push_back(local_[k == 0 ? node.a : k == 1 ? node.b : node.c]);
          }
        }
      }
    }
    if (roots.size() > 1) {
      for (const Part& root : roots) {
        key_.push_back(local_[root.node]);
        data_.push_back(root.factor);
        data_nodes_.push_back(factor_of_part);
      }
    }
    const auto [found, is_new] = shapes_.try_emplace(key_, flat_.shapes.size());
    if (is_new) {
      flat_.shapes.push_back(shape(roots));
    }
    term_shape_ = found->second;
    Shape& shape = flat_.shapes[term_shape_];
    term_ = shape.rows.size();
    if (!parametric_.empty()) {
      shape.data_nodes.insert(shape.data_nodes.end(), data_nodes_.begin(), data_nodes_.end());
    }
    shape.columns.insert(shape.columns.end(), variables_.begin(), variables_.end());
    shape.data.insert(shape.data.end(), data_.begin(), data_.end());
    shape.rows.push_back(row);
    shape.factors.push_back(roots.size() > 1 ? 1.0 : roots.front().factor);
    for (const double number : data_) {
      if (!std::isfinite(number) && flat_.not_finite == -1) {
        flat_.not_finite = row < 0 ? -2 : number_;
      }
    }
  }

  /// Exponents belong to the shape: what is x² and what is √x is no matter of numbers.
  [[nodiscard]] bool is_exponent(const Node& node, int operand) const {
    return node.operation == Operation::power && operand == 1 &&
           graph_.degree(node.b) == Degree::constant;
  }

  [[nodiscard]] Shape shape(const std::vector<Part>& roots) const {
    Shape made;
    made.variables = variables_.size();
    made.numbers = data_.size();
    TapeBuilder builder(made.variables + made.numbers);
    std::vector<Slot> slots(next_local_);
    std::size_t variable = 0;
    std::size_t number = made.variables;
    for (const std::uint32_t i : order_) {
      Node node = nodes_[i];
      Slot& slot = slots[local_[i]];
      if (graph_.degree(i) == Degree::constant) {
        slot = builder.input(number++);
      } else if (node.operation == Operation::input) {
        slot = builder.input(variable++);
      } else {
        const int operands = expression::operand_count(node.operation);
        const bool has_exponent = is_exponent(node, 1) && operands > 1;
        node.b = operands > 1 ? (has_exponent ? builder.constant(numbers_[node.b]).index
                                              : slots[local_[node.b]].index)
                              : node.b;
        node.a = slots[local_[node.a]].index;
        node.c = operands > 2 ? slots[local_[node.c]].index : node.c;
        slot = builder.node(node);
      }
    }
    Slot output = slots[local_[roots.front().node]];
    for (std::size_t k = 0; k < roots.size() && roots.size() > 1; ++k) {
      const Slot weighted = builder.binary(Operation::multiply, builder.input(number++),
                                           slots[local_[roots[k].node]]);
      output = k == 0 ? weighted : builder.binary(Operation::add, output, weighted);
    }
    made.tape = builder.finish({&output, 1});
    return made;
  }

  [[nodiscard]] bool is_parametric(std::uint32_t i) const {
    return !parametric_.empty() && parametric_[i] != 0;
  }
  [[nodiscard]] bool depends(const Node& node) const {
    const int operands = expression::operand_count(node.operation);
    return node.operation == Operation::parameter || (operands > 0 && parametric_[node.a] != 0) ||
           (operands > 1 && parametric_[node.b] != 0) || (operands > 2 && parametric_[node.c] != 0);
  }

  const ExpressionGraph& graph_;
  const Node* nodes_;
  FlatProblem& flat_;
  std::vector<double>& numbers_;
  std::vector<unsigned char> parametric_;  // of each node; empty: there are no parameters
  std::vector<std::uint32_t> seen_, local_;
  std::vector<int> column_at_;
  std::uint32_t stamp_ = 0;
  std::uint32_t next_local_ = 0;
  int number_ = -1;  // of the constraint at hand
  std::vector<Part> stack_, leaves_;
  std::vector<std::uint32_t> visit_, order_, key_;
  std::vector<int> variables_;
  std::vector<double> data_;
  std::vector<std::uint32_t> data_nodes_;
  std::size_t term_shape_ = 0, term_ = 0;  // the term that was made last
  std::unordered_map<std::vector<std::uint32_t>, std::size_t, KeyHash> shapes_;
};

}  // namespace

FlatProblem flatten(const ExpressionGraph& graph, const Expression& cost, double sign,
                    const Constraints& constraints) {
  FlatProblem flat;
  flat.variables = static_cast<int>(graph.inputs());
  flat.sign = sign;
  flat.lower.assign(graph.inputs(), -infinity);
  flat.upper.assign(graph.inputs(), infinity);
  flat.lower_from.assign(graph.inputs(), -1);
  flat.upper_from.assign(graph.inputs(), -1);
  flat.lower_slope.assign(graph.inputs(), 0.0);
  flat.upper_slope.assign(graph.inputs(), 0.0);
  Flattener flattener(graph, flat);
  flat.cost_degree = cost.degree();
  if (cost.is_constant()) {
    flat.cost_offset = sign * cost.constant();
    flat.cost_coefficients.assign(graph.inputs(), 0.0);
  } else {
    flattener.cost(cost.node(), sign);
  }
  int number = 0;
  for (const Constraint& constraint : constraints) {
    const Degree degree = constraint.value.degree();
    Degree& most = constraint.equality ? flat.equality_degree : flat.inequality_degree;
    most = std::max(most, degree);
    if (constraint.value.is_constant()) {
      const double value = constraint.value.constant();
      const double by = constraint.equality ? std::abs(value) : -value;
      if (std::isnan(value)) {
        flat.not_finite = flat.not_finite == -1 ? number : flat.not_finite;
      } else if (by > 1e-9 && flat.impossible < 0) {
        flat.impossible = number;
        flat.impossible_by = by;
      }
    } else {
      flattener.constraint(constraint.value.node(), constraint.equality, number);
    }
    ++number;
  }
  if (!std::isfinite(flat.cost_offset)) {
    flat.not_finite = -2;
  }
  return flat;
}

}  // namespace flyball::optimization::detail
