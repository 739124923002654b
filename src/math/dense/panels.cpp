#include <utility>
#include <vector>

#include "math/dense/dense.hpp"
#include "math/dense/panel_kernel.hpp"
#include "math/dense/panels.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

PanelView view_of(const MatrixRef& M) {
  return {M.data(), static_cast<int>(M.outerStride())};
}

}  // namespace

void add_product(double sign, const MatrixRef& A, const MatrixRef& B, PanelRef C) {
  FLYBALL_RUN_KERNEL(add_panel_product, static_cast<int>(C.rows()), static_cast<int>(C.cols()),
                     static_cast<int>(A.cols()), sign, view_of(A),
                     {B.data(), 1, static_cast<int>(B.outerStride())}, C.data(),
                     static_cast<int>(C.outerStride()), false);
}

void add_product_transposed(double sign, const MatrixRef& A, const MatrixRef& B, PanelRef C,
                            bool lower) {
  FLYBALL_RUN_KERNEL(add_panel_product, static_cast<int>(C.rows()), static_cast<int>(C.cols()),
                     static_cast<int>(A.cols()), sign, view_of(A),
                     {B.data(), static_cast<int>(B.outerStride()), 1}, C.data(),
                     static_cast<int>(C.outerStride()), lower);
}

bool cholesky_in_place(PanelRef S) {
  return FLYBALL_RUN_KERNEL(factor_panel, static_cast<int>(S.rows()), S.data(),
                            static_cast<int>(S.outerStride()));
}

void divide_by_transposed_triangle(PanelRef B, const MatrixRef& L) {
  FLYBALL_RUN_KERNEL(solve_panel_transposed, static_cast<int>(B.rows()), static_cast<int>(B.cols()),
                     view_of(L), B.data(), static_cast<int>(B.outerStride()));
}

void divide_by_triangle(PanelRef B, const MatrixRef& L) {
  FLYBALL_RUN_KERNEL(solve_panel, static_cast<int>(B.rows()), static_cast<int>(B.cols()),
                     view_of(L), B.data(), static_cast<int>(B.outerStride()));
}

LeadingModes leading_modes_of(MatrixXd S, Index count) {
  const auto n = static_cast<int>(S.rows());
  LeadingModes modes{Eigen::VectorXd(n), MatrixXd(n, count)};
  std::vector<double> memory(static_cast<std::size_t>(symmetric_modes_workspace(n)));
  MatrixXd worked = S;
  if (FLYBALL_RUN_KERNEL(symmetric_modes, n, worked.data(), n, static_cast<int>(count),
                         modes.values.data(), modes.vectors.data(), memory.data())) {
    return modes;
  }
  const SymmetricEigensystem all = symmetric_eigensystem_of(S);
  return {all.values.reverse(), all.vectors.rowwise().reverse().leftCols(count)};
}

}  // namespace flyball::detail
