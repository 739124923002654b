#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// Decompositions of hundreds of states, where those of dense.hpp take too long; compiled once in
/// dense_reduction.cpp.
namespace flyball::detail {

/// R of A = Q R by Householder reflections: min(rows, columns) x columns.
[[nodiscard]] Eigen::MatrixXd triangle_of(const MatrixRef& A);

/// A = Q H Qᵀ, H zero below its first subdiagonal, Q orthogonal.
struct Hessenberg {
  Eigen::MatrixXd H;
  Eigen::MatrixXd Q;
};
[[nodiscard]] Hessenberg hessenberg_of(const MatrixRef& A);

/// All singular values, decreasing, by a bidiagonal matrix: each to rounding of the largest, where
/// `singular_values_of` takes many times as long and keeps small ones of a graded matrix.
/// Cost: 4 m n² for n ≤ m, O(n²) for the rest.
/// Source: Golub, Kahan, "Calculating the singular values and pseudo-inverse of a matrix", SIAM J.
/// Numerical Analysis 2 (1965).
[[nodiscard]] Eigen::VectorXd coarse_singular_values_of(const MatrixRef& A);

/// The largest and the smallest of them, and how many are more than `share` of the largest.
struct SingularExtent {
  double largest = 0.0;
  double smallest = 0.0;
  Eigen::Index rank = 0;
};
/// As `coarse_singular_values_of`, by bisection: where values fall off over many decades, as of
/// powers of a matrix, the iteration for all of them takes most of the time.
[[nodiscard]] SingularExtent singular_extent_of(const MatrixRef& A, double share);

}  // namespace flyball::detail
