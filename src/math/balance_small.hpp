#pragma once

// Compiled once for each instruction set, in its own namespace (see small_matrix.hpp).

#include "math/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// No row's sum is eight times its column's or an eighth of it: less is not worth the search. Of
/// two states it is not asked.
template <int N>
[[nodiscard]] bool is_balanced(Size<N> n, const double* A, double* rows, double* columns) {
  const int height = n.padded();
  if (height < 4) {
    return false;
  }
  for (int i = 0; i < height; ++i) {
    rows[i] = 0.0;
  }
  for (int j = 0; j < n(); ++j) {
    const double* const column = A + j * height;
    Vector4 sum{};
    for (int i = 0; i < height; i += 4) {
      const Vector4& entries = load4(column + i);
      const Vector4 magnitudes = entries < 0.0 ? -entries : entries;
      sum += magnitudes;
      *reinterpret_cast<Vector4*>(rows + i) += magnitudes;
    }
    columns[j] = (sum[0] + sum[2]) + (sum[1] + sum[3]);
  }
  bool balanced = true;
  for (int i = 0; i < n(); ++i) {
    const double diagonal = std::abs(A[i + i * height]);
    const double row = rows[i] - diagonal;
    const double column = columns[i] - diagonal;
    // Where the diagonal dwarfs the others, the differences say nothing.
    balanced = balanced && row < 8.0 * column && column < 8.0 * row && row > 1e-8 * diagonal;
  }
  return balanced;
}

/// A ← D⁻¹AD with powers of two D such that rows and columns are of one size without the diagonal
/// (Osborne; Parlett and Reinsch). A state that only drives others, or is only driven, is scaled
/// until what connects it is no larger than the diagonal.
template <int N>
void balance(Size<N> size, double* A, double* d, double* rows, double* columns) {
  const int n = size();
  const int ld = size.padded();
  double diagonal = 0.0;
  for (int i = 0; i < n; ++i) {
    d[i] = 1.0;
    diagonal = std::max(diagonal, std::abs(A[i + i * ld]));
  }
  if (is_balanced(size, A, rows, columns)) {
    return;
  }
  for (int sweep = 0; sweep < 20; ++sweep) {
    bool changed = false;
    for (int i = 0; i < n; ++i) {
      double column = 0.0;
      double row = 0.0;
      for (int k = 0; k < n; ++k) {
        if (k != i) {
          column += std::abs(A[k + i * ld]);
          row += std::abs(A[i + k * ld]);
        }
      }
      if (!std::isfinite(column + row)) {
        continue;
      }
      if (column <= 0.0 || row <= 0.0) {
        if (column + row <= diagonal || !(diagonal > 0.0)) {
          continue;
        }
        const double least = std::max(diagonal * (diagonal / (column + row)), 1e-300);
        column = std::max(column, least);
        row = std::max(row, least);
      }
      // A factor of 2 cannot gain 5 % between 1/2 and 2.
      if (row < 2.0 * column && column < 2.0 * row) {
        continue;
      }
      const int exponent =
          static_cast<int>(std::lround(0.5 * (std::log2(row) - std::log2(column))));
      const double f = std::ldexp(1.0, exponent);
      if (exponent == 0 || column * f + row / f > 0.95 * (column + row)) {
        continue;
      }
      d[i] *= f;
      for (int k = 0; k < n; ++k) {
        if (k != i) {
          A[k + i * ld] *= f;
          A[i + k * ld] /= f;
        }
      }
      changed = true;
    }
    if (!changed) {
      break;
    }
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
