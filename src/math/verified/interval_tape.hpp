#pragma once

#include <span>
#include <vector>

#include <flyball/math/expression/tape.hpp>

#include "math/verified/interval_functions.hpp"

namespace flyball::detail {

/// A tape over intervals.
class IntervalTape {
 public:
  IntervalTape(expression::Tape tape, std::span<const double> parameters);

  /// Intervals that hold the outputs for all inputs of theirs. @param inputs  As many as the tape
  /// has.
  /// @return As many as it has outputs, until the next call. Cost: a pass over the tape.
  [[nodiscard]] std::span<const Interval> evaluate(std::span<const Interval> inputs) noexcept;

 private:
  void compute(std::size_t first, std::size_t last) noexcept;

  expression::Tape tape_;
  std::size_t first_input_ = 0;
  std::vector<Interval> values_;
  std::vector<Interval> outputs_;
};

}  // namespace flyball::detail
