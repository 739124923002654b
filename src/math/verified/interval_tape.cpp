#include "math/verified/interval_tape.hpp"

namespace flyball::detail {

using expression::Node;
using expression::Operation;

IntervalTape::IntervalTape(expression::Tape tape, std::span<const double> parameters)
    : tape_(std::move(tape)), values_(tape_.size()), outputs_(tape_.outputs()) {
  first_input_ = tape_.inputs() > 0 ? tape_.input_slot(0).index : tape_.size();
  for (std::size_t i = 0; i < first_input_; ++i) {
    const Node& node = tape_.nodes()[i];
    if (node.operation == Operation::constant) {
      values_[i] = node.value();
    } else if (node.operation == Operation::parameter) {
      values_[i] = node.a < parameters.size() ? Interval(parameters[node.a]) : anything;
    } else {
      compute(i, i + 1);
    }
  }
}

std::span<const Interval> IntervalTape::evaluate(std::span<const Interval> inputs) noexcept {
  for (std::size_t k = 0; k < tape_.inputs(); ++k) {
    values_[first_input_ + k] = inputs[k];
  }
  compute(first_input_ + tape_.inputs(), tape_.size());
  for (std::size_t k = 0; k < outputs_.size(); ++k) {
    outputs_[k] = values_[tape_.output_slots()[k].index];
  }
  return outputs_;
}

void IntervalTape::compute(std::size_t first, std::size_t last) noexcept {
  const Node* const nodes = tape_.nodes().data();
  for (std::size_t i = first; i < last; ++i) {
    const Node& node = nodes[i];
    if (node.operation == Operation::multiply && node.a == node.b) {
      values_[i] = is_bounded(values_[node.a]) ? square(values_[node.a]) : anything;
      continue;
    }
    const int operands = operand_count(node.operation);
    const Interval none;
    values_[i] =
        apply_interval(node.operation, values_[node.a], operands > 1 ? values_[node.b] : none,
                       operands > 2 ? values_[node.c] : none);
  }
}

}  // namespace flyball::detail
