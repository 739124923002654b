#pragma once

#include <optional>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

namespace flyball::detail {

/// αᵢ/βᵢ are the λ at which A - λE is singular; β = 0 of one at infinity, both 0 where it is
/// singular everywhere.
struct GeneralizedEigenvalues {
  Eigen::VectorXcd alphas;
  Eigen::VectorXd betas;  ///< Not negative; of the size of |α| if E is of A's.
};

/// By the QZ iteration (Moler and Stewart, SIAM J. Numerical Analysis 10 (1973)); nothing where it
/// does not end. @param A, E  n x n. Cost: O(n³).
[[nodiscard]] std::optional<GeneralizedEigenvalues> generalized_eigenvalues_of(const MatrixRef& A,
                                                                               const MatrixRef& E);

}  // namespace flyball::detail
