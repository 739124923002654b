#pragma once

#include <Eigen/Core>

namespace flyball::detail {

/// ‖A‖₂ from above, A without negative entries, exact or rounded up.
[[nodiscard]] double norm_above(const Eigen::MatrixXd& A);

/// More than the relative error of an inner product of n terms and some operations around it.
[[nodiscard]] double product_rounding(Eigen::Index n);

/// Whether S + G is positive definite for every symmetric ‖G‖₂ <= error, S symmetric (its lower
/// half is read): a Cholesky factor in floating point after a shift by more than its rounding.
/// Source: Rump, "Verification of positive definiteness", BIT 46 (2006).
[[nodiscard]] bool surely_positive(Eigen::MatrixXd S, double error);

/// The same of a Hermitian S and every Hermitian G, by the symmetric matrix of twice the size.
[[nodiscard]] bool surely_positive(const Eigen::MatrixXcd& S, double error);

}  // namespace flyball::detail
