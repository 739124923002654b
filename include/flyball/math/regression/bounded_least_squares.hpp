#pragma once

#include <vector>

#include <flyball/math/regression/least_squares.hpp>

namespace flyball {

/// Where a coefficient of a bounded regression ended.
enum class BoundState { at_lower, between, at_upper };

/// The best coefficients within bounds.
struct BoundedLeastSquares {
  Eigen::VectorXd coefficients;   ///< p.
  std::vector<BoundState> state;  ///< p.
  Eigen::VectorXd gradient;  ///< Xᵀ(Xβ - y): zero between the bounds, >= 0 at a lower one, <= 0 at
                             ///< an upper one.
  double residual_norm = 0.0;  ///< ‖X β - y‖.
  int iterations = 0;          ///< Bounds that were taken or left.
};

/// The β that minimises ‖X β - y‖ with lower <= β <= upper, by an active set method.
///
/// @param X  n x p. @param y  n. @param lower, upper  p, or 1 for all of them; infinite where
/// there is none. Lower bounds 0 are the problem NNLS.
/// @errors ArgumentError for shapes and entries, out_of_range for a lower bound above its upper
/// one; RegressionError::no_convergence after 30 p + 100 changes.
/// Cost: O(n p²) once and O(p³) a change; allocates.
/// Source: Stark and Parker, "Bounded-variable least-squares", Computational Statistics 10 (1995);
/// Lawson and Hanson, "Solving Least Squares Problems" (1974), chapter 23.
[[nodiscard]] Expected<BoundedLeastSquares> bounded_least_squares(const MatrixRef& X,
                                                                  const MatrixRef& y,
                                                                  const Eigen::VectorXd& lower,
                                                                  const Eigen::VectorXd& upper);

}  // namespace flyball
