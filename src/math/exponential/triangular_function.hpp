#pragma once

#include <complex>

#include <Eigen/Core>

/// Logarithm and power of an upper triangular complex matrix without eigenvalues on the closed
/// negative real axis.
namespace flyball::detail {

[[nodiscard]] Eigen::MatrixXcd triangular_logarithm(const Eigen::MatrixXcd& T);

/// log(I + X), ‖X‖₁ at most `near_identity`, with a relative error of rounding in X's size.
inline constexpr double near_identity = 0.25;
[[nodiscard]] Eigen::MatrixXd logarithm_near_identity(const Eigen::MatrixXd& X);

/// T^p, -1 < p < 1.
[[nodiscard]] Eigen::MatrixXcd triangular_power(const Eigen::MatrixXcd& T, double p);

/// T⁻¹ B for an upper triangular T.
[[nodiscard]] Eigen::MatrixXcd solve_triangular(const Eigen::MatrixXcd& T, Eigen::MatrixXcd B);

/// Reorders a complex Schur form A = U T Uᴴ by rotations: the diagonal entry at `from` goes to
/// `to`, those between move by one.
void move_eigenvalue(Eigen::MatrixXcd& T, Eigen::MatrixXcd& U, Eigen::Index from, Eigen::Index to);

}  // namespace flyball::detail
