#include <memory>
#include <new>

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

}  // namespace

bool riccati_residual(const RiccatiData& data, const double* X, const double* K, double* F) {
  constexpr int on_stack = 16;
  const int size = data.states + data.inputs;
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
