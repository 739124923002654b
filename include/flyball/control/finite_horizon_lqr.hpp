#pragma once

#include <span>
#include <vector>

#include <flyball/control/lqr.hpp>
#include <flyball/control/quadratic_cost.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball {

/// The time-varying regulator of a finite horizon, u_k = K[k] (r_k - x_k).
struct FiniteHorizonLqr {
  std::vector<Eigen::MatrixXd> K;  ///< A gain a step (discrete) or sample (continuous).
  /// Cost-to-go matrices, one more than steps (discrete) or as many as samples (continuous); the
  /// last is the terminal weight.
  std::vector<Eigen::MatrixXd> S;
};

/// Finite-horizon discrete regulator: minimises x_NᵀS_N x_N + Σ_{k<N} xᵀQx + 2 xᵀNu + uᵀRu.
///
/// Backwards from S_N: K_k = (R + BᵀS_{k+1}B)⁻¹(BᵀS_{k+1}A + Nᵀ) and
/// S_k = (A - BK_k)ᵀS_{k+1}(A - BK_k) + K_kᵀRK_k - N K_k - K_kᵀNᵀ + Q, the form that keeps S
/// symmetric and positive.
///
/// @param A  n x n. @param B  n x m. @param cost  Q, R and N; an N of no size is zero.
/// @param S_N  n x n, symmetric, the weight of what is left at the end. @param steps  >= 1.
/// @errors ArgumentError for shapes, entries, asymmetry and steps out of 1 … 10⁷/(n² + nm + 64);
///         RiccatiError::singular with the step at which R + BᵀSB is not positive definite.
/// Cost: O(n³) a step. Source: book, section 7.7.2 and appendix B.1; Bryson and Ho, "Applied
/// Optimal Control" (1975), section 2.3.
[[nodiscard]] Expected<FiniteHorizonLqr> finite_horizon_lqr(const MatrixRef& A, const MatrixRef& B,
                                                            const QuadraticCost& cost,
                                                            const Weight& S_N, int steps);

/// The same for a plant that changes from step to step, such as one linearised along a trajectory:
/// plants[k] takes x_k to x_{k+1}, A n x n and B n x m for each.
/// @errors As above; ArgumentError::empty without a plant, wrong_shape where one has other sizes.
/// Cost: O(n³) a step; allocates. Source: as above.
[[nodiscard]] Expected<FiniteHorizonLqr> finite_horizon_lqr(
    std::span<const DiscretizedMatrices> plants, const QuadraticCost& cost, const Weight& S_N);

/// Finite-horizon continuous regulator: minimises x(T)ᵀS_T x(T) + ∫₀ᵀ xᵀQx + 2 xᵀNu + uᵀRu dt, with
/// K and S at the times 0, T/steps, …, T.
///
/// The Riccati differential equation -dS/dt = AᵀS + SA - (SB + N)R⁻¹(BᵀS + Nᵀ) + Q is not
/// integrated: over a time h its solution is exactly S(t - h) = γ + αᵀS(t)(I + βS(t))⁻¹α, with α, β
/// and γ from the exponential of the Hamiltonian over a short time, and doubled from there.
///
/// @param A, B  Continuous. @param cost  R positive definite. @param horizon  T, s.
/// @param steps  >= 1.
/// @errors As the discrete one; RiccatiError::singular where R is not positive definite or S grows
///         without bound within the horizon (a conjugate point, for an indefinite Q or S_T);
///         RiccatiError::overflow where A, BR⁻¹Bᵀ or Q exceed a double over a step.
/// Cost: O(n³) a step and O(n³ log ‖H‖T/steps) once. Source: Davison and Maki, IEEE Trans.
/// Automatic Control 18 (1973); doubling: Anderson, Int. J. Control 28 (1978).
[[nodiscard]] Expected<FiniteHorizonLqr> continuous_finite_horizon_lqr(const MatrixRef& A,
                                                                       const MatrixRef& B,
                                                                       const QuadraticCost& cost,
                                                                       const Weight& S_T,
                                                                       Time horizon, int steps);

}  // namespace flyball
