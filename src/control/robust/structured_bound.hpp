#pragma once

#include "control/robust/uncertainty.hpp"

namespace flyball::detail {

/// Scalings of an M whose entries are of the order of one, and the least β² of
/// β² D_in - Mᴴ D_out M - j (G M - Mᴴ Gᴴ) >= 0 with them, as floating point sees it.
struct StructuredBound {
  StructuredScaling scaling;
  double squared = 0.0;  ///< β², negative where the form is definite with none.
  double work = 0.0;     ///< What the search took, in multiplications.
};

/// The smallest bound there is; `scaling` is that of the best point of the way.
/// @param enough  Below this β² the search may end. @param accuracy  Relative, of β², where there
/// are many unknowns.
[[nodiscard]] StructuredBound least_structured_bound(const Eigen::MatrixXcd& M,
                                                     const UncertaintyStructure& structure,
                                                     double enough = -1.0, double accuracy = 1e-7);

/// β² D_in - Mᴴ D_out M - j (G M - Mᴴ Gᴴ).
[[nodiscard]] Eigen::MatrixXcd structured_form(const Eigen::MatrixXcd& M,
                                               const StructuredScaling& scaling, double squared);

/// Whether the scaling proves β, of M + E with every |E_ij| <= error too, by Cholesky factors less
/// all rounding.
[[nodiscard]] bool proves(const Eigen::MatrixXcd& M, const StructuredScaling& scaling, double beta,
                          double error);

/// A β that is proven, as little above the bound's as rounding allows; where it is proven by no
/// other, by the identity as scaling.
[[nodiscard]] double proven_bound(const Eigen::MatrixXcd& M, StructuredBound& bound, double error);

/// The largest λ with (X - λ Y) v = 0; X Hermitian, Y Hermitian and positive definite.
[[nodiscard]] double largest_ratio(const Eigen::MatrixXcd& X, const Eigen::MatrixXcd& Y);

/// L lower triangular, S = L Lᴴ, in place of S; false where S is not positive definite.
[[nodiscard]] bool factor_hermitian(Eigen::MatrixXcd& S);
/// L⁻¹ of a lower triangular L.
[[nodiscard]] Eigen::MatrixXcd inverse_of_lower(const Eigen::MatrixXcd& L);

}  // namespace flyball::detail
