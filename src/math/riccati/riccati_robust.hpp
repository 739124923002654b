#pragma once

#include <flyball/math/riccati/riccati.hpp>

#include "math/extended/double_double.hpp"
#include "math/riccati/riccati_work.hpp"

namespace flyball::detail {

/// A Riccati equation with symmetric Q and R, checked.
struct RiccatiProblem {
  Eigen::MatrixXd A;
  Eigen::MatrixXd B;
  Eigen::MatrixXd Q;
  Eigen::MatrixXd R;
  Eigen::MatrixXd N;
  bool continuous = false;
  int rate = 0;  ///< A is given in units of 2^rate, which its eigenvalues are told without.
  CarefulWork* work = nullptr;  ///< What is left of a budget, where there is one.
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
  double gain = 0.0;     ///< ‖L⁻¹(I)‖ of the closed loop's Lyapunov operator.
  double scale = 0.0;    ///< Sum of the norms of F's terms.
  bool cancels = false;  ///< Twice the working precision was not enough.
  int iterations = 0;
};

/// Doubling and Newton's method in twice the working precision, from several shifts (discrete) and
/// Cayley parameters (continuous), and in four times where that is not enough; nothing where none
/// converges to a stabilising solution.
[[nodiscard]] std::optional<ExtendedRiccati> solve_riccati_extended(const RiccatiProblem& p);

/// Balances, solves in twice the working precision, verifies; the careful way for data that the
/// kernels do not vouch for.
[[nodiscard]] Expected<RiccatiSolution> solve_riccati_robustly(const RiccatiProblem& problem);

/// The largest residual of an answer, for 1e-10 in any reckoning of the terms.
inline constexpr double small_residual = 3e-11;

/// Raises the residual to that of X and K as they stand.
/// @errors RiccatiError::no_convergence where it is not small.
[[nodiscard]] Expected<void> check_riccati(const RiccatiProblem& p, RiccatiSolution& solution);
/// The same with a residual that is known.
[[nodiscard]] Expected<void> judge_riccati(const RiccatiProblem& p, double residual,
                                           RiccatiSolution& solution);

/// With more states eigenvalues in twice the working precision would take seconds.
inline constexpr Eigen::Index most_states_in_twice = 20;

/// The eigenvalues of A - BK with the K that is answered: those of its exact entries, in twice the
/// working precision. Nothing where there are too many states for that.
[[nodiscard]] std::optional<Eigen::VectorXcd> riccati_poles(const MatrixRef& A, const MatrixRef& B,
                                                            const MatrixRef& K);

[[nodiscard]] bool are_stable(const Eigen::VectorXcd& poles, bool continuous);

/// That the answered poles are stable.
/// @errors RiccatiError::no_convergence where they are not: by the last digits of K.
[[nodiscard]] Expected<void> check_stable(const RiccatiProblem& p, const RiccatiSolution& solution);

/// What X and K leave of the closed loop's equation, SᵀXS - X + [I -Kᵀ][Q N; Nᵀ R][I; -K] with
/// S = A - BK, and of (R + BᵀXB)K = BᵀXA + Nᵀ, each beside the norms of its terms, the larger of
/// the two; in twice the working precision. Both are zero exactly for a solution of the Riccati
/// equation and its gain; F of a rounded X alone is not small where XB cancels.
[[nodiscard]] double riccati_residual(const RiccatiProblem& p, const Eigen::MatrixXd& X,
                                      const Eigen::MatrixXd& K);

/// Exponents of powers of two: the states x = 2^states z, the inputs u = 2^inputs v, the cost in
/// 2^weight, and, of a continuous equation, the rates in 2^rate.
struct RiccatiUnits {
  Eigen::VectorXi states;
  Eigen::VectorXi inputs;
  int weight = 0;
  int rate = 0;
};

/// `riccati_residual`, the gain and the poles of an answer in the given problem's units, measured
/// in other units with exponents that no product leaves.
[[nodiscard]] double wide_riccati_residual(const RiccatiProblem& given, const RiccatiUnits& units,
                                           const RiccatiSolution& solution);
[[nodiscard]] Eigen::VectorXcd wide_riccati_poles(const RiccatiProblem& given,
                                                  const RiccatiUnits& units,
                                                  const Eigen::MatrixXd& K);

/// Doubling and Newton's method with such exponents; nothing where they do not lead to a solution.
[[nodiscard]] std::optional<RiccatiSolution> solve_riccati_wide(const RiccatiProblem& given,
                                                                const RiccatiUnits& units);

/// The same for data whose size has no room in doubles for products: in other units, by powers of
/// two. K does not change when Q, R and N are multiplied by one number, nor X but for it.
[[nodiscard]] Expected<RiccatiSolution> solve_riccati_in_other_units(const RiccatiProblem& problem);

/// An unstable mode whose left vector and B cancel to the last digits of their entries: whatever
/// the digits of X, nothing reaches it. Found by one eigendecomposition, before anything that takes
/// longer; a mode that hangs on its inputs by little but surely is not told here.
[[nodiscard]] std::optional<Error> unreached_at_sight(const RiccatiProblem& p);

/// Why there is no answer.
[[nodiscard]] Error diagnose_riccati(const RiccatiProblem& p);

}  // namespace flyball::detail
