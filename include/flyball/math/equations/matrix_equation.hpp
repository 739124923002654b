#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// Why a linear matrix equation has no answer.
enum class MatrixEquationError {
  no_unique_solution,  ///< Two eigenvalues add up to zero (continuous) or multiply to one
                       ///< (discrete).
  no_convergence,      ///< The eigenvalues could not be computed.
  overflow,            ///< An entry of the solution exceeds the largest double.
  not_accurate,        ///< What was found leaves more than 1e-11 of an entry's terms.
};
[[nodiscard]] ErrorInfo error_info(MatrixEquationError code);

/// The solution of a linear matrix equation, and how good it is.
struct LinearMatrixSolution {
  Eigen::MatrixXd X;
  /// What is left of an entry of the equation / the sum of the magnitudes of that entry's terms,
  /// the largest over the entries: the relative change of the data of which X is exact.
  double residual = 0.0;
  double condition = 0.0;  ///< Estimate: how much relative errors of the data grow in X.
};

/// The continuous Lyapunov equation A X + X Aᵀ + Q = 0.
///
/// For a stable A and a symmetric Q by Smith's squared iteration (after a Cayley transform),
/// corrected once by its residual in twice the working precision and taken where its residual times
/// the condition vouches for it. Else by the real Schur form of the balanced A and, where the
/// condition is not ordinary, by its complex one (Bartels and Stewart), both with the residual
/// formed in twice the working precision and corrected until it is rounding. Data that is neither
/// is first brought to other units by powers of two; what then remains of n m <= 100 unknowns is
/// solved as so many linear equations in twice the working precision, with exponents of their own
/// where no unit holds all entries.
///
/// @param A  n x n, no two of whose eigenvalues add up to zero. It need not be stable.
/// @param Q  n x n; X is symmetric where Q is.
/// @errors   ArgumentError::wrong_shape, empty, not_finite; MatrixEquationError::no_unique_solution
///           with the pair of eigenvalues as evidence; overflow; not_accurate.
/// Cost: O(n³), allocates.
///
/// Source: book, section 5.11.3, equation 5.3; Bartels and Stewart, Comm. ACM 15 (1972); Smith,
/// SIAM J. Appl. Math. 16 (1968).
[[nodiscard]] Expected<LinearMatrixSolution> lyapunov(const MatrixRef& A, const MatrixRef& Q);

/// The discrete Lyapunov equation A X Aᵀ - X + Q = 0; no product of two eigenvalues of A may be
/// one. As `lyapunov`. Source: book, section 5.11.4, equation 5.4.
[[nodiscard]] Expected<LinearMatrixSolution> discrete_lyapunov(const MatrixRef& A,
                                                               const MatrixRef& Q);

/// The Sylvester equation A X + X B = C, X of n x m, by the Hessenberg form of the larger of A and
/// B and the real Schur form of the other; else as `lyapunov`.
/// @param A  n x n. @param B  m x m. @param C  n x m.
/// @errors   As `lyapunov`; the pair is an eigenvalue of A and one of B.
/// Source: Bartels and Stewart, Comm. ACM 15 (1972); Golub, Nash and Van Loan, IEEE Trans.
/// Automatic Control 24 (1979).
[[nodiscard]] Expected<LinearMatrixSolution> sylvester(const MatrixRef& A, const MatrixRef& B,
                                                       const MatrixRef& C);

/// The discrete Sylvester equation A X B - X + C = 0. As `sylvester`; the pair has the product one.
[[nodiscard]] Expected<LinearMatrixSolution> discrete_sylvester(const MatrixRef& A,
                                                                const MatrixRef& B,
                                                                const MatrixRef& C);

}  // namespace flyball
