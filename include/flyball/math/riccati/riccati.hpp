#pragma once

#include <complex>

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
  overflow,                 ///< An entry of X or K exceeds the largest double.
};
[[nodiscard]] ErrorInfo error_info(RiccatiError code);

/// The stabilising solution of an algebraic Riccati equation.
struct RiccatiSolution {
  Eigen::MatrixXd X;       ///< n x n, symmetric.
  Eigen::MatrixXd K;       ///< m x n, (R + BᵀXB)⁻¹(BᵀXA + Nᵀ): u = -K x.
  Eigen::VectorXcd poles;  ///< n, eigenvalues of A - BK, all inside the unit circle.
  /// What X leaves of F beside the sum of the norms of F's terms, or X and K of the closed loop's
  /// equation and of K's beside theirs, in units in which X or the data is balanced. At most 1e-9.
  double residual = 0.0;
  double condition = 0.0;  ///< Estimate: condition * residual estimates X's relative error.
  int iterations = 0;      ///< Doubling steps plus Newton steps; 0: a closed form.
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
///           every X; RiccatiError::no_convergence, also where X exists but the last digits of
///           A - BK decide whether it is stable; RiccatiError::overflow.
/// Cost: about 100 n³ operations for ordinary data; data that is badly scaled, near the unit circle
/// or has a singular R is solved again with balancing, shifts and refinement in twice the working
/// precision; up to twenty states that grow a thousandfold a step or hang on the inputs by 1e-6 in
/// four times that of doubles, which takes milliseconds. Allocates the result only when n and m are
/// small.
///
/// Source: the book's Theorem 7.7.1 (LQR) and section B.1 (N). Structure-preserving doubling: Chu,
/// Fan, Lin and Wang, "Structure-preserving algorithms for periodic discrete-time algebraic Riccati
/// equations", Int. J. Control 77 (2004). Newton: Hewer, IEEE Trans. Automatic Control 16 (1971).
[[nodiscard]] Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B,
                                             const MatrixRef& Q, const MatrixRef& R,
                                             const MatrixRef& N);
[[nodiscard]] Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B,
                                             const MatrixRef& Q, const MatrixRef& R);

/// The stabilising solution X = Xᵀ of the continuous-time algebraic Riccati equation
///
///   F(X) = AᵀX + XA - (XB + N)R⁻¹(BᵀX + Nᵀ) + Q = 0
///
/// for which A - BK, K = R⁻¹(BᵀX + Nᵀ), has all eigenvalues left of the imaginary axis. As `dare`:
/// its existence decides, Q and R may be indefinite; R must have an inverse.
///
/// @errors   As `dare`; RiccatiError::singular where R has no inverse.
/// Source: book, Theorem 7.7.1's continuous counterpart in section 5.11.1, equation 5.1 (whose
/// first term is AᵀX). Doubling after a Cayley transform: Chu, Fan and Lin, "A structure-preserving
/// doubling algorithm for continuous-time algebraic Riccati equations", Linear Algebra Appl. 396
/// (2005). Newton: Kleinman, IEEE Trans. Automatic Control 13 (1968).
[[nodiscard]] Expected<RiccatiSolution> care(const MatrixRef& A, const MatrixRef& B,
                                             const MatrixRef& Q, const MatrixRef& R,
                                             const MatrixRef& N);
[[nodiscard]] Expected<RiccatiSolution> care(const MatrixRef& A, const MatrixRef& B,
                                             const MatrixRef& Q, const MatrixRef& R);

/// RiccatiSolution with its sizes known when compiling; nothing of it is on the heap.
template <int States, int Inputs>
struct FixedRiccatiSolution {
  Eigen::Matrix<double, States, States> X;
  Eigen::Matrix<double, Inputs, States> K;
  Eigen::Vector<std::complex<double>, States> poles;
  double residual = 0.0;
  double condition = 0.0;
  int iterations = 0;
};

namespace detail {

/// An equation and the places for its answer, all column-major without gaps; N may be null.
struct RiccatiData {
  int states = 0;
  int inputs = 0;
  const double* A = nullptr;
  const double* B = nullptr;
  const double* Q = nullptr;
  const double* R = nullptr;
  const double* N = nullptr;
  bool continuous = false;
};
struct RiccatiAnswer {
  double* X = nullptr;
  double* K = nullptr;
  std::complex<double>* poles = nullptr;
  double residual = 0.0;
  double condition = 0.0;
  int iterations = 0;
};
[[nodiscard]] Expected<void> solve_riccati(const RiccatiData& data, RiccatiAnswer& answer);

}  // namespace detail

/// The same as the dynamic `dare` through the same compiled kernels, without its allocations: for
/// a regulator that is designed anew in each step of a loop. Ordinary data of up to ten states
/// does not allocate; data that needs the careful way does.
template <int States, int Inputs>
  requires(States > 0 && Inputs > 0)
[[nodiscard]] Expected<FixedRiccatiSolution<States, Inputs>> dare(
    const Eigen::Matrix<double, States, States>& A, const Eigen::Matrix<double, States, Inputs>& B,
    const Eigen::Matrix<double, States, States>& Q, const Eigen::Matrix<double, Inputs, Inputs>& R,
    const Eigen::Matrix<double, States, Inputs>& N) {
  Expected<FixedRiccatiSolution<States, Inputs>> solution;
  detail::RiccatiAnswer answer{solution->X.data(), solution->K.data(), solution->poles.data()};
  auto solved = detail::solve_riccati(
      {States, Inputs, A.data(), B.data(), Q.data(), R.data(), N.data()}, answer);
  if (!solved) {
    return tl::unexpected(std::move(solved).error());
  }
  solution->residual = answer.residual;
  solution->condition = answer.condition;
  solution->iterations = answer.iterations;
  return solution;
}
template <int States, int Inputs>
  requires(States > 0 && Inputs > 0)
[[nodiscard]] Expected<FixedRiccatiSolution<States, Inputs>> dare(
    const Eigen::Matrix<double, States, States>& A, const Eigen::Matrix<double, States, Inputs>& B,
    const Eigen::Matrix<double, States, States>& Q,
    const Eigen::Matrix<double, Inputs, Inputs>& R) {
  const Eigen::Matrix<double, States, Inputs> none = Eigen::Matrix<double, States, Inputs>::Zero();
  return dare<States, Inputs>(A, B, Q, R, none);
}

}  // namespace flyball
