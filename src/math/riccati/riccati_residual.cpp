#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <new>

#include "math/extended/twice_product.hpp"
#include "math/riccati/riccati_kernel.hpp"

// Compiled with -ffp-contract=off: a fused product would no longer be what the next line corrects.

namespace flyball::detail {

namespace {

/// An unevaluated sum of two doubles.
struct Sum {
  double hi = 0.0;
  double lo = 0.0;
};

inline __attribute__((always_inline)) void add(Sum& s, double value) {
  const double sum = s.hi + value;
  const double part = sum - s.hi;
  s.lo += (s.hi - (sum - part)) + (value - part);
  s.hi = sum;
}

/// s += a b.
inline __attribute__((always_inline)) void add_product(Sum& s, double a, const Sum& b) {
  const double p = a * b.hi;
  s.lo += __builtin_fma(a, b.hi, -p) + a * b.lo;
  add(s, p);
}

inline __attribute__((always_inline)) void normalize(Sum& s) {
  const double sum = s.hi + s.lo;
  s.lo -= sum - s.hi;
  s.hi = sum;
}

/// `S` of (n+m)² and `T` of (n+m) n sums.
inline __attribute__((always_inline)) void residual(const RiccatiData& data, const double* X,
                                                    const double* K, double* F, Sum* S, Sum* T) {
  const int n = data.states;
  const int m = data.inputs;
  const int size = n + m;
  const auto AB = [&](int i, int j) { return j < n ? data.A[i + j * n] : data.B[i + (j - n) * n]; };
  // T = X[A B].
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < n; ++i) {
      Sum sum;
      for (int k = 0; k < n; ++k) {
        add_product(sum, X[i + k * n], {AB(k, j), 0.0});
      }
      normalize(sum);
      T[i + j * n] = sum;
    }
  }
  // S, its lower triangle.
  for (int j = 0; j < size; ++j) {
    for (int i = j; i < size; ++i) {
      Sum sum;
      if (i < n) {
        sum.hi = 0.5 * (data.Q[i + j * n] + data.Q[j + i * n]);
      } else if (j < n) {
        sum.hi = data.N == nullptr ? 0.0 : data.N[j + (i - n) * n];
      } else {
        sum.hi = 0.5 * (data.R[(i - n) + (j - n) * m] + data.R[(j - n) + (i - n) * m]);
      }
      if (!data.continuous) {
        for (int k = 0; k < n; ++k) {
          add_product(sum, AB(k, i), T[k + j * n]);
        }
      } else if (i < n) {
        add_product(sum, 1.0, T[i + j * n]);
        add_product(sum, 1.0, T[j + i * n]);
      } else if (j < n) {
        add_product(sum, 1.0, T[j + i * n]);
      }
      normalize(sum);
      S[i + j * size] = S[j + i * size] = sum;
    }
  }
  // T ← S Z, Z = [I; -K].
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < size; ++i) {
      Sum sum = S[i + j * size];
      for (int k = 0; k < m; ++k) {
        add_product(sum, -K[k + j * m], S[i + (n + k) * size]);
      }
      normalize(sum);
      T[i + j * size] = sum;
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      Sum sum = T[i + j * size];
      if (!data.continuous) {
        add(sum, -X[i + j * n]);
      }
      for (int k = 0; k < m; ++k) {
        add_product(sum, -K[k + i * m], T[(n + k) + j * size]);
      }
      F[i + j * n] = sum.hi + sum.lo;
    }
  }
}

void residual_baseline(const RiccatiData& data, const double* X, const double* K, double* F, Sum* S,
                       Sum* T) {
  residual(data, X, K, F, S, T);
}

#ifdef FLYBALL_WIDE_VECTORS
__attribute__((target("avx2,fma"))) void residual_wide(const RiccatiData& data, const double* X,
                                                       const double* K, double* F, Sum* S, Sum* T) {
  residual(data, X, K, F, S, T);
}
#endif

/// The same by products of whole matrices; false where there is no memory for them.
bool residual_by_products(const RiccatiData& data, const double* X, const double* K, double* F) {
  const int n = data.states;
  const int m = data.inputs;
  const int size = n + m;
  const auto area = [](int rows, int columns) {
    return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
  };
  const std::size_t T_size = area(size, size);
  const std::unique_ptr<double[]> memory(
      new (std::nothrow) double[4 * T_size + area(n, size) + 2 * area(n, n) + area(m + 1, n)]());
  if (memory == nullptr) {
    return false;
  }
  double* const S = memory.get();
  double* const S_low = S + T_size;
  double* const T = S_low + T_size;
  double* const T_low = T + T_size;
  double* const AB = T_low + T_size;
  double* const F_low = AB + area(n, size);
  double* const Y = F_low + area(n, n);
  double* const L = Y + area(n, n);
  double* const d = L + area(m, n);
  // In states measured by powers of two near √X_ii, so that rows and columns are of one size.
  for (int i = 0; i < n; ++i) {
    const double x = X[i + i * n];
    d[i] = x > 0.0 && std::isfinite(x) ? std::ldexp(1.0, std::ilogb(x) / 2) : 1.0;
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      AB[i + j * n] = data.A[i + j * n] * d[i] / d[j];
      Y[i + j * n] = X[i + j * n] / d[i] / d[j];
    }
    for (int i = 0; i < m; ++i) {
      L[i + j * m] = K[i + j * m] / d[j];
    }
  }
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < n; ++i) {
      AB[i + (n + j) * n] = data.B[i + j * n] * d[i];
    }
  }
  // T = X[A B].
  add_product_twice({n, size, n, 1.0, {Y, 1, n}, {AB, 1, n}, nullptr, T, T_low, n, false});
  // S, its lower triangle.
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) {
      S[i + j * size] = 0.5 * (data.Q[i + j * n] + data.Q[j + i * n]) / d[i] / d[j];
    }
    for (int i = 0; data.N != nullptr && i < m; ++i) {
      S[n + i + j * size] = data.N[j + i * n] / d[j];
    }
  }
  for (int j = 0; j < m; ++j) {
    for (int i = j; i < m; ++i) {
      S[n + i + (n + j) * size] = 0.5 * (data.R[i + j * m] + data.R[j + i * m]);
    }
  }
  if (data.continuous) {
    for (int j = 0; j < n; ++j) {
      for (int i = j; i < size; ++i) {
        Sum sum{S[i + j * size], 0.0};
        if (i < n) {
          add(sum, T[i + j * n]);
          sum.lo += T_low[i + j * n];
        }
        add(sum, T[j + i * n]);
        sum.lo += T_low[j + i * n];
        S[i + j * size] = sum.hi;
        S_low[i + j * size] = sum.lo;
      }
    }
  } else {
    add_product_twice({size, size, n, 1.0, {AB, n, 1}, {T, 1, n}, T_low, S, S_low, size, true});
  }
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i < j; ++i) {
      S[i + j * size] = S[j + i * size];
      S_low[i + j * size] = S_low[j + i * size];
    }
  }
  // The first columns of S become S Z, Z = [I; -K].
  add_product_twice(
      {size, n, m, -1.0, {S + n * size, 1, size}, {L, 1, m}, nullptr, S, S_low, size, false});
  std::fill_n(T, T_size, 0.0);
  std::fill_n(T_low, T_size, 0.0);
  add_product_twice(
      {size, n, m, -1.0, {S_low + n * size, 1, size}, {L, 1, m}, nullptr, T, T_low, size, false});
  for (int k = 0; k < size * n; ++k) {
    S_low[k] += T[k];
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      Sum sum{S[i + j * size], S_low[i + j * size]};
      if (!data.continuous) {
        add(sum, -Y[i + j * n]);
      }
      F[i + j * n] = sum.hi;
      F_low[i + j * n] = sum.lo;
    }
  }
  add_product_twice({n, n, m, -1.0, {L, m, 1}, {S + n, 1, size}, S_low + n, F, F_low, n, false});
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      F[i + j * n] = (F[i + j * n] + F_low[i + j * n]) * d[i] * d[j];
    }
  }
  return true;
}

}  // namespace

bool riccati_residual(const RiccatiData& data, const double* X, const double* K, double* F) {
  constexpr int on_stack = 16;
  const int size = data.states + data.inputs;
  if (size > on_stack && is_worth_twice(data.states, data.states, data.states)) {
    return residual_by_products(data, X, K, F);
  }
  Sum stack[2 * on_stack * on_stack];
  std::unique_ptr<Sum[]> heap;
  Sum* S = stack;
  if (size > on_stack) {
    heap.reset(new (std::nothrow)
                   Sum[2 * static_cast<std::size_t>(size) * static_cast<std::size_t>(size)]);
    S = heap.get();
    if (S == nullptr) {
      return false;
    }
  }
  Sum* const T = S + size * size;
#ifdef FLYBALL_WIDE_VECTORS
  (has_wide_vectors() ? residual_wide : residual_baseline)(data, X, K, F, S, T);
#else
  residual_baseline(data, X, K, F, S, T);
#endif
  return true;
}

}  // namespace flyball::detail
