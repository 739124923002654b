#pragma once

#include "math/dense/instruction_set.hpp"

namespace flyball::detail {

/// exp(A), in closed form for n = 2, else by scaling and squaring with Padé approximants; A and E
/// are n x n without gaps and may not overlap. `memory` holds `exponential_workspace(n)` doubles.
/// Infinite or not a number where exp(A) overflows.
void exponential(int n, const double* A, double* E, double* memory);

inline constexpr int exponential_workspace(int n) {
  const int ld = ((n + 3) / 4) * 4;
  return 9 * ld * n + 6 * ld;
}

/// Up to this many states the workspace fits the stack.
inline constexpr int exponential_stack_states = 20;

FLYBALL_KERNEL(void exponential(int n, const double* A, double* E, double* memory))

}  // namespace flyball::detail
