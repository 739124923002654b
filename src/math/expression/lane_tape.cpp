#include <flyball/math/expression/lane_tape.hpp>

#include <algorithm>
#include <array>

#include "math/expression/lane_kernel.hpp"

namespace flyball::expression {

namespace {

constexpr std::uint32_t nowhere = ~std::uint32_t{0};

/// A node as a step: its operands still name nodes.
struct Draft {
  std::uint32_t code;
  std::array<std::uint32_t, 3> operands;
  int count;
};

detail::RunSteps run_for_this_processor() {
#ifdef FLYBALL_WIDE_VECTORS
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
      __builtin_cpu_supports("avx512vl") != 0) {
    return detail::widest::run_steps;
  }
  if (flyball::detail::has_wide_vectors()) {
    return detail::wide::run_steps;
  }
#endif
  return detail::baseline::run_steps;
}

/// a b ± c in one step where the product serves nothing else.
void fuse(std::span<const Node> nodes, std::vector<Draft>& drafts, std::vector<int>& uses,
          std::size_t first) {
  for (std::size_t i = first; i < nodes.size(); ++i) {
    const Operation operation = nodes[i].operation;
    if (operation != Operation::add && operation != Operation::subtract) {
      continue;
    }
    const auto product = [&](std::uint32_t node) {
      return node >= first &&
             drafts[node].code == static_cast<std::uint32_t>(Operation::multiply) &&
             uses[node] == 1;
    };
    const std::uint32_t a = nodes[i].a;
    const std::uint32_t b = nodes[i].b;
    if (product(a) && a != b) {
      drafts[i] = {operation == Operation::add ? detail::multiply_add : detail::multiply_subtract,
                   {drafts[a].operands[0], drafts[a].operands[1], b},
                   3};
      uses[a] = 0;
    } else if (product(b) && a != b) {
      drafts[i] = {
          operation == Operation::add ? detail::multiply_add : detail::negated_multiply_add,
          {drafts[b].operands[0], drafts[b].operands[1], a},
          3};
      uses[b] = 0;
    }
  }
}

}  // namespace

LaneTape::LaneTape(const Tape& tape) : inputs_(tape.inputs()), parameters_(tape.parameters()) {
  const std::span<const Node> nodes = tape.nodes();
  std::size_t constants = 0;
  while (constants < nodes.size() && nodes[constants].operation == Operation::constant) {
    constants_.push_back(nodes[constants].value());
    ++constants;
  }
  const std::size_t first_input = tape.input_slot(0).index;
  const std::size_t first = first_input + inputs_;

  std::vector<Draft> drafts(nodes.size());
  std::vector<int> uses(nodes.size(), 0);
  for (std::size_t i = constants + parameters_; i < nodes.size(); ++i) {
    const Node& node = nodes[i];
    const int count = operand_count(node.operation);
    drafts[i] = {static_cast<std::uint32_t>(node.operation), {node.a, node.b, node.c}, count};
    for (int k = 0; k < count; ++k) {
      ++uses[drafts[i].operands[static_cast<std::size_t>(k)]];
    }
  }
  for (const Slot output : tape.output_slots()) {
    uses[output.index] += 2;  // never fused away
  }
  fuse(nodes, drafts, uses, first);

  // Places: constants, parameters, what depends on these alone and inputs stay where they are; the
  // rest shares places.
  std::vector<std::uint32_t> last(nodes.size(), 0);
  for (std::size_t i = constants + parameters_; i < nodes.size(); ++i) {
    if (uses[i] == 0 && i >= first) {
      continue;
    }
    for (int k = 0; k < drafts[i].count; ++k) {
      last[drafts[i].operands[static_cast<std::size_t>(k)]] = static_cast<std::uint32_t>(i);
    }
  }
  for (const Slot output : tape.output_slots()) {
    last[output.index] = nowhere;
  }
  std::vector<std::uint32_t> place(nodes.size(), nowhere);
  for (std::size_t i = 0; i < first; ++i) {
    place[i] = static_cast<std::uint32_t>(i);
  }
  first_input_ = first_input;
  slots_ = first;
  std::vector<std::uint32_t> idle;
  const auto append = [&](std::size_t i) {
    Step step{drafts[i].code, 0, 0, 0, 0};
    std::array<std::uint32_t, 3> at{0, 0, 0};
    for (std::size_t k = 0; k < static_cast<std::size_t>(drafts[i].count); ++k) {
      at[k] = place[drafts[i].operands[k]];
    }
    // A place whose value is used here for the last time may take the result: steps read a pack of
    // all operands before they write it.
    for (std::size_t k = 0; k < static_cast<std::size_t>(drafts[i].count); ++k) {
      const std::uint32_t operand = drafts[i].operands[k];
      if (operand >= first && last[operand] == i) {
        last[operand] = nowhere;
        idle.push_back(place[operand]);
      }
    }
    step.a = at[0];
    step.b = at[1];
    step.c = at[2];
    if (i < first) {
      step.to = place[i];
    } else if (idle.empty()) {
      step.to = static_cast<std::uint32_t>(slots_++);
    } else {
      step.to = idle.back();
      idle.pop_back();
    }
    place[i] = step.to;
    steps_.push_back(step);
  };
  for (std::size_t i = constants + parameters_; i < first_input; ++i) {
    append(i);
  }
  first_varying_ = steps_.size();
  for (std::size_t i = first; i < nodes.size(); ++i) {
    if (uses[i] > 0) {
      append(i);
    }
  }
  for (const Slot output : tape.output_slots()) {
    outputs_.push_back(place[output.index]);
    fixed_.push_back(output.index < first_input);
  }
}

void LaneTape::prepare(std::span<const double> parameters, double* work) const noexcept {
  for (std::size_t i = 0; i < constants_.size(); ++i) {
    std::fill_n(work + i * lanes, lanes, constants_[i]);
  }
  for (std::size_t i = 0; i < parameters_; ++i) {
    std::fill_n(work + (constants_.size() + i) * lanes, lanes, parameters[i]);
  }
  std::fill_n(work + first_input_ * lanes, inputs_ * lanes, 0.0);
  static const detail::RunSteps run = run_for_this_processor();
  run(steps_.data(), first_varying_, work);
}

void LaneTape::evaluate(double* work) const noexcept {
  static const detail::RunSteps run = run_for_this_processor();
  run(steps_.data() + first_varying_, steps_.size() - first_varying_, work);
}

}  // namespace flyball::expression
