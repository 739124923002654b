#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

namespace flyball::detail {

/// QᵀAQ = [A_r A_12; 0 A_u] and QᵀB = [B_r; 0] with Q orthogonal and (A_r, B_r) reachable in steps
/// of `stairs` states: what u moves after no, one, two, … integrations.
struct Staircase {
  Eigen::MatrixXd A;
  Eigen::MatrixXd B;
  Eigen::MatrixXd Q;
  std::vector<Eigen::Index> stairs;
  Eigen::Index rank = 0;       ///< Order of A_r.
  double smallest_step = 1.0;  ///< The smallest relative size of what was taken for reachable.
  double largest_rest = 0.0;   ///< The largest relative size of what was taken for nothing.
};

/// By singular values, which reveal ranks best. @param tolerance  Relative to ‖A‖, ‖B‖.
/// Source: Van Dooren, "The generalized eigenstructure problem in linear system theory", IEEE
/// Trans. Automatic Control 26 (1981).
[[nodiscard]] Staircase staircase_of(const MatrixRef& A, const MatrixRef& B, double tolerance);

/// What a tolerance is relative to, where A and B are parts of larger matrices.
struct PairSizes {
  double A = 0.0;
  double B = 0.0;
};
[[nodiscard]] Staircase staircase_of(const MatrixRef& A, const MatrixRef& B, double tolerance,
                                     PairSizes sizes);

/// What u moves: VᵀAV, VᵀB of an orthonormal V whose complement no input moves.
struct ReachedPart {
  Eigen::MatrixXd A;
  Eigen::MatrixXd B;
  Eigen::MatrixXd V;  ///< n x order.
};

/// The staircase's reached part, without the modes of it that their own test finds cut off: past a
/// weak step ε the staircase sees what no input moves as rounding/ε.
/// @param tolerance  What is left out would be cut off by changes of A, B of this size relative to
/// `sizes`.
[[nodiscard]] ReachedPart reached_part_of(const MatrixRef& A, const MatrixRef& B, double tolerance,
                                          PairSizes sizes);

}  // namespace flyball::detail
