#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// Why a logarithm or a power of a matrix has no real answer.
enum class MatrixFunctionError {
  no_real_logarithm,  ///< A real eigenvalue is negative or zero.
  no_real_power,      ///< A real eigenvalue is negative, or a zero one is defective.
  singular,           ///< A negative power of a matrix without an inverse.
  overflow,           ///< An entry of the answer exceeds the largest double.
  not_accurate,       ///< What was found does not lead back to A: entries too far apart.
};
[[nodiscard]] ErrorInfo error_info(MatrixFunctionError code);

/// The principal logarithm: the X with exp(X) = A whose eigenvalues have imaginary parts between
/// -π and π.
///
/// Square roots of the triangular Schur factor until it is near I, then the Padé approximant of
/// log(1 + x) as partial fractions; diagonal and first superdiagonal in closed form.
///
/// @param A  n x n, without eigenvalues on the closed negative real axis.
/// @return   log A, n x n, real.
/// @errors   ArgumentError::wrong_shape, empty, not_finite; MatrixFunctionError::no_real_logarithm
///           with the offending eigenvalue; not_accurate where e^X is not A to 1e-9.
/// Cost: 25 n³ complex operations for the Schur form, n³/3 for each root and fraction. Allocates.
///
/// Source: Al-Mohy and Higham, "Improved inverse scaling and squaring algorithms for the matrix
/// logarithm", SIAM J. Sci. Comput. 34 (2012).
[[nodiscard]] Expected<Eigen::MatrixXd> logm(const MatrixRef& A);

/// The principal real power A^p = exp(p log A); exact products if p is whole.
///
/// Positive powers are also given where eigenvalues zero are not defective (a closed loop with
/// deadbeat poles): 0^p = 0.
///
/// @param A  n x n. @param power  p, any real number up to 1e9 in magnitude.
/// @errors   ArgumentError for shape, entries and range; MatrixFunctionError::no_real_power if p is
///           not whole and A has a negative real eigenvalue (the evidence) or a defective zero one;
///           singular for p < 0.
/// Cost: as `logm`. Allocates.
///
/// Source: Higham and Lin, "An improved Schur-Padé algorithm for fractional powers of a matrix and
/// their Fréchet derivatives", SIAM J. Matrix Anal. Appl. 34 (2013); the book's equation B.12.
[[nodiscard]] Expected<Eigen::MatrixXd> powm(const MatrixRef& A, double power);

}  // namespace flyball
