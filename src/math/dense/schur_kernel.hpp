#pragma once

#include <complex>

#include "math/dense/instruction_set.hpp"

/// The QR iteration on matrices of some ten to some hundred rows.
namespace flyball::detail {

/// Rows of a column in memory, a multiple of four; what lies below the n-th is zero.
inline constexpr int schur_rows(int n) {
  return (n + 3) / 4 * 4;
}

/// H = U T Uᵀ, T in H's place: quasi-triangular, each 2x2 block with equal diagonal entries and a
/// pair of complex eigenvalues. O(n³).
/// @param H  n columns of `schur_rows(n)`, of ordinary size. @param U  The same, written.
/// @param work  Three columns. @return  False where the iteration did not converge.
FLYBALL_KERNEL([[nodiscard]] bool schur_form(int n, double* H, double* U, double* work))

/// The eigenvalues of H, which is destroyed; else as `schur_form`.
FLYBALL_KERNEL([[nodiscard]] bool schur_values(int n, double* H, double* work,
                                               std::complex<double>* lambda))

}  // namespace flyball::detail
