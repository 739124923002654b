#pragma once

#include <flyball/control/robust/structured_singular_value.hpp>

namespace flyball::detail {

/// A block and where it stands: it drives inputs from `in` on and sees outputs from `out` on.
struct BlockSpan {
  UncertaintyKind kind = UncertaintyKind::complex;
  Eigen::Index in = 0;
  Eigen::Index rows = 1;
  Eigen::Index out = 0;
  Eigen::Index columns = 1;

  [[nodiscard]] bool is_full() const noexcept { return kind == UncertaintyKind::full; }
  [[nodiscard]] bool is_real() const noexcept { return kind == UncertaintyKind::real; }
};

/// Δ's structure against M, p x m. A full block of one row and column is a complex number.
struct UncertaintyStructure {
  std::vector<BlockSpan> blocks;
  Eigen::Index inputs = 0;
  Eigen::Index outputs = 0;

  [[nodiscard]] bool has_real() const;
};

/// @errors ArgumentError for blocks that do not fit p x m.
[[nodiscard]] Expected<UncertaintyStructure> structure_of(
    const std::vector<UncertaintyBlock>& blocks, Eigen::Index outputs, Eigen::Index inputs,
    std::string_view where);

/// diag(2^out) M diag(2^-in), as exact as its entries stay normal: powers of two with which
/// Δ commutes, under which rows and columns are of like size, and 2^-size so that the largest entry
/// is about one.
struct BalancedMatrix {
  Eigen::MatrixXcd M;
  Eigen::VectorXi in, out;
  int size = 0;
};
[[nodiscard]] BalancedMatrix balanced(const Eigen::MatrixXcd& M,
                                      const UncertaintyStructure& structure);
/// The balanced matrix's Frobenius norm: near µ, and no less but for its rounding.
[[nodiscard]] double balanced_size(const Eigen::MatrixXcd& M,
                                   const UncertaintyStructure& structure);

}  // namespace flyball::detail
