#pragma once

#include <Eigen/Core>

#include <flyball/math/riccati.hpp>

namespace flyball::detail {

/// The data of an equation whose shapes, symmetry and finiteness have been checked.
struct RiccatiProblem {
  Eigen::MatrixXd A;
  Eigen::MatrixXd B;
  Eigen::MatrixXd Q;
  Eigen::MatrixXd R;
  Eigen::MatrixXd N;
};

/// The way for every equation that the short one does not vouch for: balance, double from several
/// shifts, refine by Newton's method with residuals in twice the working precision, verify, and
/// where nothing passes say why.
[[nodiscard]] Expected<RiccatiSolution> solve_riccati_robustly(const RiccatiProblem& problem);

/// Which of the reasons of RiccatiError holds for a (balanced) problem without an answer.
[[nodiscard]] Error diagnose_riccati(const RiccatiProblem& problem);

/// Q + AᵀX₀A - X₀, R + BᵀX₀B, N + AᵀX₀B: the equation for X - X₀, with the same closed loop.
[[nodiscard]] RiccatiProblem shifted(const RiccatiProblem& problem, const Eigen::MatrixXd& X0);

/// Solves M Z = rhs for a symmetric, possibly indefinite M after scaling it by powers of two;
/// `rcond` receives the reciprocal condition of the scaled M, zero where it is singular.
[[nodiscard]] Eigen::MatrixXd solve_equilibrated(const Eigen::MatrixXd& M,
                                                 const Eigen::MatrixXd& rhs, double& rcond);

}  // namespace flyball::detail
