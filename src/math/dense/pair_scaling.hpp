#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// Units in which a pair (A, B) of any finite entries has entries near one, as powers of two, so
/// that neither overflow nor rounding can come from them.
namespace flyball::detail {

/// x = diag(2^states) x', u = diag(2^inputs) u', y' = diag(2^outputs) y, t = 2^-time t':
/// A = 2^time D A' D⁻¹, and B' and C' have the size of A'.
struct PairScaling {
  Eigen::VectorXi states;
  Eigen::VectorXi inputs;
  int time = 0;
  Eigen::VectorXi outputs{};
};

/// The binary logarithm of the largest geometric mean of |A|'s entries along a cycle of states,
/// which no units of theirs change; -∞ without a cycle. Cost: O(n³).
/// Source: Karp, "A characterization of the minimum cycle mean in a digraph", Discrete Mathematics
/// 23 (1978).
[[nodiscard]] double cycle_mean_of(const MatrixRef& A);

/// Gives the states of each part of A, of those that drive each other, the units of A's own
/// balance, and keeps only how the parts stand to each other. Where many states stand in a row
/// between an input and an output, units in which both are large may rise by a little from each
/// state to the next, to 2^60 along thirty masses, though no row or column shows it.
void balance_parts(const MatrixRef& A, Eigen::VectorXi& states);

/// The units in which row and column of each state in [A B; C 0] are of like size, without the
/// diagonal (Osborne's iteration, on logarithms); each input's and time's own unit make the largest
/// entry of its column and of A' one, and each output's that of its row. A state that
/// acts on nothing, or on which nothing acts, takes the unit in which what it has is of the size
/// that A's cycles have in any units.
/// Cost: O(n³), and O(n (n + m)) a sweep, at most 200.
/// Source: Osborne, "On pre-conditioning of matrices", J. ACM 7 (1960).
[[nodiscard]] PairScaling pair_scaling_of(const MatrixRef& A, const MatrixRef& B);
[[nodiscard]] PairScaling pair_scaling_of(const MatrixRef& A, const MatrixRef& B,
                                          const MatrixRef& C);

/// A', B', C' of the above.
[[nodiscard]] Eigen::MatrixXd scaled_A(const MatrixRef& A, const PairScaling& scaling);
[[nodiscard]] Eigen::MatrixXd scaled_B(const MatrixRef& B, const PairScaling& scaling);
[[nodiscard]] Eigen::MatrixXd scaled_C(const MatrixRef& C, const PairScaling& scaling);

}  // namespace flyball::detail
