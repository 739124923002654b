#pragma once

#include <array>
#include <cmath>
#include <cstddef>

/// The linear programs of one interval of a path's timing, in the Bézier points b of x = (ds/dt)².
namespace flyball::detail {

/// b_0, b_1, b_2.
using Bezier2 = std::array<double, 3>;

/// Rows come in even numbers. 0 <= b <= cap and |α b_0 + β b_1 + γ b_2 + δ| <= 1 for each row.
struct IntervalProgram {
  const double* alpha = nullptr;
  const double* beta = nullptr;
  const double* gamma = nullptr;
  const double* delta = nullptr;  ///< Null where all are zero.
  int rows = 0;
  Bezier2 cap{};
  /// Rows of one side, α b_0 + β b_1 + γ b_2 <= 1.
  const double* upper_alpha = nullptr;
  const double* upper_beta = nullptr;
  const double* upper_gamma = nullptr;
  int uppers = 0;
  double idle = 0.0;  ///< Where no b is larger than this, none of those is broken.

  [[nodiscard]] double row(int r, const Bezier2& b) const noexcept {
    const auto k = static_cast<std::size_t>(r);
    const double value = alpha[k] * b[0] + beta[k] * b[1] + gamma[k] * b[2];
    return delta != nullptr ? value + delta[k] : value;
  }
  [[nodiscard]] double upper_row(int r, const Bezier2& b) const noexcept {
    const auto k = static_cast<std::size_t>(r);
    return upper_alpha[k] * b[0] + upper_beta[k] * b[1] + upper_gamma[k] * b[2];
  }
  /// The largest |row| and, if it is more than 1, which it is.
  [[nodiscard]] double largest(const Bezier2& b, int& which) const noexcept;
  /// The same of the rows of one side; 0 where all are idle.
  [[nodiscard]] double largest_upper(const Bezier2& b, int& which) const noexcept;
};

/// Which three inequalities met at the optimum: where the next interval's program looks first.
struct IntervalBasis {
  std::array<int, 3> active{};
  bool known = false;
};

/// The point of largest b_0, nearly: 0 is a point, so that a point outside is scaled to the inside.
[[nodiscard]] Bezier2 largest_first(const IntervalProgram& program, IntervalBasis& basis) noexcept;

/// With b_0 given the point of largest b_2, nearly. @param inside  A point with that b_0, kept to
/// where the program ends short of its optimum.
[[nodiscard]] Bezier2 largest_last(const IntervalProgram& program, const Bezier2& inside,
                                   IntervalBasis& basis) noexcept;

}  // namespace flyball::detail
