#include <flyball/math/expression/differentiate.hpp>

#include <algorithm>
#include <optional>
#include <utility>

#include "math/expression/slopes.hpp"

namespace flyball::expression {

namespace {

using Derivative = std::optional<Slot>;  // nothing: a structural zero

/// The copy of a tape that derivatives are added to.
struct Copy {
  explicit Copy(const Tape& tape) : builder(tape.inputs(), tape.parameters()) {
    slots.reserve(tape.size());
    for (Node node : tape.nodes()) {
      const int operands = operand_count(node.operation);
      node.a = operands > 0 ? slots[node.a].index : node.a;
      node.b = operands > 1 ? slots[node.b].index : node.b;
      node.c = operands > 2 ? slots[node.c].index : node.c;
      slots.push_back(builder.node(node));
    }
    for (const Slot output : tape.output_slots()) {
      outputs.push_back(slots[output.index]);
    }
    function_size = builder.size();
  }

  Derivative product(Derivative factor, Derivative slope, Operation how = Operation::chain) {
    return factor && slope ? Derivative(builder.binary(how, *factor, *slope)) : std::nullopt;
  }
  Derivative sum(Derivative a, Derivative b) {
    return a && b ? Derivative(builder.binary(Operation::add, *a, *b)) : a ? a : b;
  }
  Derivative choice(Slot condition, Derivative then, Derivative otherwise) {
    if (!then && !otherwise) {
      return std::nullopt;
    }
    const auto or_zero = [&](Derivative slot) { return slot ? *slot : builder.constant(0.0); };
    const Slot first = or_zero(then);
    return builder.select(condition, first, or_zero(otherwise));
  }

  TapeBuilder builder;
  std::vector<Slot> slots;  // of the tape's nodes
  std::vector<Slot> outputs;
  std::size_t function_size = 0;  // the nodes after it are derivatives
};

class Collector {
 public:
  Collector(const Tape& tape, std::span<const Slot> variables) : copy_(tape) {
    for (const Slot variable : variables) {
      variables_.push_back(copy_.slots[variable.index]);
    }
    result_.rows = copy_.outputs.size();
    result_.columns = variables.size();
  }

  Derivatives forward() {
    const std::size_t size = copy_.function_size;
    std::vector<Derivative> tangents(size);
    for (std::size_t column = 0; column < variables_.size(); ++column) {
      std::fill(tangents.begin(), tangents.end(), std::nullopt);
      tangents[variables_[column].index] = copy_.builder.constant(1.0);
      for (std::size_t i = 0; i < size; ++i) {
        if (!tangents[i]) {
          tangents[i] = tangent(i, tangents);
        }
      }
      for (std::size_t row = 0; row < result_.rows; ++row) {
        record(row, column, tangents[copy_.outputs[row].index]);
      }
    }
    return finish();
  }

  Derivatives reverse() {
    const std::size_t size = copy_.function_size;
    std::vector<bool> moves(size, false);  // depends on a variable
    for (const Slot variable : variables_) {
      moves[variable.index] = true;
    }
    for (std::size_t i = 0; i < size; ++i) {
      const Node& node = copy_.builder[{static_cast<std::uint32_t>(i)}];
      const int operands = operand_count(node.operation);
      moves[i] = moves[i] || (operands > 0 && moves[node.a]) || (operands > 1 && moves[node.b]) ||
                 (operands > 2 && moves[node.c]);
    }
    std::vector<Derivative> adjoints(size);
    for (std::size_t row = 0; row < result_.rows; ++row) {
      std::fill(adjoints.begin(), adjoints.end(), std::nullopt);
      const std::size_t output = copy_.outputs[row].index;
      if (moves[output]) {
        adjoints[output] = copy_.builder.constant(1.0);
      }
      for (std::size_t i = output + 1; i-- > 0;) {
        if (adjoints[i]) {
          pass_on(i, adjoints, moves);
        }
      }
      for (std::size_t column = 0; column < variables_.size(); ++column) {
        record(row, column, adjoints[variables_[column].index]);
      }
    }
    return finish();
  }

 private:
  /// ẏ = ∂y/∂a ȧ + ∂y/∂b ḃ.
  Derivative tangent(std::size_t i, const std::vector<Derivative>& tangents) {
    TapeBuilder& builder = copy_.builder;
    const Slot y{static_cast<std::uint32_t>(i)};
    const Node node = builder[y];
    const int operands = operand_count(node.operation);
    const Derivative a = operands > 0 ? tangents[node.a] : std::nullopt;
    const Derivative b = operands > 1 ? tangents[node.b] : std::nullopt;
    const Derivative c = operands > 2 ? tangents[node.c] : std::nullopt;
    if (!a && !b && !c) {
      return std::nullopt;
    }
    if (const auto branch = branch_of(builder, y)) {
      return copy_.choice(branch->condition, tangents[branch->then.index],
                          tangents[branch->otherwise.index]);
    }
    const Slopes slope = slopes(builder, y, a.has_value(), b.has_value());
    const Operation how =
        has_finite_slopes(node.operation) ? Operation::multiply : Operation::chain;
    const Derivative by_a = copy_.product(a, slope.by_a, how);
    return copy_.sum(by_a, copy_.product(b, slope.by_b, how));
  }

  /// ā += ȳ ∂y/∂a, b̄ += ȳ ∂y/∂b.
  void pass_on(std::size_t i, std::vector<Derivative>& adjoints, const std::vector<bool>& moves) {
    TapeBuilder& builder = copy_.builder;
    const Slot y{static_cast<std::uint32_t>(i)};
    const Node node = builder[y];
    const Derivative above = adjoints[i];
    const auto give = [&](Slot operand, Derivative part) {
      adjoints[operand.index] = copy_.sum(adjoints[operand.index], part);
    };
    if (const auto branch = branch_of(builder, y)) {
      if (moves[branch->then.index]) {
        give(branch->then, copy_.choice(branch->condition, above, std::nullopt));
      }
      if (moves[branch->otherwise.index]) {
        give(branch->otherwise, copy_.choice(branch->condition, std::nullopt, above));
      }
      return;
    }
    const int operands = operand_count(node.operation);
    const bool by_a = operands > 0 && moves[node.a];
    const bool by_b = operands > 1 && moves[node.b];
    const Slopes slope = slopes(builder, y, by_a, by_b);
    if (by_a) {
      give({node.a}, copy_.product(above, slope.by_a));
    }
    if (by_b) {
      give({node.b}, copy_.product(above, slope.by_b));
    }
  }

  void record(std::size_t row, std::size_t column, Derivative derivative) {
    if (derivative && copy_.builder.constant_value(*derivative) != 0.0) {
      result_.entries.push_back(
          {static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(column)});
      entries_.push_back(*derivative);
    }
  }

  Derivatives finish() {
    std::vector<Slot> outputs = copy_.outputs;
    outputs.insert(outputs.end(), entries_.begin(), entries_.end());
    result_.tape = copy_.builder.finish(outputs);
    return std::move(result_);
  }

  Copy copy_;
  std::vector<Slot> variables_;
  std::vector<Slot> entries_;
  Derivatives result_;
};

}  // namespace

Derivatives differentiate(const Tape& tape, std::span<const Slot> variables, Accumulation how) {
  Collector collector(tape, variables);
  return how == Accumulation::forward ? collector.forward() : collector.reverse();
}

Derivatives differentiate(const Tape& tape, Accumulation how) {
  std::vector<Slot> inputs;
  for (std::size_t k = 0; k < tape.inputs(); ++k) {
    inputs.push_back(tape.input_slot(k));
  }
  return differentiate(tape, inputs, how);
}

void Derivatives::evaluate(std::span<const double> inputs, std::span<double> y,
                           Eigen::Ref<Eigen::MatrixXd> J, std::span<double> values) const noexcept {
  const std::span<double> out = values.subspan(tape.size(), tape.outputs());
  tape.evaluate<double>(inputs, out, values);
  std::copy_n(out.begin(), rows, y.begin());
  J.setZero();
  for (std::size_t k = 0; k < entries.size(); ++k) {
    J(entries[k].row, entries[k].column) = out[rows + k];
  }
}

}  // namespace flyball::expression
