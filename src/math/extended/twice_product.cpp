#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "math/extended/twice_product.hpp"

// Compiled with -ffp-contract=off: a fused product would no longer be what the next line corrects.
//
// The sum of the products a b is kept as S + hi, S a power of two, times 1.5, so large that S + hi
// stays between S/1.5 and 2S/1.5: there numbers are multiples of one unit, and what
//   t' = fl(t + a b) gains on t, q = t' - t, and what it lost, e = a b - q,
// are exact (Rump, Ogita, Oishi, "Accurate floating-point summation part I", SIAM J. Scientific
// Computing 31 (2008), Algorithm 3.2). The e's are summed beside: four operations a term, of which
// a sum of two doubles takes ten.

namespace flyball::detail {

namespace {

constexpr int strip_depth = 128;
constexpr int most_columns = 256;

/// Vectors of a width, in memory that is aligned as doubles are.
template <int Width>
struct Lanes;
#define FLYBALL_LANES(WIDTH)                                                              \
  template <>                                                                             \
  struct Lanes<WIDTH> {                                                                   \
    using Vector = double __attribute__((vector_size(8 * WIDTH), aligned(8), may_alias)); \
    using Bits = std::int64_t __attribute__((vector_size(8 * WIDTH)));                    \
    static inline __attribute__((always_inline)) Vector load(const double* from) {        \
      return *reinterpret_cast<const Vector*>(from);                                      \
    }                                                                                     \
    static inline __attribute__((always_inline)) void store(double* to, Vector value) {   \
      *reinterpret_cast<Vector*>(to) = value;                                             \
    }                                                                                     \
  };
FLYBALL_LANES(2)
FLYBALL_LANES(4)
FLYBALL_LANES(8)
#undef FLYBALL_LANES

template <int Width, class Vector>
inline __attribute__((always_inline)) Vector fused(Vector a, double b, Vector c) {
  Vector sum;
#pragma GCC unroll 8
  for (int l = 0; l < Width; ++l) {
    sum[l] = __builtin_fma(a[l], b, c[l]);
  }
  return sum;
}

/// 1.5 times a power of two that is at least eight times the bound.
template <int Width, class Vector>
inline __attribute__((always_inline)) Vector offset(Vector bound) {
  using Bits = typename Lanes<Width>::Bits;
  const Bits exponent = __builtin_bit_cast(Bits, bound) & 0x7FF0000000000000;
  return __builtin_bit_cast(Vector, exponent) * 12.0;
}

template <int Width, int Vectors, int Columns, bool Low>
inline __attribute__((always_inline)) void tile(const double* packed, int packed_step, int depth,
                                                const double* row_bounds,
                                                const double* column_bounds, const double* B,
                                                const double* B_low, int depth_step,
                                                int column_step, double* hi, double* lo, int step,
                                                int rows) {
  using L = Lanes<Width>;
  using Vector = typename L::Vector;
  Vector offsets[Columns][Vectors];
  Vector sums[Columns][Vectors];
  Vector rests[Columns][Vectors];
  double at[Width];
  const auto read = [&](const double* from, int v) {
    const int there = rows - Width * v;
    if (there >= Width) {
      return L::load(from + Width * v);
    }
    for (int l = 0; l < Width; ++l) {
      at[l] = l < there ? from[Width * v + l] : 0.0;
    }
    return L::load(at);
  };
#pragma GCC unroll 4
  for (int j = 0; j < Columns; ++j) {
#pragma GCC unroll 2
    for (int v = 0; v < Vectors; ++v) {
      const Vector before = read(hi + j * step, v);
      const Vector size = before < 0.0 ? -before : before;
      offsets[j][v] = offset<Width>(size + L::load(row_bounds + Width * v) * column_bounds[j]);
      sums[j][v] = offsets[j][v] + before;
      rests[j][v] = read(lo + j * step, v) + (before - (sums[j][v] - offsets[j][v]));
    }
  }
  for (int k = 0; k < depth; ++k) {
    Vector a[Vectors];
#pragma GCC unroll 2
    for (int v = 0; v < Vectors; ++v) {
      a[v] = L::load(packed + Width * v);
    }
#pragma GCC unroll 4
    for (int j = 0; j < Columns; ++j) {
      const double b = B[j * column_step];
#pragma GCC unroll 2
      for (int v = 0; v < Vectors; ++v) {
        const Vector next = fused<Width>(a[v], b, sums[j][v]);
        const Vector gained = next - sums[j][v];
        rests[j][v] += fused<Width>(a[v], b, -gained);
        sums[j][v] = next;
        if constexpr (Low) {
          rests[j][v] = fused<Width>(a[v], B_low[j * column_step], rests[j][v]);
        }
      }
    }
    packed += packed_step;
    B += depth_step;
    if constexpr (Low) {
      B_low += depth_step;
    }
  }
#pragma GCC unroll 4
  for (int j = 0; j < Columns; ++j) {
#pragma GCC unroll 2
    for (int v = 0; v < Vectors; ++v) {
      const Vector sum = sums[j][v] - offsets[j][v];
      const Vector whole = sum + rests[j][v];
      const Vector rest = rests[j][v] - (whole - sum);
      double* const to = hi + j * step + Width * v;
      double* const rest_to = lo + j * step + Width * v;
      const int there = rows - Width * v;
      if (there >= Width) {
        L::store(to, whole);
        L::store(rest_to, rest);
      } else {
        L::store(at, whole);
        std::copy_n(at, there, to);
        L::store(at, rest);
        std::copy_n(at, there, rest_to);
      }
    }
  }
}

template <int Width, int Vectors, int Columns, bool Low>
inline __attribute__((always_inline)) void product(const TwiceTask& task) {
  constexpr int height = Width * Vectors;
  alignas(64) double packed[height * strip_depth];
  alignas(64) double row_bounds[height];
  double column_bounds[most_columns];
  for (int first_column = 0; first_column < task.columns; first_column += most_columns) {
    const int columns =
        task.columns - first_column < most_columns ? task.columns - first_column : most_columns;
    const double* const B = task.B.at + first_column * task.B.column_step;
    for (int j = 0; j < columns; ++j) {
      double squares = 0.0;
      for (int k = 0; k < task.depth; ++k) {
        const double b = B[k * task.B.depth_step + j * task.B.column_step];
        squares += b * b;
      }
      column_bounds[j] = std::sqrt(squares);
    }
    for (int i = 0; i < task.rows; i += height) {
      const int rows = task.rows - i < height ? task.rows - i : height;
      int last = columns;
      if (task.lower && i + height < first_column + columns) {
        last = i + height - first_column;
      }
      if (last <= 0) {
        continue;
      }
      const double* const A = task.A.at + i * task.A.row_step;
      for (int r = 0; r < height; ++r) {
        row_bounds[r] = 0.0;
      }
      for (int k = 0; k < task.depth; ++k) {
        for (int r = 0; r < rows; ++r) {
          const double a = A[r * task.A.row_step + k * task.A.depth_step];
          row_bounds[r] += a * a;
        }
      }
      for (int r = 0; r < rows; ++r) {
        row_bounds[r] = std::sqrt(row_bounds[r]);
      }
      for (int first = 0; first < task.depth; first += strip_depth) {
        const int depth = task.depth - first < strip_depth ? task.depth - first : strip_depth;
        for (int k = 0; k < depth; ++k) {
          const double* const from = A + (first + k) * task.A.depth_step;
          for (int r = 0; r < height; ++r) {
            packed[r + k * height] = r < rows ? task.sign * from[r * task.A.row_step] : 0.0;
          }
        }
        const auto run = [&]<int These>(int j) {
          const std::ptrdiff_t at = first * task.B.depth_step + j * task.B.column_step;
          const std::ptrdiff_t to = i + static_cast<std::ptrdiff_t>(first_column + j) * task.step;
          const double* const low =
              Low ? task.B_low + first_column * task.B.column_step + at : nullptr;
          tile<Width, Vectors, These, Low>(packed, height, depth, row_bounds, column_bounds + j,
                                           B + at, low, task.B.depth_step, task.B.column_step,
                                           task.hi + to, task.lo + to, task.step, rows);
        };
        int j = 0;
        for (; j + Columns <= last; j += Columns) {
          run.template operator()<Columns>(j);
        }
        for (; j < last; ++j) {
          run.template operator()<1>(j);
        }
      }
    }
  }
}

template <int Width, int Vectors, int Columns>
inline __attribute__((always_inline)) void either(const TwiceTask& task) {
  if (task.B_low != nullptr) {
    product<Width, Vectors, Columns, true>(task);
  } else {
    product<Width, Vectors, Columns, false>(task);
  }
}

void product_baseline(const TwiceTask& task) {
  either<2, 1, 2>(task);
}

#ifdef FLYBALL_WIDE_VECTORS
__attribute__((target("avx2,fma"))) void product_wide(const TwiceTask& task) {
  either<4, 2, 2>(task);
}
__attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma"))) void product_widest(
    const TwiceTask& task) {
  either<8, 2, 4>(task);
}
#endif

}  // namespace

void add_product_twice(const TwiceTask& task) {
#ifdef FLYBALL_WIDE_VECTORS
  (has_widest_vectors() ? product_widest
                        : (has_wide_vectors() ? product_wide : product_baseline))(task);
#else
  product_baseline(task);
#endif
}

}  // namespace flyball::detail
