#pragma once

#include <flyball/systems/analysis.hpp>

namespace flyball {

/// The solution of a Gramian's Lyapunov equation.
struct Gramian {
  Eigen::MatrixXd W;            ///< n x n, symmetric.
  Eigen::VectorXd eigenvalues;  ///< n, increasing; larger is easier to reach or see (6.12.2).
  /// Whether A is stable, so that W is the integral (6.39) or (6.43), an energy: otherwise it
  /// solves the equation and is not positive semidefinite.
  bool is_energy = false;
  double residual = 0.0;   ///< Of the equation, relative to its terms.
  double condition = 0.0;  ///< Estimate: how much relative errors of the data grow in W.
};

/// W_c: A W + W Aᵀ + BBᵀ = 0 (6.38), or A W Aᵀ - W + BBᵀ = 0. xᵀW_c⁻¹x is the least input energy
/// that brings a stable system from rest to x.
/// @param A  n x n. @param B  n x m.
/// @errors ArgumentError for shapes and entries; MatrixEquationError::no_unique_solution where two
///         poles mirror each other in the boundary of stability, a pole on it among them.
/// Cost: O(n³), allocates. Source: book, 6.12.2.
[[nodiscard]] Expected<Gramian> controllability_gramian(const MatrixRef& A, const MatrixRef& B,
                                                        TimeDomain domain);

/// W_o: Aᵀ W + W A + CᵀC = 0 (6.42), or AᵀW A - W + CᵀC = 0. x₀ᵀW_o x₀ is the energy of the output
/// of a stable system that is left to itself. @param C  p x n. @errors As above.
/// Source: book, 6.12.6.
[[nodiscard]] Expected<Gramian> observability_gramian(const MatrixRef& A, const MatrixRef& C,
                                                      TimeDomain domain);

/// The Hankel singular values, the square roots of the eigenvalues of W_c W_o: how much each
/// balanced state takes part in what the inputs do to the outputs, whatever the states' units.
///
/// From factors of the Gramians, which are never squared: small ones keep their digits.
/// @return n, decreasing.
/// @errors ArgumentError for the system; SystemError::not_stable with the pole;
///         SystemError::no_convergence.
/// Cost: O(n³ log κ), κ the ratio of the fastest to the slowest time constant; allocates.
/// Source: Moore, IEEE Trans. Automatic Control 26 (1981); Laub, Heath, Paige and Ward, same, 32
/// (1987).
[[nodiscard]] Expected<Eigen::VectorXd> hankel_singular_values(const ContinuousSystem<>& system);
[[nodiscard]] Expected<Eigen::VectorXd> hankel_singular_values(const DiscreteSystem<>& system);

}  // namespace flyball
