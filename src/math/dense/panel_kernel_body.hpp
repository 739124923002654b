#pragma once

// The kernels of panel_kernel.hpp for one instruction set; see instruction_set.hpp.

#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

using PanelLanes = Vector4;
inline constexpr int panel_lanes = 4;

/// The first `Count` of four numbers, the others zero.
template <int Count>
[[gnu::always_inline]] inline PanelLanes load_lanes(const double* from) {
  if constexpr (Count == panel_lanes) {
    return load<PanelLanes>(from);
  } else {
    PanelLanes lanes{};
    for (int i = 0; i < Count; ++i) {
      lanes[i] = from[i];
    }
    return lanes;
  }
}
template <int Count>
[[gnu::always_inline]] inline void store_lanes(double* to, PanelLanes lanes) {
  if constexpr (Count == panel_lanes) {
    store<PanelLanes>(to, lanes);
  } else {
    for (int i = 0; i < Count; ++i) {
      to[i] = lanes[i];
    }
  }
}

/// `Vectors` times four rows, of the last `Last`, by `Columns` columns of C.
template <int Vectors, int Last, int Columns>
[[gnu::always_inline]] inline void add_tile(int depth, double sign, const double* A, int A_step,
                                            const double* B, int depth_step, int column_step,
                                            double* C, int C_step) {
  PanelLanes sums[Columns][Vectors] = {};
  for (int k = 0; k < depth; ++k) {
    PanelLanes a[Vectors];
    for (int v = 0; v < Vectors; ++v) {
      a[v] = v + 1 < Vectors ? load_lanes<panel_lanes>(A + panel_lanes * v)
                             : load_lanes<Last>(A + panel_lanes * v);
    }
    for (int j = 0; j < Columns; ++j) {
      const double b = B[j * column_step];
      for (int v = 0; v < Vectors; ++v) {
        sums[j][v] += a[v] * b;
      }
    }
    A += A_step;
    B += depth_step;
  }
  for (int j = 0; j < Columns; ++j) {
    for (int v = 0; v < Vectors; ++v) {
      double* to = C + j * C_step + panel_lanes * v;
      if (v + 1 < Vectors) {
        store_lanes<panel_lanes>(to, load_lanes<panel_lanes>(to) + sign * sums[j][v]);
      } else {
        store_lanes<Last>(to, load_lanes<Last>(to) + sign * sums[j][v]);
      }
    }
  }
}

template <int Columns>
[[gnu::always_inline]] inline void add_columns(int rows, int depth, double sign, PanelView A,
                                               const double* B, int depth_step, int column_step,
                                               double* C, int C_step, int first) {
  int i = first;
  const auto tile = [&]<int Vectors, int Last>() {
    add_tile<Vectors, Last, Columns>(depth, sign, A.at + i, A.step, B, depth_step, column_step,
                                     C + i, C_step);
    i += panel_lanes * (Vectors - 1) + Last;
  };
  while (rows - i >= 12) {
    tile.template operator()<3, 4>();
  }
  switch (rows - i) {
    case 11:
      return tile.template operator()<3, 3>();
    case 10:
      return tile.template operator()<3, 2>();
    case 9:
      return tile.template operator()<3, 1>();
    case 8:
      return tile.template operator()<2, 4>();
    case 7:
      return tile.template operator()<2, 3>();
    case 6:
      return tile.template operator()<2, 2>();
    case 5:
      return tile.template operator()<2, 1>();
    case 4:
      return tile.template operator()<1, 4>();
    case 3:
      return tile.template operator()<1, 3>();
    case 2:
      return tile.template operator()<1, 2>();
    case 1:
      return tile.template operator()<1, 1>();
    default:
      return;
  }
}

void add_panel_product(int rows, int columns, int depth, double sign, PanelView A, PanelFactor B,
                       double* C, int C_step, bool lower) {
  int j = 0;
  const auto take = [&]<int Columns>() {
    add_columns<Columns>(rows, depth, sign, A, B.at + j * B.column_step, B.depth_step,
                         B.column_step, C + j * C_step, C_step, lower ? j - j % panel_lanes : 0);
    j += Columns;
  };
  while (columns - j >= 4) {
    take.template operator()<4>();
  }
  switch (columns - j) {
    case 3:
      return take.template operator()<3>();
    case 2:
      return take.template operator()<2>();
    case 1:
      return take.template operator()<1>();
    default:
      return;
  }
}

inline constexpr int panel_width = 8;

bool factor_panel(int n, double* S, int step) {
  for (int first = 0; first < n; first += panel_width) {
    const int width = n - first < panel_width ? n - first : panel_width;
    double* panel = S + first * step;
    add_panel_product(n - first, width, first, -1.0, {S + first, step}, {S + first, step, 1},
                      panel + first, step, true);
    for (int j = 0; j < width; ++j) {
      double* column = panel + j * step;
      const int pivot = first + j;
      if (!(column[pivot] > 0.0)) {
        return false;
      }
      const double root = __builtin_sqrt(column[pivot]);
      const double reciprocal = 1.0 / root;
      column[pivot] = root;
      for (int i = pivot + 1; i < n; ++i) {
        column[i] *= reciprocal;
      }
      for (int next = j + 1; next < width; ++next) {
        double* to = panel + next * step;
        const double factor = column[first + next];
        for (int i = first + next; i < n; ++i) {
          to[i] -= factor * column[i];
        }
      }
    }
  }
  return true;
}

void solve_panel_transposed(int rows, int n, PanelView L, double* B, int step) {
  for (int first = 0; first < n; first += panel_width) {
    const int width = n - first < panel_width ? n - first : panel_width;
    double* panel = B + first * step;
    add_panel_product(rows, width, first, -1.0, {B, step}, {L.at + first, L.step, 1}, panel, step,
                      false);
    for (int j = 0; j < width; ++j) {
      double* column = panel + j * step;
      const double* below = L.at + (first + j) * L.step + first;
      const double reciprocal = 1.0 / below[j];
      for (int i = 0; i < rows; ++i) {
        column[i] *= reciprocal;
      }
      for (int next = j + 1; next < width; ++next) {
        double* to = panel + next * step;
        const double factor = below[next];
        for (int i = 0; i < rows; ++i) {
          to[i] -= factor * column[i];
        }
      }
    }
  }
}

void solve_panel(int rows, int n, PanelView L, double* B, int step) {
  for (int end = n; end > 0;) {
    const int width = end < panel_width ? end : panel_width;
    const int first = end - width;
    double* panel = B + first * step;
    add_panel_product(rows, width, n - end, -1.0, {B + end * step, step},
                      {L.at + end + first * L.step, 1, L.step}, panel, step, false);
    for (int j = width - 1; j >= 0; --j) {
      double* column = panel + j * step;
      const double reciprocal = 1.0 / L.at[first + j + (first + j) * L.step];
      for (int i = 0; i < rows; ++i) {
        column[i] *= reciprocal;
      }
      for (int next = 0; next < j; ++next) {
        double* to = panel + next * step;
        const double factor = L.at[first + j + (first + next) * L.step];
        for (int i = 0; i < rows; ++i) {
          to[i] -= factor * column[i];
        }
      }
    }
    end = first;
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
