#pragma once

#include "math/dense/instruction_set.hpp"

namespace flyball::detail {

/// A X + X Aᵀ + Q = 0, or A X Aᵀ - X + Q = 0; n x n without gaps; of Q the symmetric
/// part counts.
struct LyapunovData {
  int states;
  bool continuous;
  const double* A;
  const double* Q;
};
struct LyapunovAnswer {
  double* X;
  double residual = 0.0;
  double condition = 0.0;
};

/// Doubles of memory for n states.
inline constexpr int lyapunov_workspace(int n) {
  const int ld = n <= 2 ? 2 : ((n + 3) / 4) * 4;
  return 19 * ld * n + 9 * ld;
}
/// Up to this many states the workspace lies on the stack.
inline constexpr int lyapunov_stack_states = 20;

/// The short way for a stable A: Smith's squared iteration. True where the residual times the
/// operator's gain vouches for the result, else the answer is meaningless.
[[nodiscard]] bool solve_stable_lyapunov(const LyapunovData& data, LyapunovAnswer& answer);

FLYBALL_KERNEL([[nodiscard]] bool solve_stable_lyapunov(const LyapunovData& data,
                                                        LyapunovAnswer& answer, double* memory,
                                                        int* pivots))

}  // namespace flyball::detail
