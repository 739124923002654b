#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include <flyball/math/expression/operation.hpp>

namespace flyball::expression {

/// A place on a tape: what a node's operands name.
struct Slot {
  std::uint32_t index = 0;
  friend bool operator==(Slot, Slot) = default;
};

/// One operation and where its operands stand, all before the node itself. A constant keeps its
/// bits in a and b, a parameter and an input their number in a.
struct Node {
  Operation operation = Operation::constant;
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  std::uint32_t c = 0;
  friend bool operator==(const Node&, const Node&) = default;

  /// The node of a constant.
  [[nodiscard]] static constexpr Node constant(double value) noexcept {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    return {Operation::constant, static_cast<std::uint32_t>(bits),
            static_cast<std::uint32_t>(bits >> 32U), 0};
  }
  /// The value of a constant.
  [[nodiscard]] constexpr double value() const noexcept {
    return std::bit_cast<double>(std::uint64_t{b} << 32U | a);
  }
};

/// A function from inputs and parameters to outputs, flattened: each node is computed once, from
/// nodes before it, into the value of the same number. Made by `TapeBuilder`.
///
/// The nodes stand in the order constants, parameters, what depends on these alone, inputs, the
/// rest. The first three are computed by `prepare`, once for many evaluations:
///
/// ```
/// std::vector<double> values(tape.size());
/// tape.prepare<double>(parameters, values);
/// tape.evaluate<double>(x, y, values);  // as often as wanted
/// ```
///
/// Over `Dual` a tape yields derivatives as any function over a generic scalar does;
/// `differentiate` makes a tape of them, which is faster.
class Tape {
 public:
  /// An empty tape: a function of nothing.
  Tape() = default;

  [[nodiscard]] std::size_t inputs() const noexcept { return inputs_; }
  [[nodiscard]] std::size_t parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t outputs() const noexcept { return outputs_.size(); }
  /// How many values an evaluation needs room for.
  [[nodiscard]] std::size_t size() const noexcept { return nodes_.size(); }

  [[nodiscard]] std::span<const Node> nodes() const noexcept { return nodes_; }
  [[nodiscard]] std::span<const Slot> output_slots() const noexcept { return outputs_; }
  /// Where an input stands.
  [[nodiscard]] Slot input_slot(std::size_t number) const noexcept {
    return {static_cast<std::uint32_t>(first_input_ + number)};
  }
  /// Where a parameter stands.
  [[nodiscard]] Slot parameter_slot(std::size_t number) const noexcept {
    return {static_cast<std::uint32_t>(constants_ + number)};
  }

  /// Fills the values that do not depend on inputs.
  /// @param parameters  parameters() numbers. @param values  size() entries, kept by the caller.
  template <class T>
  void prepare(std::span<const T> parameters, std::span<T> values) const
      noexcept(std::is_floating_point_v<T>) {
    for (std::size_t i = 0; i < constants_; ++i) {
      values[i] = T(nodes_[i].value());
    }
    for (std::size_t k = 0; k < parameters_; ++k) {
      values[constants_ + k] = parameters[k];
    }
    compute(constants_ + parameters_, first_input_, values.data());
  }

  /// The outputs at a point.
  /// @param inputs  inputs() numbers. @param outputs  outputs() entries, may overlap with `inputs`.
  /// @param values  as `prepare` left them, for the parameters of its call; the rest is scratch.
  /// Cost: one pass over the nodes; no allocation where T's arithmetic has none.
  template <class T>
  void evaluate(std::span<const T> inputs, std::span<T> outputs, std::span<T> values) const
      noexcept(std::is_floating_point_v<T>) {
    for (std::size_t k = 0; k < inputs_; ++k) {
      values[first_input_ + k] = inputs[k];
    }
    compute(first_input_ + inputs_, nodes_.size(), values.data());
    for (std::size_t k = 0; k < outputs_.size(); ++k) {
      outputs[k] = values[outputs_[k].index];
    }
  }

 private:
  friend class TapeBuilder;

  template <class T>
  void compute(std::size_t first, std::size_t last, T* values) const
      noexcept(std::is_floating_point_v<T>) {
    const Node* const nodes = nodes_.data();
    for (std::size_t i = first; i < last; ++i) {
      const Node node = nodes[i];
      values[i] = apply<T>(node.operation, values[node.a], values[node.b], values[node.c]);
    }
  }

  std::vector<Node> nodes_;
  std::vector<Slot> outputs_;
  std::size_t constants_ = 0;
  std::size_t parameters_ = 0;
  std::size_t inputs_ = 0;
  std::size_t first_input_ = 0;
};

/// Doubles run through a loop compiled once. @private
template <>
void Tape::compute(std::size_t first, std::size_t last, double* values) const noexcept;

}  // namespace flyball::expression
