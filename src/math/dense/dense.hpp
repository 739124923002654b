#pragma once

#include <optional>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// Products and decompositions of dynamic matrices for every domain, compiled once in dense.cpp,
/// dense_complex.cpp and dense_spectral.cpp: written where they are used, each of them would cost
/// that source seconds to compile.
namespace flyball::detail {

using ComplexMatrixRef = Eigen::Ref<const Eigen::MatrixXcd>;

/// A B.
[[nodiscard]] Eigen::MatrixXd product(const MatrixRef& A, const MatrixRef& B);
[[nodiscard]] Eigen::MatrixXcd complex_product(const ComplexMatrixRef& A,
                                               const ComplexMatrixRef& B);

/// Aᵀ B.
[[nodiscard]] Eigen::MatrixXd transposed_product(const MatrixRef& A, const MatrixRef& B);

/// A Bᵀ.
[[nodiscard]] Eigen::MatrixXd product_transposed(const MatrixRef& A, const MatrixRef& B);

/// (M + Mᵀ)/2.
[[nodiscard]] Eigen::MatrixXd symmetrized(const MatrixRef& M);

/// A⁻¹ B by LU with row pivoting; `rcond`, where asked for, receives the reciprocal condition of A
/// in the 1-norm, zero where a pivot vanishes.
[[nodiscard]] Eigen::MatrixXd solve_linear(const MatrixRef& A, const MatrixRef& B,
                                           double* rcond = nullptr);
[[nodiscard]] Eigen::MatrixXcd solve_complex(const ComplexMatrixRef& A, const ComplexMatrixRef& B,
                                             double* rcond = nullptr);

/// A⁻¹ B for a symmetric A, definite or nearly so, by LDLᵀ with diagonal pivoting.
[[nodiscard]] Eigen::MatrixXd solve_symmetric(const MatrixRef& A, const MatrixRef& B);

/// The x of least norm among those that minimise ‖A x - b‖, column by column of B, by a rank
/// revealing complete orthogonal decomposition.
[[nodiscard]] Eigen::MatrixXd solve_least_squares(const MatrixRef& A, const MatrixRef& B);

/// Lower triangular L with S = L Lᵀ; nothing where S is not positive definite.
[[nodiscard]] std::optional<Eigen::MatrixXd> cholesky_of(const MatrixRef& S);

/// A = Q R by Householder reflections, Q square.
struct OrthogonalTriangular {
  Eigen::MatrixXd Q;
  Eigen::MatrixXd R;
};
[[nodiscard]] OrthogonalTriangular full_qr(const MatrixRef& A);

/// The same with column pivoting: the diagonal of R shrinks and shows the rank of A, whose range is
/// spanned by as many leading columns of Q.
[[nodiscard]] OrthogonalTriangular pivoted_qr(const MatrixRef& A);

/// Powers of two d such that row and column sums of diag(d)⁻¹ A diag(d) are close (Osborne;
/// LAPACK's xGEBAL without its permutations). All ones where that does not lower the 1-norm.
[[nodiscard]] Eigen::VectorXd balance_of(const MatrixRef& A);

/// The eigenvalues of A, after balancing, of its `spectral_blocks` one by one; all NaN where the QR
/// iteration did not converge.
[[nodiscard]] Eigen::VectorXcd eigenvalues_of(const MatrixRef& A);
[[nodiscard]] Eigen::VectorXcd eigenvalues_of_complex(const ComplexMatrixRef& A);

/// A V = V diag(values), the columns of V of norm 1.
struct Eigensystem {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
};
[[nodiscard]] Eigensystem eigensystem_of(const MatrixRef& A);

/// S = V diag(values) Vᵀ with V orthogonal, values increasing.
struct SymmetricEigensystem {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] SymmetricEigensystem symmetric_eigensystem_of(const MatrixRef& S);

/// A = U T Uᴴ, T upper triangular, U unitary.
struct ComplexSchur {
  Eigen::MatrixXcd T;
  Eigen::MatrixXcd U;
  bool converged = false;
};
[[nodiscard]] ComplexSchur complex_schur_of(const MatrixRef& A);
[[nodiscard]] ComplexSchur complex_schur_of_complex(const ComplexMatrixRef& A);

/// A = U diag(values) Vᵀ, U and V square, the values decreasing.
struct SingularValues {
  Eigen::MatrixXd U;
  Eigen::VectorXd values;
  Eigen::MatrixXd V;
};
[[nodiscard]] SingularValues svd_of(const MatrixRef& A);
[[nodiscard]] Eigen::VectorXd singular_values_of(const MatrixRef& A);
[[nodiscard]] Eigen::VectorXd singular_values_of_complex(const ComplexMatrixRef& A);

/// sup ‖A x‖₁ / ‖x‖₁: the largest column sum of magnitudes.
[[nodiscard]] double norm1(const MatrixRef& A);

}  // namespace flyball::detail
