#pragma once

#include <flyball/control/lqr.hpp>

namespace flyball {

/// The regulator of a continuous plant whose input is continuous too, u = K (r - x), which
/// minimises ∫ xᵀQx + 2 xᵀNu + uᵀRu dt. A sampled controller wants `lqr` on the discretised plant;
/// its gains approach these as the period goes to zero.
///
/// K = R⁻¹(BᵀS + Nᵀ) with S from the continuous algebraic Riccati equation (5.1).
/// @param A  n x n, continuous. @param B  n x m, continuous. @param Q  n x n, 1/(state² s).
/// @param R  m x m, 1/(input² s), positive definite. @param N  n x m; none is zero.
/// @errors ArgumentError; RiccatiError as `care`. Source: book, section 7.7 and appendix B.1.
[[nodiscard]] Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B,
                                                   const Weight& Q, const Weight& R,
                                                   const MatrixRef& N);
[[nodiscard]] Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B,
                                                   const Weight& Q, const Weight& R);
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LqrDesign<States, Inputs>> continuous_lqr(
    const ContinuousSystem<States, Inputs, Outputs>& plant, const Weight& Q, const Weight& R) {
  return continuous_lqr(plant.A, plant.B, Q, R).map([](const LqrDesign<>& design) {
    return LqrDesign<States, Inputs>{design.K, design.S, design.poles, design.residual,
                                     design.condition};
  });
}

}  // namespace flyball
