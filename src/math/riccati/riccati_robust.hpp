#pragma once

#include <flyball/math/riccati/riccati.hpp>

#include "math/extended/double_double.hpp"

namespace flyball::detail {

/// A Riccati equation with symmetric Q and R, checked.
struct RiccatiProblem {
  Eigen::MatrixXd A;
  Eigen::MatrixXd B;
  Eigen::MatrixXd Q;
  Eigen::MatrixXd R;
  Eigen::MatrixXd N;
  bool continuous = false;
};

/// M⁻¹ rhs for a symmetric M, equilibrated by powers of two first; `rcond` is that of the scaled M.
[[nodiscard]] Eigen::MatrixXd solve_equilibrated(const Eigen::MatrixXd& M,
                                                 const Eigen::MatrixXd& rhs, double& rcond);

/// A₀ = A - B R⁻¹Nᵀ, G = B R⁻¹Bᵀ, H = Q - N R⁻¹Nᵀ: the equation without N and R; nothing where R
/// has no inverse.
struct ReducedRiccati {
  Eigen::MatrixXd A;
  Eigen::MatrixXd G;
  Eigen::MatrixXd H;
};
[[nodiscard]] std::optional<ReducedRiccati> reduce(const RiccatiProblem& p);

/// The discrete equation for Y = X - X₀, which has the same closed loop.
[[nodiscard]] RiccatiProblem shifted(const RiccatiProblem& p, const Eigen::MatrixXd& X0);

/// Powers of two d such that the states z of x = diag(d) z have comparable A, G and H.
[[nodiscard]] Eigen::VectorXd balance_riccati(const RiccatiProblem& p);

/// The solution in twice the working precision, rounded.
struct ExtendedRiccati {
  Eigen::MatrixXd X;
  Eigen::MatrixXd K;
  Eigen::MatrixXd closed_loop;
  double gain = 0.0;      ///< ‖L⁻¹(I)‖ of the closed loop's Lyapunov operator.
  double scale = 0.0;     ///< Sum of the norms of F's terms.
  double residual = 0.0;  ///< ‖F(X)‖ of the rounded X.
  bool cancels = false;   ///< Twice the working precision was not enough.
  int iterations = 0;
};

/// Doubling and Newton's method in twice the working precision, from several shifts (discrete) and
/// Cayley parameters (continuous), and in four times where that is not enough; nothing where none
/// converges to a stabilising solution.
[[nodiscard]] std::optional<ExtendedRiccati> solve_riccati_extended(const RiccatiProblem& p);

/// Balances, solves in twice the working precision, verifies; the careful way for data that the
/// kernels do not vouch for.
[[nodiscard]] Expected<RiccatiSolution> solve_riccati_robustly(const RiccatiProblem& problem);

/// Why there is no answer.
[[nodiscard]] Error diagnose_riccati(const RiccatiProblem& p);

}  // namespace flyball::detail
