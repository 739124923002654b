#include <algorithm>

#include "math/equations/sylvester_kernel.hpp"
#include "math/extended/twice_product.hpp"

// Compiled with -ffp-contract=off: a fused product would no longer be what the next line corrects.

namespace flyball::detail {

namespace {

constexpr int width = 4;
using Vector = double __attribute__((vector_size(32), aligned(8), may_alias));

/// Of memory that is aligned as doubles are.
inline __attribute__((always_inline)) Vector load(const double* from) {
  Vector value;
  __builtin_memcpy(&value, from, sizeof(Vector));
  return value;
}

/// `width` rows of unevaluated sums.
struct Sums {
  Vector hi;
  Vector lo;
};

/// s += a b.
inline __attribute__((always_inline)) void add_product(Sums& s, const double* rows, double b) {
  const Vector a = load(rows);
  const Vector p = a * b;
  const Vector e = {__builtin_fma(a[0], b, -p[0]), __builtin_fma(a[1], b, -p[1]),
                    __builtin_fma(a[2], b, -p[2]), __builtin_fma(a[3], b, -p[3])};
  const Vector sum = s.hi + p;
  const Vector part = sum - s.hi;
  s.lo += ((s.hi - (sum - part)) + (p - part)) + e;
  s.hi = sum;
}

/// s += M b, M of `count` columns.
inline __attribute__((always_inline)) void add_columns(Sums& s, const double* M, int ld,
                                                       const double* b, int count, double sign) {
  for (int k = 0; k < count; ++k) {
    add_product(s, M + k * ld, sign * b[k]);
  }
}

inline __attribute__((always_inline)) void residual(const SylvesterData& data, const double* X,
                                                    double* R, double* work) {
  const int n = data.rows;
  const int m = data.columns;
  const int ld = padded_rows(n);
  const int ldb = padded_rows(m);
  double* const low = work + ld * m;
  if (!data.continuous) {
    for (int j = 0; j < m; ++j) {
      for (int i = 0; i < ld; i += width) {
        Sums s{Vector{}, Vector{}};
        add_columns(s, X + i, ld, data.B + j * ldb, m, 1.0);
        for (int l = 0; l < width; ++l) {
          const double sum = s.hi[l] + s.lo[l];
          low[i + l + j * ld] = s.lo[l] - (sum - s.hi[l]);
          work[i + l + j * ld] = sum;
        }
      }
    }
  }
  for (int j = 0; j < m; ++j) {
    for (int i = data.symmetric ? j / width * width : 0; i < ld; i += width) {
      Sums s{load(data.F + i + j * ld), Vector{}};
      if (data.continuous) {
        add_columns(s, data.A + i, ld, X + j * ld, n, -1.0);
        add_columns(s, X + i, ld, data.B + j * ldb, m, -1.0);
      } else {
        add_product(s, X + i + j * ld, 1.0);
        add_columns(s, data.A + i, ld, work + j * ld, n, -1.0);
        for (int k = 0; k < n; ++k) {
          for (int l = 0; l < width; ++l) {
            s.lo[l] -= data.A[i + l + k * ld] * low[k + j * ld];
          }
        }
      }
      for (int l = 0; l < width; ++l) {
        R[i + l + j * ld] = s.hi[l] + s.lo[l];
      }
    }
  }
}

/// hi + lo += value.
inline void add(double value, double& hi, double& lo) {
  const double sum = hi + value;
  const double part = sum - hi;
  lo += (hi - (sum - part)) + (value - part);
  hi = sum;
}

/// The same residual by products of whole matrices.
void residual_by_products(const SylvesterData& data, const double* X, double* R, double* work) {
  const int n = data.rows;
  const int m = data.columns;
  const int ld = padded_rows(n);
  const int ldb = padded_rows(m);
  const int size = ld * m;
  double* const low = work + size;
  std::fill_n(work, 2 * size, 0.0);
  if (data.continuous && data.symmetric) {
    // X B is (A X)ᵀ.
    add_product_twice({ld, m, n, -1.0, {data.A, 1, ld}, {X, 1, ld}, nullptr, work, low, ld, false});
    for (int j = 0; j < m; ++j) {
      for (int i = j / width * width; i < ld; ++i) {
        double hi = data.F[i + j * ld];
        double lo = low[i + j * ld];
        add(work[i + j * ld], hi, lo);
        if (i < n) {
          add(work[j + i * ld], hi, lo);
          lo += low[j + i * ld];
        }
        R[i + j * ld] = hi + lo;
      }
    }
    return;
  }
  std::copy_n(data.F, size, R);
  if (data.continuous) {
    add_product_twice({ld, m, n, -1.0, {data.A, 1, ld}, {X, 1, ld}, nullptr, R, low, ld, false});
    add_product_twice({ld, m, m, -1.0, {X, 1, ld}, {data.B, 1, ldb}, nullptr, R, low, ld, false});
    for (int k = 0; k < size; ++k) {
      R[k] += low[k];
    }
    return;
  }
  add_product_twice({ld, m, m, 1.0, {X, 1, ld}, {data.B, 1, ldb}, nullptr, work, low, ld, false});
  double* const rest = low + size;
  std::fill_n(rest, size, 0.0);
  for (int k = 0; k < size; ++k) {
    add(X[k], R[k], rest[k]);
  }
  add_product_twice(
      {ld, m, n, -1.0, {data.A, 1, ld}, {work, 1, ld}, low, R, rest, ld, data.symmetric});
  for (int k = 0; k < size; ++k) {
    R[k] += rest[k];
  }
}

/// The upper triangle of an R that is symmetric is its lower one.
void mirror(int n, double* R) {
  const int ld = padded_rows(n);
  for (int j = 1; j < n; ++j) {
    for (int i = 0; i < j; ++i) {
      R[i + j * ld] = R[j + i * ld];
    }
  }
}

void residual_baseline(const SylvesterData& data, const double* X, double* R, double* work) {
  residual(data, X, R, work);
}

#ifdef FLYBALL_WIDE_VECTORS
__attribute__((target("avx2,fma"))) void residual_wide(const SylvesterData& data, const double* X,
                                                       double* R, double* work) {
  residual(data, X, R, work);
}
#endif

}  // namespace

void sylvester_residual(const SylvesterData& padded, const double* X, double* R, double* work) {
  if (is_worth_twice(padded.rows, padded.columns, padded.rows)) {
    residual_by_products(padded, X, R, work);
    if (padded.symmetric) {
      mirror(padded.rows, R);
    }
    return;
  }
#ifdef FLYBALL_WIDE_VECTORS
  (has_wide_vectors() ? residual_wide : residual_baseline)(padded, X, R, work);
#else
  residual_baseline(padded, X, R, work);
#endif
  if (padded.symmetric) {
    mirror(padded.rows, R);
  }
}

}  // namespace flyball::detail
