#pragma once

#include <array>
#include <cmath>
#include <cstddef>

/// The linear programs of one interval of a path's timing, in the Bézier points b of x = (ds/dt)².
namespace flyball::detail {

/// b_0, b_1, b_2.
using Bezier2 = std::array<double, 3>;

/// 0 <= b <= cap and |α b_0 + β b_1 + γ b_2 + δ| <= margin for each row.
struct IntervalProgram {
  const double* alpha = nullptr;
  const double* beta = nullptr;
  const double* gamma = nullptr;
  const double* delta = nullptr;  ///< Null where all are zero.
  int rows = 0;
  double margin = 1.0;
  Bezier2 cap{};
  /// Rows of one side, α b_0 + β b_1 + γ b_2 <= 1, three numbers each.
  const double* upper = nullptr;
  int uppers = 0;
  double idle = 0.0;  ///< Where no b is larger than this, none of those is broken.

  [[nodiscard]] double row(int r, const Bezier2& b) const noexcept {
    const auto k = static_cast<std::size_t>(r);
    const double value = alpha[k] * b[0] + beta[k] * b[1] + gamma[k] * b[2];
    return delta != nullptr ? value + delta[k] : value;
  }
  [[nodiscard]] double upper_row(int r, const Bezier2& b) const noexcept {
    const double* row = upper + 3 * r;
    return row[0] * b[0] + row[1] * b[1] + row[2] * b[2];
  }
  /// The largest |row|, and which it is.
  [[nodiscard]] double largest(const Bezier2& b, int& which) const noexcept;
  /// The largest row of one side, and which it is; 0 where all are idle.
  [[nodiscard]] double largest_upper(const Bezier2& b, int& which) const noexcept;
};

/// The point of largest b_0, nearly: 0 is a point, so that a point outside is scaled to the inside.
/// @param last  Of b_2, the largest.
[[nodiscard]] Bezier2 largest_first(const IntervalProgram& program, double last) noexcept;

/// With b_0 given the point of largest b_2, nearly. @param inside  A point with that b_0, kept to
/// where the program ends short of its optimum.
[[nodiscard]] Bezier2 largest_last(const IntervalProgram& program, double last,
                                   const Bezier2& inside) noexcept;

}  // namespace flyball::detail
