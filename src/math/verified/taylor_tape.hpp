#pragma once

#include <span>
#include <vector>

#include <flyball/math/expression/tape.hpp>

#include "math/verified/taylor_form.hpp"

namespace flyball::detail {

/// A tape over Taylor forms of second order.
class TaylorTape {
 public:
  TaylorTape(expression::Tape tape, std::span<const double> parameters);

  /// Forms that hold the outputs. What has no slopes where it is asked for, or cannot be bounded,
  /// is an interval, of infinite radius at the worst. @param inputs  As many as the tape has.
  /// @return As many as it has outputs, until the next call. Cost: a pass over the tape.
  [[nodiscard]] std::span<const TaylorForm> evaluate(std::span<const TaylorForm> inputs) noexcept;

 private:
  void compute(std::size_t first, std::size_t last) noexcept;

  expression::Tape tape_;
  std::size_t first_input_ = 0;
  std::vector<TaylorForm> values_;
  std::vector<TaylorForm> outputs_;
};

/// No less than a form is anywhere, as its second order lets it be: centre, slopes and squares with
/// |ε_i| <= 1 together.
[[nodiscard]] double upper_bound(const TaylorForm& x) noexcept;

}  // namespace flyball::detail
