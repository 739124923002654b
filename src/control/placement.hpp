#pragma once

#include <optional>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

#include "math/dense.hpp"

/// The steps of pole placement, on a plant whose arguments have been checked.
namespace flyball::detail {

/// A = Q [A_c *; 0 A_u] Qᵀ, B = Q [B_c; 0]: (A_c, B_c) is controllable, the modes of A_u stay.
struct ControllableStaircase {
  Eigen::MatrixXd Q;
  Eigen::MatrixXd A;  ///< Qᵀ A Q
  Eigen::MatrixXd B;  ///< Qᵀ B
  Eigen::Index controllable = 0;
};
[[nodiscard]] ControllableStaircase controllable_staircase(const MatrixRef& A, const MatrixRef& B);

/// A controllable pair with B = U_0 Z of full column rank; `null_rows` are the rows of U_1ᵀ.
struct PlacementProblem {
  Eigen::MatrixXd A;
  Eigen::MatrixXd range;      ///< U_0: n x r, orthonormal.
  Eigen::MatrixXd null_rows;  ///< U_1ᵀ: (n - r) x n, orthonormal.
  Eigen::MatrixXd B_pinv;     ///< m x n
  Eigen::VectorXcd poles;     ///< Real ones first, then pairs (p, conj p) next to each other.
};

/// What a closed loop must be for the gain K = B⁺ (A - M), and the condition of its unit
/// eigenvectors where the method knows them.
struct PlacedLoop {
  Eigen::MatrixXd M;
  double condition = 0.0;
};

/// Eigenvectors made as independent as they can be. Nothing where none are independent.
[[nodiscard]] std::optional<PlacedLoop> place_eigenvectors(const PlacementProblem& problem);

/// The loop as an orthogonal triangular form, whatever the multiplicities.
[[nodiscard]] std::optional<PlacedLoop> place_triangular(const PlacementProblem& problem);

/// Ackermann's formula for one input in twice the working precision; nothing where even that does
/// not carry it.
[[nodiscard]] std::optional<Eigen::RowVectorXd> ackermann(const MatrixRef& A, const MatrixRef& b,
                                                          const Eigen::VectorXcd& poles);

/// An orthonormal basis of {v : M v = 0} for an M of full row rank, rows < columns.
[[nodiscard]] Eigen::MatrixXcd null_space_of(const ComplexMatrixRef& M);

/// Orthonormal right singular vectors of M for its `count` largest singular values, M with few
/// columns.
[[nodiscard]] Eigen::MatrixXcd leading_directions(const ComplexMatrixRef& M, Eigen::Index count);

/// The largest singular value of M; infinite where M is not finite.
[[nodiscard]] double norm2(const ComplexMatrixRef& M);

}  // namespace flyball::detail
