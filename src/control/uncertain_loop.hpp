#pragma once

#include <optional>
#include <vector>

#include <flyball/control/certificate.hpp>

#include "math/verified/form_matrix.hpp"

namespace flyball::detail {

/// Which structure the loop has where its delay lies: each period of it is a state.
struct DelayBranch {
  int whole_periods = 0;
  bool exact = false;  ///< No fraction: one input less is stored.

  [[nodiscard]] Eigen::Index stored() const noexcept { return whole_periods + (exact ? 0 : 1); }
};

/// A piece of the set in its coordinates.
struct SetPiece {
  Eigen::VectorXd middle, half;
};

/// [p; gain; delay] over a piece.
[[nodiscard]] std::vector<TaylorForm> parameters_over(const ParameterSet& set,
                                                      const SetPiece& piece);

/// The structures that occur over a piece, of delays that are not negative; none where all are.
/// Nothing where rounding leaves open more of them than a loop may have, as beside a period of next
/// to nothing.
[[nodiscard]] std::optional<std::vector<DelayBranch>> branches_over(const TaylorForm& delay,
                                                                    double period);

/// The closed loop over a piece with the structure of a branch: [x; stored; controller], and where
/// `disk` is positive one more row and column, the channel w -> z that a factor
/// (1 + δα/2)/(1 - δα/2) on the plant's input closes by w = δ z. Nothing where the forms are not
/// finite.
/// @param decay  M/decay in place of M.
[[nodiscard]] std::optional<FormMatrix> closed_loop_over(const UncertainLoop& loop,
                                                         const std::vector<TaylorForm>& parameters,
                                                         const DelayBranch& branch, double disk,
                                                         double decay);

/// The coordinates of a member: its parameters. @param z  Of the set.
[[nodiscard]] Eigen::VectorXd parameters_at(const ParameterSet& set, const Eigen::VectorXd& z);

/// Of all eigenvalues of so many states, floating-point operations.
[[nodiscard]] constexpr double eigenvalue_work(double states) {
  return 25.0 * states * states * states;
}

/// 2/‖S - T‖∞ of a stable closed loop with the channel of α = 2: M = [A B; C 1].
/// @param poles  The eigenvalues of A. Cost: `disk_margin_work(A.rows())`.
[[nodiscard]] double disk_margin_of(const Eigen::MatrixXd& M, const Eigen::VectorXcd& poles);
/// What that takes, in floating-point operations: the Hessenberg form, and about 100 + n responses.
[[nodiscard]] constexpr double disk_margin_work(double states) {
  return (10.0 * states + 12.0 * (100.0 + states)) * states * states;
}

}  // namespace flyball::detail
