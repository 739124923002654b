#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

namespace flyball::detail {

/// ∫₀ᵀ e^{Fτ} W e^{Fᵀτ} dτ for a symmetric W, by doubling: a Taylor series for a step h = T/2^k
/// with ‖F‖h < 1/2, then W(2h) = W(h) + e^{Fh} W(h) e^{Fᵀh}. Every term is semidefinite where W is,
/// so nothing cancels. F is balanced first. Not finite where it or F T overflows; the errors of
/// `expm`.
[[nodiscard]] Expected<Eigen::MatrixXd> quadratic_integral(const MatrixRef& F, const MatrixRef& W,
                                                           double T);

}  // namespace flyball::detail
