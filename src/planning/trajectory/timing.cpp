#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "planning/trajectory/timing.hpp"

namespace flyball::detail {

void TimingRows::resize(std::size_t cells, int rows_of_cell, int uppers_of_cell) {
  count = rows_of_cell;
  uppers = uppers_of_cell;
  const std::size_t all_uppers = cells * static_cast<std::size_t>(uppers);
  upper_alpha.resize(all_uppers);
  upper_beta.resize(all_uppers);
  upper_gamma.resize(all_uppers);
  idle.resize(cells);
  const std::size_t all = cells * static_cast<std::size_t>(count);
  alpha.resize(all);
  beta.resize(all);
  gamma.resize(all);
  cap.resize(cells);
}

IntervalProgram TimingRows::program(std::size_t cell) const noexcept {
  const std::size_t from = cell * static_cast<std::size_t>(count);
  const std::size_t from_upper = cell * static_cast<std::size_t>(uppers);
  return {alpha.data() + from,
          beta.data() + from,
          gamma.data() + from,
          delta.empty() ? nullptr : delta.data() + from,
          count,
          cap[cell],
          upper_alpha.data() + from_upper,
          upper_beta.data() + from_upper,
          upper_gamma.data() + from_upper,
          uppers,
          idle[cell]};
}

namespace {

/// Of x at the end of an interval, as what follows lets it be.
double most_after(const std::vector<TimingCell>& cells, std::size_t i,
                  const TimingPasses& passes) noexcept {
  const double join = cells[i].join;
  if (i + 1 == cells.size()) {
    return std::min(cells[i].most, passes.highest[i + 1]);
  }
  if (join < 0.0) {
    return cells[i].most;
  }
  return join > 0.0 ? std::min(cells[i].most, passes.highest[i + 1] / join) : 0.0;
}

}  // namespace

void pass_back(const std::vector<TimingCell>& cells, const TimingRows& rows, double last,
               TimingPasses& passes) {
  const std::size_t n = cells.size();
  passes.highest.resize(n + 1);
  passes.witness.resize(n);
  passes.highest[n] = last;
  IntervalBasis basis;
  for (std::size_t i = n; i-- > 0;) {
    IntervalProgram program = rows.program(i);
    program.cap[2] = std::min(program.cap[2], most_after(cells, i, passes));
    passes.witness[i] = largest_first(program, basis);
    passes.highest[i] = passes.witness[i][0];
  }
}

void pass_forward(const std::vector<TimingCell>& cells, const TimingRows& rows, double first,
                  TimingPasses& passes) {
  const std::size_t n = cells.size();
  passes.b.resize(n);
  IntervalBasis basis;
  double x = std::min(first, passes.highest[0]);
  for (std::size_t i = 0; i < n; ++i) {
    const Bezier2& from = passes.witness[i];
    Bezier2 inside = from;
    if (x < from[0]) {
      const double share = x / from[0];
      inside = {x, share * from[1], share * from[2]};
    }
    const double most = most_after(cells, i, passes);
    // On the way that was found back from the end there is nothing to look for.
    const bool found = x >= from[0] && inside[2] >= most * (1.0 - 1e-12);
    if (found) {
      passes.b[i] = inside;
    } else {
      IntervalProgram program = rows.program(i);
      program.cap[2] = std::min(program.cap[2], most);
      passes.b[i] = largest_last(program, inside, basis);
    }
    if (i + 1 < n) {
      x = cells[i].join < 0.0 ? passes.highest[i + 1]
                              : std::min(passes.b[i][2] * cells[i].join, passes.highest[i + 1]);
    }
  }
}

double cell_duration(const Bezier2& b, double width) noexcept {
  const double sum = std::sqrt(b[0]) + std::sqrt(b[2]);
  const double bend = b[0] - 2.0 * b[1] + b[2];  // c w²
  if (!(sum > 0.0)) {                            // from rest to rest: half a period
    return bend < 0.0 ? std::numbers::pi * width / std::sqrt(-bend)
                      : std::numeric_limits<double>::infinity();
  }
  const double z = bend / (sum * sum);
  const double straight = 2.0 * width / sum;
  if (std::abs(z) < 0.02) {
    return straight *
           (1.0 +
            z * (1.0 / 3.0 +
                 z * (0.2 + z * (1.0 / 7.0 +
                                 z * (1.0 / 9.0 +
                                      z * (1.0 / 11.0 + z * (1.0 / 13.0 + z * (1.0 / 15.0))))))));
  }
  const double root = std::sqrt(std::abs(z));
  return straight * (z > 0.0 ? std::atanh(root) : std::atan(root)) / root;
}

}  // namespace flyball::detail
