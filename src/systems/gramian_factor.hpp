#pragma once

#include <Eigen/Core>

#include <flyball/systems/analysis.hpp>

namespace flyball::detail {

/// L of the controllability Gramian L Lᵀ of a stable pair, n x n. The squared Smith iteration on
/// factors, W = Σ AᵏBBᵀAᵏᵀ, after a Cayley transform in the continuous case.
/// @errors SystemError::not_stable, no_convergence.
/// Source: Smith, SIAM J. Appl. Math. 16 (1968); Penzl, SIAM J. Sci. Comput. 21 (2000).
[[nodiscard]] Expected<Eigen::MatrixXd> gramian_factor(const MatrixRef& A, const MatrixRef& B,
                                                       TimeDomain domain, std::string_view where);

/// The factors of both Gramians, in the units of `states`: x = diag(states) x'.
struct GramianFactors {
  Eigen::VectorXd states;
  Eigen::MatrixXd controllability;
  Eigen::MatrixXd observability;
};
[[nodiscard]] Expected<GramianFactors> gramian_factors(const ContinuousSystem<>& system,
                                                       TimeDomain domain, std::string_view where);

/// The pole that makes a system other than stable, as an error.
[[nodiscard]] Expected<void> check_stable(const MatrixRef& A, TimeDomain domain,
                                          std::string_view where);

}  // namespace flyball::detail
