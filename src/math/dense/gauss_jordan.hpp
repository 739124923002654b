#pragma once

// Compiled once for each instruction set; see small_matrix.hpp.

#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// Pivots that are eliminated together, so that the other columns are changed by a product.
constexpr int panel_columns = 8;

/// Gauss-Jordan elimination of pivots first..first + count by rows, on the panel of `count` columns
/// alone. What is done to any other column is: its rows are swapped as `pivots` says, and
/// x ← x but for its rows first.. plus the panel times these. A pivot stays where it is at least
/// `threshold` of the largest entry below it; false where one vanishes.
template <int N>
inline __attribute__((always_inline)) bool eliminate_panel(Size<N> size, double* panel, int first,
                                                           int count, double threshold,
                                                           int* pivots) {
  const int n = size();
  const int ld = size.padded();
  for (int p = 0; p < count; ++p) {
    const int k = first + p;
    double* const column = panel + p * ld;
    double largest = 0.0;
    for (int i = k; i < n; ++i) {
      largest = std::max(largest, std::abs(column[i]));
    }
    int pivot = k;
    if (!(std::abs(column[k]) >= threshold * largest)) {
      while (pivot + 1 < n && std::abs(column[pivot]) != largest) {
        ++pivot;
      }
    }
    pivots[p] = pivot;
    if (pivot != k) {
      for (int j = 0; j < count; ++j) {
        std::swap(panel[k + j * ld], panel[pivot + j * ld]);
      }
    }
    const double inverse = 1.0 / column[k];
    if (!std::isfinite(inverse)) {
      return false;
    }
    // The other rows lose column k's multiples of row k; row k itself is divided by the pivot.
    for (int i = 0; i < ld; ++i) {
      column[i] *= -inverse;
    }
    column[k] = 0.0;
    const auto eliminate = [=](int j) {
      double* other = panel + j * ld;
      const double factor = other[k];
      for (int i = 0; i < ld; i += 4) {
        at4(other + i) += load4(column + i) * factor;
      }
      other[k] = factor * inverse;
    };
    for (int j = 0; j < p; ++j) {
      eliminate(j);
    }
    for (int j = p + 1; j < count; ++j) {
      eliminate(j);
    }
    column[k] = inverse;
  }
  return true;
}

/// The same elimination of `columns` other columns.
template <int N>
inline void apply_panel(Size<N> size, const double* panel, int first, int count, const int* pivots,
                        double* others, int columns) {
  constexpr int width = 32;
  const int ld = size.padded();
  double rows[panel_columns * width];
  for (int begin = 0; begin < columns; begin += width) {
    const int these = std::min(width, columns - begin);
    double* const block = others + begin * ld;
    for (int j = 0; j < these; ++j) {
      double* const column = block + j * ld;
      for (int p = 0; p < count; ++p) {
        std::swap(column[first + p], column[pivots[p]]);
      }
      for (int p = 0; p < count; ++p) {
        rows[p + j * panel_columns] = column[first + p];
        column[first + p] = 0.0;
      }
    }
    multiply<N, Product::add>(size, block, ld, panel, ld, rows, panel_columns, count, these);
  }
}

/// M ← M⁻¹ by Gauss-Jordan elimination with row pivoting; false where a pivot vanishes. The
/// diagonal serves while it is not much smaller: few rows move, and the residual of the result is
/// checked in the end.
template <int N>
inline bool invert(Size<N> size, double* M, int* pivots) {
  const int n = size();
  const int ld = size.padded();
  if (n == 1) {
    M[0] = 1.0 / M[0];
    return std::isfinite(M[0]);
  }
  if (n == 2) {
    const double determinant = M[0] * M[3] - M[1] * M[2];
    const double inverse = 1.0 / determinant;
    const double first = M[0];
    M[0] = M[3] * inverse;
    M[3] = first * inverse;
    M[1] *= -inverse;
    M[2] *= -inverse;
    return std::isfinite(inverse);
  }
  if (N == 0 && n >= 3 * panel_columns) {
    for (int first = 0; first < n; first += panel_columns) {
      const int count = std::min(panel_columns, n - first);
      if (!eliminate_panel(size, M + first * ld, first, count, 0.25, pivots + first)) {
        return false;
      }
      const double* const panel = M + first * ld;
      apply_panel(size, panel, first, count, pivots + first, M, first);
      apply_panel(size, panel, first, count, pivots + first, M + (first + count) * ld,
                  n - first - count);
    }
  } else if (!eliminate_panel(size, M, 0, n, 0.25, pivots)) {
    return false;
  }
  for (int k = n - 1; k >= 0; --k) {
    if (pivots[k] != k) {
      double* a = M + k * ld;
      double* b = M + pivots[k] * ld;
      for (int i = 0; i < ld; ++i) {
        const double held = a[i];
        a[i] = b[i];
        b[i] = held;
      }
    }
  }
  return true;
}

/// R ← M⁻¹R for as many columns as rows, by Gauss-Jordan elimination with partial pivoting; M is
/// lost. Where a pivot vanishes false, or a result that is not finite.
template <int N>
inline bool solve_in_place(Size<N> size, double* M, double* R) {
  const int n = size();
  const int ld = size.padded();
  if (N == 0 && n >= 3 * panel_columns) {
    int pivots[panel_columns];
    for (int first = 0; first < n; first += panel_columns) {
      const int count = std::min(panel_columns, n - first);
      double* const panel = M + first * ld;
      if (!eliminate_panel(size, panel, first, count, 1.0, pivots)) {
        return false;
      }
      apply_panel(size, panel, first, count, pivots, M + (first + count) * ld, n - first - count);
      apply_panel(size, panel, first, count, pivots, R, n);
    }
    return true;
  }
  for (int k = 0; k < n; ++k) {
    double* const column = M + k * ld;
    int pivot = k;
    for (int i = k + 1; i < n; ++i) {
      pivot = std::abs(column[i]) > std::abs(column[pivot]) ? i : pivot;
    }
    if (pivot != k) {
      for (int j = k; j < n; ++j) {
        std::swap(M[k + j * ld], M[pivot + j * ld]);
      }
      for (int j = 0; j < n; ++j) {
        std::swap(R[k + j * ld], R[pivot + j * ld]);
      }
    }
    const double inverse = 1.0 / column[k];
    for (int i = 0; i < ld; ++i) {
      column[i] *= -inverse;
    }
    column[k] = 0.0;
    const auto eliminate = [=](double* other) {
      const double factor = other[k];
      for (int i = 0; i < ld; i += 4) {
        at4(other + i) += load4(column + i) * factor;
      }
      other[k] = factor * inverse;
    };
    for (int j = k + 1; j < n; ++j) {
      eliminate(M + j * ld);
    }
    for (int j = 0; j < n; ++j) {
      eliminate(R + j * ld);
    }
  }
  return true;
}

}  // namespace flyball::detail::FLYBALL_VARIANT
