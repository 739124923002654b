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

}  // namespace flyball::detail
