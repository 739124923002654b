#pragma once

// Compiled once for each instruction set, in its own namespace (see riccati_kernel_body.hpp): dense
// kernels on raw column-major arrays whose rows are padded with zeros to a whole number of vectors.
// Free of Eigen, whose types change their layout with the vectors.

namespace flyball::detail::FLYBALL_VARIANT {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// A size that is known when compiling (N > 0) or not (N = 0).
template <int N>
struct Size {
  int runtime;
  constexpr int operator()() const { return N > 0 ? N : runtime; }
  /// Rows of storage: even below three, else a multiple of four.
  constexpr int padded() const { return (*this)() <= 2 ? 2 : (((*this)() + 3) / 4) * 4; }
};

using Vector2 = double __attribute__((vector_size(16), aligned(8), may_alias));
using Vector4 = double __attribute__((vector_size(32), aligned(8), may_alias));

/// A vector in memory that is aligned as doubles are, no more; it may be part of any array.
template <class Vector>
struct __attribute__((packed, may_alias)) InMemory {
  Vector value;
};

/// A memcpy of 32 bytes becomes two stores of 16 and a load of both, for which the processor waits;
/// a member of a packed struct is one move.
template <class Vector>
inline __attribute__((always_inline)) Vector load(const double* from) {
  return reinterpret_cast<const InMemory<Vector>*>(from)->value;
}
template <class Vector>
inline __attribute__((always_inline)) void store(double* to, Vector value) {
  reinterpret_cast<InMemory<Vector>*>(to)->value = value;
}

inline __attribute__((always_inline)) Vector4 load4(const double* from) {
  return load<Vector4>(from);
}

/// Four doubles in memory that are changed.
class FourAt {
 public:
  explicit __attribute__((always_inline)) FourAt(double* at) : at_(at) {}
  __attribute__((always_inline)) Vector4 get() const { return load<Vector4>(at_); }
  __attribute__((always_inline)) void operator=(Vector4 v) { store<Vector4>(at_, v); }
  __attribute__((always_inline)) void operator+=(Vector4 v) { store<Vector4>(at_, get() + v); }
  __attribute__((always_inline)) void operator-=(Vector4 v) { store<Vector4>(at_, get() - v); }

 private:
  double* at_;
};
inline __attribute__((always_inline)) FourAt at4(double* at) {
  return FourAt(at);
}

enum class Product { assign, add, subtract };

/// One tile of C: Blocks vectors high, Columns wide.
template <class Vector, int Blocks, int Columns, Product Kind>
inline __attribute__((always_inline)) void product_tile(double* C, std::ptrdiff_t ldc,
                                                        const double* A, std::ptrdiff_t lda,
                                                        const double* B, std::ptrdiff_t ldb,
                                                        std::ptrdiff_t depth) {
  constexpr int width = sizeof(Vector) / sizeof(double);
  Vector sum[Blocks][Columns];
#pragma GCC unroll 8
  for (int b = 0; b < Blocks; ++b) {
#pragma GCC unroll 8
    for (int j = 0; j < Columns; ++j) {
      sum[b][j] = Vector{};
    }
  }
  for (std::ptrdiff_t k = 0; k < depth; ++k) {
#pragma GCC unroll 8
    for (int b = 0; b < Blocks; ++b) {
      const Vector a = load<Vector>(A + k * lda + b * width);
#pragma GCC unroll 8
      for (int j = 0; j < Columns; ++j) {
        sum[b][j] += a * B[k + j * ldb];
      }
    }
  }
#pragma GCC unroll 8
  for (int j = 0; j < Columns; ++j) {
#pragma GCC unroll 8
    for (int b = 0; b < Blocks; ++b) {
      double* const c = C + j * ldc + b * width;
      if constexpr (Kind == Product::assign) {
        store<Vector>(c, sum[b][j]);
      } else if constexpr (Kind == Product::add) {
        store<Vector>(c, load<Vector>(c) + sum[b][j]);
      } else {
        store<Vector>(c, load<Vector>(c) - sum[b][j]);
      }
    }
  }
}

template <class Vector, int Blocks, Product Kind>
inline void product_strip(double* C, std::ptrdiff_t ldc, const double* A, std::ptrdiff_t lda,
                          const double* B, std::ptrdiff_t ldb, std::ptrdiff_t depth,
                          std::ptrdiff_t columns) {
  for (std::ptrdiff_t left = columns / 4; left > 0; --left) {
    product_tile<Vector, Blocks, 4, Kind>(C, ldc, A, lda, B, ldb, depth);
    C += 4 * ldc;
    B += 4 * ldb;
  }
  for (std::ptrdiff_t left = columns % 4; left > 0; --left) {
    product_tile<Vector, Blocks, 1, Kind>(C, ldc, A, lda, B, ldb, depth);
    C += ldc;
    B += ldb;
  }
}

/// C (padded rows x columns) = or += or -= A (padded rows x depth) B (depth x columns).
/// With `Lower`, tiles that lie wholly above the diagonal are left alone.
template <int N, Product Kind = Product::assign, bool Lower = false>
inline void multiply(Size<N> n, double* C, std::ptrdiff_t ldc, const double* A, std::ptrdiff_t lda,
                     const double* B, std::ptrdiff_t ldb, std::ptrdiff_t depth,
                     std::ptrdiff_t columns) {
  const std::ptrdiff_t rows = n.padded();
  if constexpr (N == 2) {
    if (depth == 2) {
      const Vector2 first = load<Vector2>(A);
      const Vector2 second = load<Vector2>(A + lda);
      for (std::ptrdiff_t j = 0; j < columns; ++j) {
        const Vector2 sum = first * B[j * ldb] + second * B[1 + j * ldb];
        double* const c = C + j * ldc;
        if constexpr (Kind == Product::assign) {
          store<Vector2>(c, sum);
        } else if constexpr (Kind == Product::add) {
          store<Vector2>(c, load<Vector2>(c) + sum);
        } else {
          store<Vector2>(c, load<Vector2>(c) - sum);
        }
      }
      return;
    }
  }
  if constexpr (N == 0) {
    if (is_worth_packing(rows, columns, depth)) {
      const auto step = [](std::ptrdiff_t value) { return static_cast<int>(value); };
      gemm(GemmTask{step(rows),
                    step(columns),
                    step(depth),
                    {A, 1, step(lda)},
                    {B, 1, step(ldb)},
                    C,
                    step(ldc),
                    Kind == Product::assign ? GemmKind::assign
                    : Kind == Product::add  ? GemmKind::add
                                            : GemmKind::subtract,
                    Lower});
      return;
    }
  }
  if (rows == 2) {
    product_strip<Vector2, 1, Kind>(C, ldc, A, lda, B, ldb, depth, columns);
    return;
  }
  std::ptrdiff_t i = 0;
  for (; i + 8 <= rows; i += 8) {
    const std::ptrdiff_t end = Lower && i + 8 < columns ? i + 8 : columns;
    product_strip<Vector4, 2, Kind>(C + i, ldc, A + i, lda, B, ldb, depth, end);
  }
  if (i < rows) {
    const std::ptrdiff_t end = Lower && i + 4 < columns ? i + 4 : columns;
    product_strip<Vector4, 1, Kind>(C + i, ldc, A + i, lda, B, ldb, depth, end);
  }
}

template <int N>
inline void transpose(Size<N> n, double* T, const double* A) {
  const int ld = n.padded();
  for (int j = 0; j < n(); ++j) {
    for (int i = 0; i < n(); ++i) {
      T[i + j * ld] = A[j + i * ld];
    }
  }
}

/// Copies the lower triangle over the upper one.
template <int N>
inline void mirror(Size<N> n, double* S) {
  const int ld = n.padded();
  for (int j = 1; j < n(); ++j) {
    for (int i = 0; i < j; ++i) {
      S[i + j * ld] = S[j + i * ld];
    }
  }
}

/// Sum of squares over whole columns, padding (zeros) included.
template <int N>
inline double squared_norm(Size<N> n, const double* M, int columns) {
  const int count = n.padded() * columns;
  double sum = 0.0;
  int k = 0;
  if (n.padded() > 2) {
    // Four independent sums: a single one would wait for every addition.
    Vector4 even{};
    Vector4 odd{};
    for (; k + 8 <= count; k += 8) {
      const Vector4 a = load4(M + k);
      const Vector4 b = load4(M + k + 4);
      even += a * a;
      odd += b * b;
    }
    even += odd;
    sum = (even[0] + even[2]) + (even[1] + even[3]);
  }
  for (; k < count; ++k) {
    sum += M[k] * M[k];
  }
  return sum;
}

/// Cuts one block of memory into padded matrices.
class Workspace {
 public:
  explicit Workspace(double* memory) : next_(memory) {}
  double* take(int count) {
    double* const taken = next_;
    next_ += count;
    return taken;
  }

 private:
  double* next_;
};

/// Columns with gaps of zeros between them.
inline void pad(double* to, int ld, const double* from, int rows, int columns) {
  for (int j = 0; j < columns; ++j) {
    for (int i = 0; i < rows; ++i) {
      to[i + j * ld] = from[i + j * rows];
    }
    for (int i = rows; i < ld; ++i) {
      to[i + j * ld] = 0.0;
    }
  }
}

/// The symmetric part of S, padded likewise.
inline void pad_symmetric(double* to, int ld, const double* from, int n) {
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      to[i + j * ld] = 0.5 * (from[i + j * n] + from[j + i * n]);
    }
    for (int i = n; i < ld; ++i) {
      to[i + j * ld] = 0.0;
    }
  }
}

/// R = LLᵀ in the lower triangle; false where R is not safely positive definite.
inline bool cholesky(double* R, int ld, int m) {
  double smallest = std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (int j = 0; j < m; ++j) {
    double pivot = R[j + j * ld];
    for (int k = 0; k < j; ++k) {
      pivot -= R[j + k * ld] * R[j + k * ld];
    }
    smallest = pivot < smallest ? pivot : smallest;
    largest = pivot > largest ? pivot : largest;
    if (!(pivot > 0.0)) {
      return false;
    }
    const double root = std::sqrt(pivot);
    const double inverse = 1.0 / root;
    R[j + j * ld] = root;
    for (int i = j + 1; i < m; ++i) {
      double entry = R[i + j * ld];
      for (int k = 0; k < j; ++k) {
        entry -= R[i + k * ld] * R[j + k * ld];
      }
      R[i + j * ld] = entry * inverse;
    }
  }
  return smallest > 1e-10 * largest;
}

/// F ← F L⁻ᵀ, F with `ld` rows and m columns.
inline void divide_by_transposed(double* F, int ld, const double* L, int ldl, int m) {
  for (int j = 0; j < m; ++j) {
    for (int k = 0; k < j; ++k) {
      const double factor = L[j + k * ldl];
      for (int i = 0; i < ld; ++i) {
        F[i + j * ld] -= F[i + k * ld] * factor;
      }
    }
    const double inverse = 1.0 / L[j + j * ldl];
    for (int i = 0; i < ld; ++i) {
      F[i + j * ld] *= inverse;
    }
  }
}

/// C (+ or -)= F Gᵀ for F, G with m columns.
template <int N>
inline void outer(Size<N> n, double* C, double sign, const double* F, const double* G, int m) {
  const int ld = n.padded();
  for (int j = 0; j < n(); ++j) {
    for (int k = 0; k < m; ++k) {
      const double factor = sign * G[j + k * ld];
      for (int i = 0; i < ld; ++i) {
        C[i + j * ld] += F[i + k * ld] * factor;
      }
    }
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
