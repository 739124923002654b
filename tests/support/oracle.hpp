#pragma once

#include <complex>

#include <Eigen/Core>

namespace flyball::test {

// Eigen's decompositions as oracles, compiled once: each costs a test that includes it ten seconds
// of compiling.

[[nodiscard]] Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A);
[[nodiscard]] Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& S);

struct Modes {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
};
[[nodiscard]] Modes modes_of(const Eigen::MatrixXd& A);

/// In decreasing order.
[[nodiscard]] Eigen::VectorXd singular_values(const Eigen::MatrixXd& A);
[[nodiscard]] Eigen::VectorXd singular_values(const Eigen::MatrixXcd& A);

[[nodiscard]] Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);
[[nodiscard]] Eigen::MatrixXcd inverse(const Eigen::MatrixXcd& A);

/// αᵢ/βᵢ are the eigenvalues of A - λB.
struct GeneralizedEigenvalues {
  Eigen::VectorXcd alphas;
  Eigen::VectorXd betas;
};
[[nodiscard]] GeneralizedEigenvalues generalized_eigenvalues(const Eigen::MatrixXd& A,
                                                             const Eigen::MatrixXd& B);

[[nodiscard]] double determinant(const Eigen::MatrixXd& A);

/// L of P = L Lᵀ.
[[nodiscard]] Eigen::MatrixXd cholesky_factor(const Eigen::MatrixXd& P);
/// eᵀP⁻¹e of a positive definite P.
[[nodiscard]] double squared_distance(const Eigen::MatrixXd& P, const Eigen::VectorXd& e);

/// A⁻¹B.
[[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
[[nodiscard]] Eigen::MatrixXcd solve(const Eigen::MatrixXcd& A, const Eigen::MatrixXcd& B);

/// The x of least length among those for which |A x - b| is least.
[[nodiscard]] Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
/// Moore and Penrose's.
[[nodiscard]] Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A);

/// C (s I - A)⁻¹ B + D.
[[nodiscard]] Eigen::MatrixXcd response(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                                        const Eigen::MatrixXd& C, const Eigen::MatrixXd& D,
                                        std::complex<double> s);

}  // namespace flyball::test
