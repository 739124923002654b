#pragma once

#include <optional>

#include "math/extended/double_double.hpp"
#include "math/extended/wide_matrix.hpp"

namespace flyball::detail {

/// The eigenvalues of M to rounding of its 31 digits, in pairs of exact conjugates; nothing where
/// the iteration does not end. M should be balanced: the rounding is that of its norm.
/// Cost: O(n³), at most 60 steps an eigenvalue; some hundred times that of doubles.
/// Source: Martin and Wilkinson, "Similarity reduction of a general matrix to Hessenberg form",
/// Numerische Mathematik 12 (1968) (elmhes), and "The modified LR algorithm for complex Hessenberg
/// matrices" (comlr), with rotations for eliminations.
[[nodiscard]] std::optional<Eigen::VectorXcd> extended_eigenvalues_of(const DoubleDoubleMatrix& M);

/// The same of D⁻¹MD with the powers of two D that balance M.
[[nodiscard]] std::optional<Eigen::VectorXcd> balanced_extended_eigenvalues_of(
    DoubleDoubleMatrix M);

/// Those of a matrix whose entries no double holds, times 2^rate: balanced by their exponents
/// first. In doubles' precision where the iteration does not end.
[[nodiscard]] Eigen::VectorXcd wide_eigenvalues_of(WideMatrix M, long rate = 0);

}  // namespace flyball::detail
