#pragma once

#include <flyball/math/riccati.hpp>

namespace flyball::detail {

/// The short way for ordinary data: R positive definite, doubling without balancing, one residual.
/// True where the result vouches for itself (residual times condition, poles inside the circle);
/// else the answer is meaningless and the robust way has to be taken.
/// The data must have been checked. Allocates for more than ten states only.
[[nodiscard]] bool solve_riccati_quickly(const RiccatiData& data, RiccatiAnswer& answer);

/// Up to this many states (and no more inputs) the workspace lies on the stack.
inline constexpr int kernel_stack_states = 10;

/// Doubles that the kernel needs; rows are padded to two or a multiple of four.
inline constexpr int kernel_workspace(int n, int m) {
  const int ld = n <= 2 ? 2 : ((n + 3) / 4) * 4;
  const int ldm = m <= 2 ? 2 : ((m + 3) / 4) * 4;
  return 10 * ld * n + 4 * ld * m + 4 * ldm * (n + m) + 12 * ld;
}

/// The kernel compiled for the instruction sets of every processor and of those with 256-bit
/// vectors; `memory` and `pivots` are null where the stack serves.
namespace baseline {
[[nodiscard]] bool solve_riccati(const RiccatiData& data, RiccatiAnswer& answer, double* memory,
                                 int* pivots);
}
#if defined(__x86_64__) && !defined(__AVX2__)
#define FLYBALL_WIDE_VECTORS
namespace wide {
[[nodiscard]] bool solve_riccati(const RiccatiData& data, RiccatiAnswer& answer, double* memory,
                                 int* pivots);
}
#endif

}  // namespace flyball::detail
