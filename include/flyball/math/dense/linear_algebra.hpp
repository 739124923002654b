#pragma once

#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// The Moore-Penrose pseudoinverse, and the rank that it was computed with.
struct Pseudoinverse {
  Eigen::MatrixXd X;                ///< n x m: A X A = A, X A X = X, A X and X A symmetric.
  Eigen::Index rank = 0;            ///< Singular values above the tolerance.
  Eigen::VectorXd singular_values;  ///< min(m, n), decreasing.
};

/// A⁺ by singular values: x = A⁺b is the shortest of the x that minimise ‖Ax - b‖.
/// @param A  m x n. @param tolerance  Singular values below it, relative to the largest, count as
/// zero; 0 takes max(m, n) ε.
/// Where the largest of these is a thousand times the smallest, A⁺ is computed in twice the
/// precision.
/// @errors ArgumentError::empty, not_finite; out_of_range for a tolerance outside [0, 1), and where
///         A⁺ is beyond the largest double.
/// Cost: O(m n min(m, n)), allocates. Source: book, section 7.8.1 (B⁺); Golub and Van
/// Loan, "Matrix Computations", section 5.5.
[[nodiscard]] Expected<Pseudoinverse> pseudoinverse(const MatrixRef& A, double tolerance = 0.0);

/// The sign of xᵀSx.
enum class Definiteness {
  positive_definite,      ///< > 0 for every x but 0.
  positive_semidefinite,  ///< >= 0, and 0 for some x but 0.
  negative_definite,
  negative_semidefinite,
  zero,
  indefinite,  ///< Either sign.
};
/// "positive definite", …
[[nodiscard]] std::string_view to_string(Definiteness definiteness);

/// A symmetric matrix's definiteness, and the eigenvalues that say so.
struct DefinitenessTest {
  Definiteness definiteness = Definiteness::zero;
  Eigen::VectorXd eigenvalues;  ///< n, increasing.
  double tolerance = 0.0;       ///< Eigenvalues within it count as zero: n ε ‖S‖.
};

/// @param S  n x n, symmetric.
/// @errors ArgumentError::wrong_shape, empty, not_finite, not_symmetric. Cost: O(n³), allocates.
/// Source: book, section 5.10 (definiteness).
[[nodiscard]] Expected<DefinitenessTest> test_definiteness(const MatrixRef& S);

/// Whether S = L Lᵀ with a real invertible L, by Cholesky: cheaper than `test_definiteness`, and
/// independent of the units of the rows. @errors As there.
[[nodiscard]] Expected<bool> is_positive_definite(const MatrixRef& S);

/// The blocks one after the other on the diagonal, zeros elsewhere.
/// @param blocks  Any shapes, empty ones included. @return Σ rows x Σ columns.
[[nodiscard]] Eigen::MatrixXd block_diagonal(const std::vector<Eigen::MatrixXd>& blocks);

}  // namespace flyball
