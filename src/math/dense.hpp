#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// Products and decompositions of dynamic matrices, compiled once in dense.cpp: written where they
/// are used, each of them would cost that source seconds to compile.
namespace flyball::detail {

/// A B.
[[nodiscard]] Eigen::MatrixXd product(const MatrixRef& A, const MatrixRef& B);

/// Aᵀ B.
[[nodiscard]] Eigen::MatrixXd transposed_product(const MatrixRef& A, const MatrixRef& B);

/// A⁻¹ B by LU with row pivoting; `rcond`, where asked for, receives the reciprocal condition of A
/// in the 1-norm, zero where a pivot vanishes.
[[nodiscard]] Eigen::MatrixXd solve_linear(const MatrixRef& A, const MatrixRef& B,
                                           double* rcond = nullptr);

/// The eigenvalues of A.
[[nodiscard]] Eigen::VectorXcd eigenvalues_of(const MatrixRef& A);

/// A = Q R by Householder reflections, Q square.
struct OrthogonalTriangular {
  Eigen::MatrixXd Q;
  Eigen::MatrixXd R;
};
[[nodiscard]] OrthogonalTriangular full_qr(const MatrixRef& A);

/// The same with column pivoting: the diagonal of R shrinks and shows the rank of A, whose range is
/// spanned by as many leading columns of Q.
[[nodiscard]] OrthogonalTriangular pivoted_qr(const MatrixRef& A);

}  // namespace flyball::detail
