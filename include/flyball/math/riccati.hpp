#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// Why a Riccati equation has no stabilising solution, or none was found.
enum class RiccatiError {
  not_stabilizable,         ///< A mode on or outside the unit circle that no input reaches.
  no_stabilizing_solution,  ///< Closed-loop poles cannot all be inside the unit circle.
  singular,                 ///< R + BᵀXB has no inverse.
  no_convergence,           ///< The iterations ended without an answer that could be verified.
};
[[nodiscard]] ErrorInfo error_info(RiccatiError code);

/// The stabilising solution of a discrete-time algebraic Riccati equation.
struct RiccatiSolution {
  Eigen::MatrixXd X;       ///< n x n, symmetric.
  Eigen::MatrixXd K;       ///< m x n, (R + BᵀXB)⁻¹(BᵀXA + Nᵀ): u = -K x.
  Eigen::VectorXcd poles;  ///< n, eigenvalues of A - BK, all inside the unit circle.
  double residual = 0.0;   ///< ‖F(X)‖ / sum of the norms of F's terms (Frobenius).
  double condition = 0.0;  ///< Estimate: condition * residual estimates X's relative error.
  int iterations = 0;      ///< Doubling steps plus Newton steps.
};

/// The stabilising solution X = Xᵀ of the discrete-time algebraic Riccati equation
///
///   F(X) = AᵀXA - X - (AᵀXB + N)(R + BᵀXB)⁻¹(BᵀXA + Nᵀ) + Q = 0
///
/// for which A - BK, K = (R + BᵀXB)⁻¹(BᵀXA + Nᵀ), has all eigenvalues inside the unit circle.
/// Whether that solution exists decides, not a textbook precondition: Q may be indefinite, (A, Q)
/// undetectable, and R singular or indefinite.
///
/// @param A  n x n, the state matrix x₊ = A x + B u.
/// @param B  n x m, the input matrix.
/// @param Q  n x n, symmetric, the state weight of Σ xᵀQx + 2xᵀNu + uᵀRu.
/// @param R  m x m, symmetric, the input weight.
/// @param N  n x m, the cross weight; none is zero.
/// @return   X, K, the closed-loop poles, and how good they are. A result has been verified: it is
///           finite and symmetric, its poles are inside the unit circle, and its residual and
///           condition vouch for its digits.
/// @errors   ArgumentError::wrong_shape, empty, not_finite, not_symmetric.
///           RiccatiError::not_stabilizable with the unreachable eigenvalue;
///           RiccatiError::no_stabilizing_solution with the eigenvalue of the symplectic pencil
///           that lies on the unit circle; RiccatiError::singular where R + BᵀXB is singular for
///           every X; RiccatiError::no_convergence.
/// Cost: about 100 n³ operations for ordinary data; data that is badly scaled, near the unit circle
/// or has a singular R is solved again with balancing, shifts and refinement in twice the working
/// precision. Allocates the result only when n and m are small.
///
/// Source: the book's Theorem 7.7.1 (LQR) and section B.1 (N). Structure-preserving doubling: Chu,
/// Fan, Lin and Wang, "Structure-preserving algorithms for periodic discrete-time algebraic Riccati
/// equations", Int. J. Control 77 (2004). Newton: Hewer, IEEE Trans. Automatic Control 16 (1971).
[[nodiscard]] Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B,
                                             const MatrixRef& Q, const MatrixRef& R,
                                             const MatrixRef& N);
[[nodiscard]] Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B,
                                             const MatrixRef& Q, const MatrixRef& R);

}  // namespace flyball
