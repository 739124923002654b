#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// panel_kernel.hpp for matrices: in place, for those of some ten to some hundred rows.
namespace flyball::detail {

using PanelRef = Eigen::Ref<Eigen::MatrixXd>;

/// C += sign A B, and C += sign A Bᵀ; with `lower` no more than C's lower triangle need be right.
void add_product(double sign, const MatrixRef& A, const MatrixRef& B, PanelRef C);
void add_product_transposed(double sign, const MatrixRef& A, const MatrixRef& B, PanelRef C,
                            bool lower = false);

/// The lower triangle of S becomes L with S = L Lᵀ, the rest is left; false where S is not positive
/// definite.
[[nodiscard]] bool cholesky_in_place(PanelRef S);

/// B becomes B L⁻ᵀ, or B L⁻¹, L lower triangular: what lies above its diagonal is not read.
void divide_by_transposed_triangle(PanelRef B, const MatrixRef& L);
void divide_by_triangle(PanelRef B, const MatrixRef& L);

/// The eigenvalues of a symmetric S, decreasing, and the vectors of the `count` largest.
struct LeadingModes {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] LeadingModes leading_modes_of(Eigen::MatrixXd S, Eigen::Index count);

}  // namespace flyball::detail
