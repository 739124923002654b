#include <algorithm>
#include <cmath>

#include "math/dense/balance_columns.hpp"

namespace flyball::detail {

void balance_columns(int n, double* A, int ld, double* d) {
  double diagonal = 0.0;
  for (int i = 0; i < n; ++i) {
    diagonal = std::max(diagonal, std::abs(A[i + i * ld]));
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
      const int unit = std::ilogb(d[i]);
      const int exponent =
          std::clamp(static_cast<int>(std::lround(0.5 * (std::log2(row) - std::log2(column)))),
                     -widest_unit - unit, widest_unit - unit);
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

}  // namespace flyball::detail
