#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <flyball/planning/path/path.hpp>

#include "planning/trajectory/interval_program.hpp"

/// The passes of `time_optimal` over the intervals of a path.
namespace flyball::detail {

/// An interval of a path's parameter.
struct TimingCell {
  std::size_t piece = 0;
  double from = 0.0;   ///< In the piece, of [0, 1].
  double to = 1.0;     ///< In the piece, of [0, 1].
  double width = 0.0;  ///< Of the path's parameter.
  /// The next interval's b_0 over this one's b_2; 0 where it is a stop, negative where x may jump.
  double join = 1.0;
  double most = std::numeric_limits<double>::infinity();  ///< Of x at its end.
};

/// Numbers that nothing is put into before they are.
class Numbers {
 public:
  void resize(std::size_t size) {
    if (size > size_) {
      values_ = std::make_unique_for_overwrite<double[]>(size);
      size_ = size;
    }
  }
  [[nodiscard]] double* data() noexcept { return values_.get(); }
  [[nodiscard]] const double* data() const noexcept { return values_.get(); }
  [[nodiscard]] double& operator[](std::size_t i) noexcept { return values_[i]; }

 private:
  std::unique_ptr<double[]> values_;
  std::size_t size_ = 0;
};

/// The rows and caps of all intervals, one after the other.
struct TimingRows {
  int count = 0;                                 ///< Of an interval.
  Numbers alpha, beta, gamma;                    ///< count an interval.
  std::vector<double> delta;                     ///< The same, or empty.
  std::vector<Bezier2> cap;                      ///< One an interval.
  int uppers = 0;                                ///< Rows of one side of an interval.
  Numbers upper_alpha, upper_beta, upper_gamma;  ///< uppers an interval.
  std::vector<double> idle;                      ///< One an interval.
  void resize(std::size_t cells, int rows_of_cell, int uppers_of_cell);
  [[nodiscard]] IntervalProgram program(std::size_t cell) const noexcept;
};

/// Where the passes ended.
struct TimingPasses {
  std::vector<double> highest;   ///< Of x at the beginning of each interval and at the end.
  std::vector<Bezier2> witness;  ///< From `highest`.
  std::vector<Bezier2> b;        ///< The answer.
};

/// Back from the end and forward from the start. @param last  x at the end. @return Whether x_0 is
/// not above what can be braked.
void pass_back(const std::vector<TimingCell>& cells, const TimingRows& rows, double last,
               TimingPasses& passes);
void pass_forward(const std::vector<TimingCell>& cells, const TimingRows& rows, double first,
                  TimingPasses& passes);

/// ∫ ds/√x over an interval: with z = c w²/(v_0 + v_1)² it is 2 w/(v_0 + v_1) atanh(√z)/√z.
[[nodiscard]] double cell_duration(const Bezier2& b, double width) noexcept;

}  // namespace flyball::detail
