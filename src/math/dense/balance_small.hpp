#pragma once

// Compiled once for each instruction set, in its own namespace (see small_matrix.hpp).

#include "math/dense/balance_columns.hpp"
#include "math/dense/small_matrix.hpp"

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
      const Vector4 entries = load4(column + i);
      const Vector4 magnitudes = entries < 0.0 ? -entries : entries;
      sum += magnitudes;
      at4(rows + i) += magnitudes;
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

/// A ← D⁻¹AD where it is worth it.
template <int N>
void balance(Size<N> size, double* A, double* d, double* rows, double* columns) {
  const int n = size();
  const int ld = size.padded();
  for (int i = 0; i < n; ++i) {
    d[i] = 1.0;
  }
  if (!is_balanced(size, A, rows, columns)) {
    balance_columns(n, A, ld, d);
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
