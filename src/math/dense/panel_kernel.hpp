#pragma once

#include "math/dense/instruction_set.hpp"

/// Products and factors of matrices of some ten to some hundred rows, on columns in memory: those
/// that a dynamic matrix library takes longer to prepare than to work at.
namespace flyball::detail {

/// Numbers of a matrix by columns, `step` apart.
struct PanelView {
  const double* at;
  int step;
};

/// What an entry of C += sign A B is told by B: B(k, j) stands at B.at[k depth_step + j
/// column_step].
struct PanelFactor {
  const double* at;
  int depth_step;
  int column_step;
};

/// C += sign A B, A rows x depth, C rows x columns. With `lower` no more than C's lower triangle
/// must be added to, and more may be.
FLYBALL_KERNEL(void add_panel_product(int rows, int columns, int depth, double sign, PanelView A,
                                      PanelFactor B, double* C, int C_step, bool lower))

/// The lower triangle of S becomes L with S = L Lᵀ; false where S is not positive definite. The
/// upper triangle is neither read nor written but for the squares on the diagonal.
FLYBALL_KERNEL([[nodiscard]] bool factor_panel(int n, double* S, int step))

/// B becomes B L⁻ᵀ, or B L⁻¹: B rows x n, L lower triangular.
FLYBALL_KERNEL(void solve_panel_transposed(int rows, int n, PanelView L, double* B, int step))
FLYBALL_KERNEL(void solve_panel(int rows, int n, PanelView L, double* B, int step))

/// Doubles of memory for `symmetric_modes`.
inline constexpr int symmetric_modes_workspace(int n) {
  return 9 * n;
}

/// Eigenvalues of a symmetric S, decreasing, and the vectors of the `count` largest: by tridiagonal
/// form, QL without roots for the values, inverse iteration for the vectors.
/// @param S  n x n, both triangles; overwritten. @param vectors  n x count.
/// @return  False where an iteration did not converge, or a vector leaves more than rounding.
/// Source: Parlett, "The Symmetric Eigenvalue Problem" (1998), 8.14 and 4.9.
FLYBALL_KERNEL([[nodiscard]] bool symmetric_modes(int n, double* S, int step, int count,
                                                  double* values, double* vectors, double* memory))

}  // namespace flyball::detail
