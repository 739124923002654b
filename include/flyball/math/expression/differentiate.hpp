#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <flyball/math/expression/tape.hpp>

namespace flyball::expression {

/// An entry of a sparse matrix.
struct Entry {
  std::uint32_t row = 0;
  std::uint32_t column = 0;
  friend bool operator==(Entry, Entry) = default;
};

/// How derivatives are collected.
enum class Accumulation {
  forward,  ///< Along the tape, variable by variable.
  reverse,  ///< Against it, output by output: for many variables and few outputs.
};

/// A tape that computes a function and its Jacobian. Structural zeros have no entry.
struct Derivatives {
  /// The outputs of the function, then a number for each entry.
  Tape tape;
  std::size_t rows = 0;        ///< Outputs of the function.
  std::size_t columns = 0;     ///< Variables.
  std::vector<Entry> entries;  ///< By column where collected forward, by row in reverse.

  /// Value and Jacobian at a point.
  /// @param inputs  tape.inputs() numbers. @param y  rows entries, the function's outputs.
  /// @param J  rows x columns. @param values  workspace_size() entries: the first tape.size() as
  /// Tape::prepare left them, the rest scratch.
  /// Cost: one pass over the tape; no allocation.
  void evaluate(std::span<const double> inputs, std::span<double> y, Eigen::Ref<Eigen::MatrixXd> J,
                std::span<double> values) const noexcept;

  [[nodiscard]] std::size_t workspace_size() const noexcept { return tape.size() + tape.outputs(); }
};

/// The derivatives of a tape's outputs with respect to some of its inputs and parameters, exact but
/// for rounding, as a tape: differentiated again it gives Hessians.
///
/// Where a function has a kink (abs, min, max, select) the derivative is that of the branch taken,
/// abs at 0 taking that of x; sign, floor, ceil, round and comparisons have derivative 0. Where it
/// has no derivative (sqrt at 0) it is infinite or NaN, except with respect to variables that do
/// not move the argument. All as `Dual` has it; in reverse, where a slope on the way is infinite, a
/// derivative can be NaN that is finite forward (∞ - ∞ in place of 0 · ∞).
///
/// @param variables  Slots of the tape's inputs and parameters; the columns in this order.
/// Cost: O(nodes · columns) forward, O(nodes · rows) in reverse; allocates.
/// Source: Griewank and Walther, "Evaluating Derivatives", 2nd ed. 2008, sections 3.1 and 3.2.
[[nodiscard]] Derivatives differentiate(const Tape& tape, std::span<const Slot> variables,
                                        Accumulation how = Accumulation::forward);

/// With respect to all inputs.
[[nodiscard]] Derivatives differentiate(const Tape& tape, Accumulation how = Accumulation::forward);

}  // namespace flyball::expression
