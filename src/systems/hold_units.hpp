#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

namespace flyball::detail {

/// A T = D A' D⁻¹ and B T = D B' 2^-inputs, D = diag(2^states), in units in which no entry of A' is
/// beyond one and its cycles, and each column of B' has one near one: then
/// ∫₀ᵀ e^{At} dt B = D ∫₀¹ e^{A't} dt B' 2^-inputs has no sum or product that overflows early.
struct HoldUnits {
  Eigen::MatrixXd A;
  Eigen::MatrixXd B;
  Eigen::VectorXi states;
  Eigen::VectorXi inputs;
};
[[nodiscard]] HoldUnits hold_units_of(const MatrixRef& A, const MatrixRef& B, double T);

/// Whether doubles would not do as the units of an input that is held. Cost: O(n (n + m)).
[[nodiscard]] bool needs_hold_units(const MatrixRef& A, const MatrixRef& B, double T);

}  // namespace flyball::detail
