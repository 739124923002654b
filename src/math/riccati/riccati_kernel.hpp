#pragma once

#include <flyball/math/riccati/riccati.hpp>

#include "math/dense/instruction_set.hpp"

namespace flyball::detail {

/// The short way for ordinary data: R positive definite, doubling without balancing, one residual.
/// True where the result vouches for itself (residual times condition, poles inside the circle);
/// else the answer is meaningless and the robust way has to be taken. With more than
/// `kernel_few_states` a residual above `largest_residual` says that in doubles F's products
/// cancel: then Newton's method has come to rest, and the residual is left to a measure in twice
/// the precision. The data must have been checked. Allocates for more than ten states only.
[[nodiscard]] bool solve_riccati_quickly(const RiccatiData& data, RiccatiAnswer& answer);

inline constexpr double largest_residual = 1e-9;
/// For so few the robust way takes no more than milliseconds.
inline constexpr int kernel_few_states = 20;

/// Up to this many states (and no more inputs) the workspace lies on the stack.
inline constexpr int kernel_stack_states = 10;

/// Doubles that the kernel needs; rows are padded to two or a multiple of four.
inline constexpr int kernel_workspace(int n, int m) {
  const int ld = n <= 2 ? 2 : ((n + 3) / 4) * 4;
  const int ldm = m <= 2 ? 2 : ((m + 3) / 4) * 4;
  return 11 * ld * n + 4 * ld * m + ldm * (2 * n + m) + 8 * ld;
}

/// F(X) of the equation in twice the working precision, rounded: n x n, without gaps. K need only
/// be close to the X's gain, because with Z = [I; -K]
///   F = Zᵀ([A B]ᵀX[A B] + [Q N; Nᵀ R])Z - X  or  Zᵀ[AᵀX + XA + Q, XB + N; BᵀX + Nᵀ, R]Z
/// depends on its error to second order. False where there is no memory for it on the stack and
/// none to be had.
[[nodiscard]] bool riccati_residual(const RiccatiData& data, const double* X, const double* K,
                                    double* F);

/// The kernel compiled for the instruction sets of every processor and of those with 256-bit
/// vectors; `memory` and `pivots` are null where the stack serves.
FLYBALL_KERNEL([[nodiscard]] bool solve_riccati(const RiccatiData& data, RiccatiAnswer& answer,
                                                double* memory, int* pivots))

}  // namespace flyball::detail
