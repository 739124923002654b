#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// Why a matrix exponential has no answer.
enum class MatrixExponentialError {
  overflow,  ///< An entry of exp(A) exceeds the largest double.
};
[[nodiscard]] ErrorInfo error_info(MatrixExponentialError code);

/// The matrix exponential exp(A) = I + A + A²/2! + A³/3! + …
///
/// Scaling and squaring with the diagonal Padé approximant of order 3, 5, 7, 9 or 13 that the norms
/// of the powers of A ask for (not the norm of A, which overscales), after a diagonal balancing by
/// powers of two. The diagonal and first off-diagonal of a triangular matrix are squared in closed
/// form, and a 2x2 matrix is answered in closed form, so stiff ones such as [[-1, 1], [0, -2000]]
/// keep full accuracy.
///
/// @param A  n x n; for the solution of dx/dt = A x over the time T pass A T (no unit).
/// @return   exp(A), n x n.
/// @errors   ArgumentError::wrong_shape, empty, not_finite; MatrixExponentialError::overflow with
///           the spectral abscissa of A as evidence.
/// Cost: about (7 + s) products of n x n matrices, s the number of squarings. Allocates.
///
/// Source: Al-Mohy and Higham, "A new scaling and squaring algorithm for the matrix exponential",
/// SIAM J. Matrix Anal. Appl. 31 (2009), Algorithms 5.1 and 2.1; the book's section 7.3.
[[nodiscard]] Expected<Eigen::MatrixXd> expm(const MatrixRef& A);

}  // namespace flyball
