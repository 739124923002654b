#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/math/regression/least_squares.hpp>

/// What the regressions share: the decomposition of X, and what follows from it.
namespace flyball::detail {

/// X = Q T with orthonormal Q and X⁺ = S Qᵀ, as far as the columns of X are independent.
struct RegressorDecomposition {
  Eigen::MatrixXd Q;     ///< n x rank.
  Eigen::MatrixXd S;     ///< p x rank.
  Eigen::MatrixXd null;  ///< p x (p - rank), X null = 0.
  std::vector<bool> determined;
  double condition = 0.0;
};
[[nodiscard]] RegressorDecomposition decompose_regressors(const MatrixRef& X, double tolerance);

/// Powers of two that bring each column of X near length 1; 1 for a column of zeros.
[[nodiscard]] Eigen::VectorXd column_units(const MatrixRef& X);

/// The coefficients c = Qᵀ y corrected by residuals in twice the working precision.
/// @return  β.
[[nodiscard]] Eigen::VectorXd refined_solution(const MatrixRef& X, const MatrixRef& y,
                                               const RegressorDecomposition& decomposition);

/// Fills what follows from rank, determined, degrees_of_freedom, coefficients and covariance.
void tell_intervals(Regression& regression, double confidence);

/// R² and its adjusted form. @param total  Σ w (y - mean)², or without the mean.
void tell_r_squared(Regression& regression, double total, bool centred);

[[nodiscard]] Expected<void> check_confidence(double confidence, double tolerance,
                                              std::string_view where);

}  // namespace flyball::detail
