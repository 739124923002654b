#pragma once

#include <cstddef>

#include "math/dense/instruction_set.hpp"

/// The KKT systems of optimal control, factorised along the stages.
namespace flyball::optimization::detail {

/// The blocks of a KKT system over stages k = 0 … N, rows of `width` doubles (a multiple of 4).
/// Stage k has z = (x, u), the last one, too; its inputs are fixed.
///
///   min Σ ½ zᵀ(H + diag)z + hᵀz   subject to   A z + b - x⁺ - D λ = 0 between stages
///   and, at a stage, rows of weight w: + ½ w (G z + e)².
struct StageSystem {
  std::size_t stages = 0;  ///< N + 1.
  std::size_t states = 0;
  std::size_t inputs = 0;
  std::size_t width = 0;
  const double* H = nullptr;               ///< stages x (states + inputs) rows; null: zero.
  const double* diagonal = nullptr;        ///< stages x (states + inputs).
  const double* AB = nullptr;              ///< N x states rows.
  const double* G = nullptr;               ///< A row for each constraint of a stage.
  const double* weight = nullptr;          ///< Of those.
  const std::size_t* first_row = nullptr;  ///< Where a stage's rows begin; stages + 1.
  const unsigned char* fixed = nullptr;    ///< stages x (states + inputs).
  const double* D = nullptr;               ///< N x states.
  bool soft = false;                       ///< Whether D counts where a state is not fixed.
  double* P = nullptr;                     ///< stages x states rows: the cost to go from A z + b.
  double* E = nullptr;                     ///< stages x states rows, (I + P D)⁻¹ where soft.
  double* L = nullptr;        ///< stages x (states + inputs) rows: what is eliminated, by the rest.
  double* pivots = nullptr;   ///< stages x (states + inputs): reciprocal.
  double* scratch = nullptr;  ///< (states + inputs) · (3 width) doubles.
};

/// The right-hand side and the solution.
struct StageVectors {
  const double* h = nullptr;  ///< stages x (states + inputs).
  const double* b = nullptr;  ///< N x states.
  const double* e = nullptr;  ///< For each row, already weighted: w e.
  double* dz = nullptr;       ///< stages x (states + inputs).
  double* dl = nullptr;       ///< N x states.
  double* p = nullptr;        ///< stages x states, scratch: gradient of the cost to go.
  double* g = nullptr;        ///< stages x (states + inputs), scratch.
};

/// Backward: P and the elimination of each stage. @return false at the first pivot that is not
/// positive. Cost: O(N n³).
FLYBALL_KERNEL(bool factor_stages(const StageSystem& system) noexcept)
/// Backward and forward sweep. Cost: O(N n²).
FLYBALL_KERNEL(void solve_stages(const StageSystem& system, const StageVectors& vectors) noexcept)
namespace widest {
bool factor_stages(const StageSystem& system) noexcept;
void solve_stages(const StageSystem& system, const StageVectors& vectors) noexcept;
}  // namespace widest

}  // namespace flyball::optimization::detail
