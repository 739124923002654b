#pragma once

#include <cstddef>

#include "math/dense/instruction_set.hpp"

/// What an interior-point method for quadratic programs does with its bounds, over all variables.
namespace flyball::optimization::detail {

/// Arrays of one entry a variable. Where there is no bound, `low` is -1e300 or `high` 1e300, the
/// mask beside it is 0 and so is its multiplier.
struct BoundArrays {
  std::size_t count = 0;
  const double* low = nullptr;
  const double* high = nullptr;
  const double* has_low = nullptr;  ///< 0 or 1.
  const double* has_high = nullptr;
  const double* free = nullptr;    ///< 0: the variable is fixed.
  const double* hw = nullptr;      ///< H w + Aᵀ λ
  const double* g = nullptr;       ///< The cost's gradient at zero.
  const double* affine = nullptr;  ///< The predictor's step of w.
  const double* dw = nullptr;      ///< The corrected one.
  double* w = nullptr;
  double* zl = nullptr;  ///< Multipliers.
  double* zu = nullptr;
  double* sl = nullptr;  ///< Distances.
  double* su = nullptr;
  double* il = nullptr;  ///< Their reciprocals, 0 without a bound.
  double* iu = nullptr;
  double* diagonal = nullptr;
  double* rw = nullptr;
  double* rd = nullptr;  ///< What is left of the dual equations.
  double* dzl = nullptr;
  double* dzu = nullptr;
  double* low_target = nullptr;
  double* high_target = nullptr;
};

/// How well a point solves the problem, but for its equations.
struct BoundErrors {
  double dual = 0.0;         ///< The largest of rd.
  double dual_sum = 0.0;     ///< Not finite where rd is not.
  double gap = 0.0;          ///< Σ s z
  double most = 0.0;         ///< The largest of it.
  double multipliers = 0.0;  ///< Σ z
  double slope = 0.0;        ///< gᵀw
  double moment = 0.0;       ///< wᵀ(H w + Aᵀ λ)
};

/// Reciprocals of the longest steps, and of the predictor what its gap follows from:
/// (1 - d) Σ s z + (p - d) along + p d across after steps p and d.
struct BoundSteps {
  double primal = 1.0;
  double dual = 1.0;
  double along = 0.0;   ///< Σ Δw (zl - zu)
  double across = 0.0;  ///< Σ Δw (Δzl - Δzu)
};

/// Distances, from w.
FLYBALL_KERNEL(void measure_bounds(const BoundArrays& a) noexcept)
/// rd, from w, hw and the multipliers.
FLYBALL_KERNEL(BoundErrors judge_bounds(const BoundArrays& a) noexcept)
/// il, iu, the diagonal zl/sl + zu/su + least, and rw of the predictor.
FLYBALL_KERNEL(void weigh_bounds(const BoundArrays& a, double least) noexcept)
/// dzl and dzu of the predictor.
FLYBALL_KERNEL(BoundSteps predict_bounds(const BoundArrays& a) noexcept)
/// The targets and rw of the corrector, towards products of `target`.
FLYBALL_KERNEL(void aim_bounds(const BoundArrays& a, double target) noexcept)
/// dzl and dzu of the corrector, and its longest steps, the reciprocals at least `keep`.
FLYBALL_KERNEL(BoundSteps correct_bounds(const BoundArrays& a, double keep) noexcept)
/// w, multipliers and distances.
FLYBALL_KERNEL(void advance_bounds(const BoundArrays& a, double primal, double dual) noexcept)

}  // namespace flyball::optimization::detail
