#pragma once

#include "math/dense/instruction_set.hpp"

namespace flyball::detail {

/// A X + X B = F, or A X B - X = F; A n x n, B m x m, F and X n x m, all without gaps. Without B
/// the Lyapunov equation, B = Aᵀ.
struct SylvesterData {
  int rows;
  int columns;
  bool continuous;
  bool symmetric;  ///< F is, and B = Aᵀ: X is to be so to the last bit.
  const double* A;
  const double* B;
  const double* F;
};
struct SylvesterAnswer {
  double* X;
  double residual = 0.0;
  double condition = 0.0;
};

/// Rows of storage, a whole number of vectors.
inline constexpr int padded_rows(int n) {
  return ((n + 3) / 4) * 4;
}
/// Doubles of memory for n x m.
inline constexpr int sylvester_workspace(int n, int m) {
  const int rows = padded_rows(n);
  const int columns = padded_rows(m);
  return 4 * rows * n + 4 * columns * m + 10 * rows * m + 8 * rows + 20 * (rows + columns);
}
/// Up to this many rows and columns the workspace lies on the stack.
inline constexpr int sylvester_stack_size = 16;

/// The short way for an equation of ordinary condition: Hessenberg and real Schur form, corrected
/// by its residual in twice the working precision until that is rounding. False where the condition
/// or the corrections do not vouch for the result: the answer is meaningless then.
[[nodiscard]] bool solve_sylvester_quickly(const SylvesterData& data, SylvesterAnswer& answer);

/// R = F - (A X + X B), or F - (A X B - X), summed in twice the working precision. All padded with
/// zeros to whole vectors, A, X, F and R to the same; `work` holds three matrices as X.
void sylvester_residual(const SylvesterData& padded, const double* X, double* R, double* work);

FLYBALL_KERNEL([[nodiscard]] bool solve_sylvester(const SylvesterData& data,
                                                  SylvesterAnswer& answer, double* memory))

}  // namespace flyball::detail
