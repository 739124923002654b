// The kernel of gemm_kernel.hpp for one instruction set, with vectors of FLYBALL_GEMM_WIDTH
// doubles; included once for each.

namespace flyball::detail::FLYBALL_VARIANT {

inline constexpr int gemm_width = FLYBALL_GEMM_WIDTH;
using GemmVector =
    double __attribute__((vector_size(8 * FLYBALL_GEMM_WIDTH), aligned(8), may_alias));
using GemmPacked = double __attribute__((vector_size(8 * FLYBALL_GEMM_WIDTH), may_alias));

/// Rows of a strip of A, and of its depth at a time: they stay in the first cache.
inline constexpr int gemm_rows = 3 * gemm_width;
inline constexpr int gemm_depth = 192;
inline constexpr int gemm_columns = 4;

/// `Vectors` times `gemm_width` rows by `Columns` columns of C, of which `rows` are there.
template <int Vectors, int Columns>
[[gnu::always_inline]] inline void gemm_tile(const double* packed, int depth, const double* B,
                                             int depth_step, int column_step, double* C, int C_step,
                                             int rows, GemmKind kind) {
  GemmVector sums[Columns][Vectors] = {};
  for (int k = 0; k < depth; ++k) {
    GemmVector a[Vectors];
#pragma GCC unroll 3
    for (int v = 0; v < Vectors; ++v) {
      a[v] = *reinterpret_cast<const GemmPacked*>(packed + gemm_width * v);
    }
#pragma GCC unroll 4
    for (int j = 0; j < Columns; ++j) {
      const double b = B[j * column_step];
#pragma GCC unroll 3
      for (int v = 0; v < Vectors; ++v) {
        sums[j][v] += a[v] * b;
      }
    }
    packed += gemm_rows;
    B += depth_step;
  }
  const auto write = [kind](auto& to, auto sum) {
    to = kind == GemmKind::assign ? sum : (kind == GemmKind::add ? to + sum : to - sum);
  };
#pragma GCC unroll 4
  for (int j = 0; j < Columns; ++j) {
#pragma GCC unroll 3
    for (int v = 0; v < Vectors; ++v) {
      double* const to = C + j * C_step + gemm_width * v;
      if (rows >= gemm_width * (v + 1)) {
        write(*reinterpret_cast<GemmVector*>(to), sums[j][v]);
      } else {
        for (int i = 0; i < rows - gemm_width * v; ++i) {
          write(to[i], static_cast<double>(sums[j][v][i]));
        }
      }
    }
  }
}

template <int Vectors>
inline void gemm_strip(const double* packed, int depth, const PanelFactor& B, double* C, int C_step,
                       int rows, int columns, GemmKind kind) {
  int j = 0;
  for (; j + gemm_columns <= columns; j += gemm_columns) {
    gemm_tile<Vectors, gemm_columns>(packed, depth, B.at + j * B.column_step, B.depth_step,
                                     B.column_step, C + j * C_step, C_step, rows, kind);
  }
  for (; j < columns; ++j) {
    gemm_tile<Vectors, 1>(packed, depth, B.at + j * B.column_step, B.depth_step, B.column_step,
                          C + j * C_step, C_step, rows, kind);
  }
}

/// A strip's entries, column after column, rows that are not there as zeros.
inline void gemm_pack(const GemmFactor& A, int rows, int depth, double* packed) {
  const double* from = A.at;
  for (int k = 0; k < depth; ++k) {
    for (int i = 0; i < rows; ++i) {
      packed[i] = from[i * A.row_step];
    }
    for (int i = rows; i < gemm_rows; ++i) {
      packed[i] = 0.0;
    }
    packed += gemm_rows;
    from += A.depth_step;
  }
}

void gemm_panels(const GemmTask& task) {
  alignas(64) double packed[gemm_rows * gemm_depth];
  for (int first = 0; first < task.depth; first += gemm_depth) {
    const int depth = task.depth - first < gemm_depth ? task.depth - first : gemm_depth;
    const GemmKind kind = first > 0 && task.kind == GemmKind::assign ? GemmKind::add : task.kind;
    const PanelFactor B{task.B.at + first * task.B.depth_step, task.B.depth_step,
                        task.B.column_step};
    for (int i = 0; i < task.rows; i += gemm_rows) {
      const int rows = task.rows - i < gemm_rows ? task.rows - i : gemm_rows;
      const int columns = task.lower && i + gemm_rows < task.columns ? i + gemm_rows : task.columns;
      gemm_pack({task.A.at + i * task.A.row_step + first * task.A.depth_step, task.A.row_step,
                 task.A.depth_step},
                rows, depth, packed);
      double* const C = task.C + i;
      if (rows > 2 * gemm_width) {
        gemm_strip<3>(packed, depth, B, C, task.C_step, rows, columns, kind);
      } else if (rows > gemm_width) {
        gemm_strip<2>(packed, depth, B, C, task.C_step, rows, columns, kind);
      } else {
        gemm_strip<1>(packed, depth, B, C, task.C_step, rows, columns, kind);
      }
    }
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
