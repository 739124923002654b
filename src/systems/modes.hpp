#pragma once

#include <Eigen/Core>

#include <flyball/systems/analysis.hpp>

namespace flyball::detail {

/// The eigenvalues of 2^exponent A, how far rounding may have moved each, and what that makes of
/// them.
struct JudgedEigenvalues {
  Eigen::VectorXcd values;
  Eigen::VectorXcd of_A;  ///< The same of A itself.
  Eigen::VectorXd uncertainty;
  std::vector<Stability> verdicts;
  Stability stability = Stability::stable;  ///< Of all, with defective ones on the boundary.
  bool converged = true;
};
/// @param blur  How far rounding has moved the entries of A before.
[[nodiscard]] JudgedEigenvalues judged_eigenvalues(const MatrixRef& A, TimeDomain domain,
                                                   double blur = 0.0, int exponent = 0);

/// "-2", "-1.5 +/- 3i".
[[nodiscard]] std::string pole_text(std::complex<double> pole);

}  // namespace flyball::detail
