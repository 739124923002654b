#pragma once

#include "math/verified/form_matrix.hpp"

namespace flyball::detail {

/// Whether T shows that x⁺ = M x, with any M of the family at each step anew, shrinks: ‖T M x‖ <
/// ‖T x‖ for every M and x ≠ 0. True is a proof, in floating point with every rounding accounted
/// for; false says nothing.
///
/// With Z near T⁻¹ and ‖T Z - I‖ <= δ it suffices that ‖T M Z‖ < 1 - δ. M ↦ ‖T M Z‖ is convex, so
/// that the family's vertices decide: ‖T M_v Z‖ + Σ ‖T Q_k Z‖ + ‖ |T| R |Z| ‖ with its squares Q
/// and its radius, R, to which the rounding of all products is added. A singular value is below s
/// if s² I - WᵀW has a Cholesky factor in floating point after a shift by more than its rounding.
/// Source: Rump, "Verification of positive definiteness", BIT 46 (2006); Higham, "Accuracy and
/// Stability of Numerical Algorithms", section 3.5.
[[nodiscard]] bool contracts(const MatrixFamily& family, const Eigen::MatrixXd& T);

/// Whether M, of which `family` is an enclosure, surely has an eigenvalue outside the unit circle,
/// by a symmetric P with MᵀPM - P < 0 that is not positive semidefinite (the inertia of Stein's
/// equation). False says nothing.
/// Source: Wimmer, "Inertia theorems for matrices, controllability, and linear vibrations", Linear
/// Algebra and its Applications 8 (1974).
[[nodiscard]] bool surely_unstable(const MatrixFamily& family);

}  // namespace flyball::detail
