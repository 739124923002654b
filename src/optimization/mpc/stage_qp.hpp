#pragma once

#include <cmath>

#include "math/dense/instruction_set.hpp"

/// Quadratic programs over stages, as predictive controllers solve them each period.
namespace flyball::optimization::detail {

#include "optimization/mpc/stage_qp.inc"

// Widths of rows: 4 or a multiple of 8.

/// From the active set that stands in it. No allocation; the caps bound the work.
FLYBALL_KERNEL(QpEnd solve_stage_qp(StageQp& qp) noexcept)
/// P, L and pivots of no active bounds. @return false where a pivot is not positive.
FLYBALL_KERNEL(bool factor_stage_qp(StageQp& qp) noexcept)
/// p and g of no active bounds, after `factor_stage_qp`.
FLYBALL_KERNEL(void sweep_stage_qp(StageQp& qp) noexcept)
namespace widest {
QpEnd solve_stage_qp(StageQp& qp) noexcept;
bool factor_stage_qp(StageQp& qp) noexcept;
void sweep_stage_qp(StageQp& qp) noexcept;
}  // namespace widest

}  // namespace flyball::optimization::detail
