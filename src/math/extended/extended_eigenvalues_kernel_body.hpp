#pragma once

// Included with FLYBALL_VARIANT as the namespace, by each source that compiles it for one kind of
// processor, with -ffp-contract=off: a fused product would be no longer what the next line
// corrects.

namespace flyball::detail::FLYBALL_VARIANT {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

struct Real {
  double hi = 0.0;
  double lo = 0.0;
};

inline __attribute__((always_inline)) Real operator-(Real a) {
  return {-a.hi, -a.lo};
}

inline __attribute__((always_inline)) Real operator+(Real a, Real b) {
  const double s = a.hi + b.hi;
  const double part = s - a.hi;
  const double rest = ((a.hi - (s - part)) + (b.hi - part)) + (a.lo + b.lo);
  const double high = s + rest;
  return {high, rest - (high - s)};
}

inline __attribute__((always_inline)) Real operator-(Real a, Real b) {
  return a + -b;
}

inline __attribute__((always_inline)) Real operator*(Real a, Real b) {
  const double p = a.hi * b.hi;
  const double rest = __builtin_fma(a.hi, b.hi, -p) + (a.hi * b.lo + a.lo * b.hi);
  const double high = p + rest;
  return {high, rest - (high - p)};
}

inline __attribute__((always_inline)) Real operator/(Real a, Real b) {
  const double first = a.hi / b.hi;
  const Real left = a - Real{first} * b;
  const double second = left.hi / b.hi;
  const Real rest = left - Real{second} * b;
  return Real{first} + Real{second} + Real{rest.hi / b.hi};
}

inline __attribute__((always_inline)) Real square_root(Real a) {
  if (!(a.hi > 0.0)) {
    return {};
  }
  const double root = std::sqrt(a.hi);
  const Real left = a - Real{root} * Real{root};
  return Real{root} + Real{left.hi / (2.0 * root)};
}

struct Number {
  Real re;
  Real im;

  [[nodiscard]] Complex rounded() const { return {re.hi, im.hi}; }
  [[nodiscard]] double size() const { return std::abs(re.hi) + std::abs(im.hi); }
};

inline __attribute__((always_inline)) Number operator+(Number a, Number b) {
  return {a.re + b.re, a.im + b.im};
}
inline __attribute__((always_inline)) Number operator-(Number a, Number b) {
  return {a.re - b.re, a.im - b.im};
}
inline __attribute__((always_inline)) Number operator*(Number a, Number b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
inline __attribute__((always_inline)) Number conjugate(Number a) {
  return {a.re, -a.im};
}

class Square {
 public:
  explicit Square(Index n) : n_(n), entries_(static_cast<std::size_t>(n * n)) {}
  Real& operator()(Index i, Index j) { return entries_[static_cast<std::size_t>(i * n_ + j)]; }

 private:
  Index n_;
  std::vector<Real> entries_;
};

/// Upper Hessenberg form by eliminations, the largest entry of each column as pivot.
void reduce(Square& H, Index n) {
  for (Index m = 1; m + 1 < n; ++m) {
    Index pivot = m;
    for (Index i = m + 1; i < n; ++i) {
      pivot = std::abs(H(i, m - 1).hi) > std::abs(H(pivot, m - 1).hi) ? i : pivot;
    }
    if (H(pivot, m - 1).hi == 0.0) {
      continue;
    }
    if (pivot != m) {
      for (Index j = m - 1; j < n; ++j) {
        std::swap(H(pivot, j), H(m, j));
      }
      for (Index i = 0; i < n; ++i) {
        std::swap(H(i, pivot), H(i, m));
      }
    }
    for (Index i = m + 1; i < n; ++i) {
      const Real factor = H(i, m - 1) / H(m, m - 1);
      H(i, m - 1) = {};
      if (factor.hi == 0.0) {
        continue;
      }
      for (Index j = m; j < n; ++j) {
        H(i, j) = H(i, j) - factor * H(m, j);
      }
      for (Index k = 0; k < n; ++k) {
        H(k, m) = H(k, m) + factor * H(k, i);
      }
    }
  }
}

/// A complex matrix by rows, each of the four parts of its numbers in an array of its own, so that
/// a rotation of two rows is one loop over vectors.
class Planes {
 public:
  explicit Planes(Index n) : n_(n), entries_(static_cast<std::size_t>(4 * n * n)) {}

  [[nodiscard]] Number get(Index i, Index j) const {
    const double* at = entries_.data() + i * n_ + j;
    const Index plane = n_ * n_;
    return {{at[0], at[plane]}, {at[2 * plane], at[3 * plane]}};
  }
  void set(Index i, Index j, Number value) {
    double* at = entries_.data() + i * n_ + j;
    const Index plane = n_ * n_;
    at[0] = value.re.hi;
    at[plane] = value.re.lo;
    at[2 * plane] = value.im.hi;
    at[3 * plane] = value.im.lo;
  }

  /// (upper, lower) ↦ (c̄ upper + s̄ lower, c lower - s upper), rows k and k + 1 from `from` to `to`.
  void rotate(Index k, Index from, Index to, Number c, Number s) {
    const Index plane = n_ * n_;
    double* const upper = entries_.data() + k * n_;
    double* const lower = upper + n_;
    const Number c_conjugate = conjugate(c);
    const Number s_conjugate = conjugate(s);
#pragma GCC ivdep
    for (Index j = from; j <= to; ++j) {
      const Number u{{upper[j], upper[plane + j]}, {upper[2 * plane + j], upper[3 * plane + j]}};
      const Number l{{lower[j], lower[plane + j]}, {lower[2 * plane + j], lower[3 * plane + j]}};
      const Number first = c_conjugate * u + s_conjugate * l;
      const Number second = c * l - s * u;
      upper[j] = first.re.hi;
      upper[plane + j] = first.re.lo;
      upper[2 * plane + j] = first.im.hi;
      upper[3 * plane + j] = first.im.lo;
      lower[j] = second.re.hi;
      lower[plane + j] = second.re.lo;
      lower[2 * plane + j] = second.im.hi;
      lower[3 * plane + j] = second.im.lo;
    }
  }

  /// What is not zero of the Hessenberg block from `first` to `last`, rows to columns.
  void columns_into(Planes& other, Index first, Index last) const {
    const Index plane = n_ * n_;
    for (int part = 0; part < 4; ++part) {
      const double* from = entries_.data() + part * plane;
      double* to = other.entries_.data() + part * plane;
      for (Index i = first; i <= last; ++i) {
        for (Index j = std::max(first, i - 1); j <= last; ++j) {
          to[j * n_ + i] = from[i * n_ + j];
        }
      }
    }
  }
  /// The same back.
  void rows_into(Planes& other, Index first, Index last) const {
    const Index plane = n_ * n_;
    for (int part = 0; part < 4; ++part) {
      const double* from = entries_.data() + part * plane;
      double* to = other.entries_.data() + part * plane;
      for (Index i = first; i <= last; ++i) {
        for (Index j = std::max(first, i - 1); j <= last; ++j) {
          to[i * n_ + j] = from[j * n_ + i];
        }
      }
    }
  }

 private:
  Index n_;
  std::vector<double> entries_;
};

/// Of the last two rows' eigenvalues that nearer to the last entry, as a distance from it.
Complex wilkinson(const Planes& H, Index last) {
  const Complex half = 0.5 * (H.get(last - 1, last - 1) - H.get(last, last)).rounded();
  const Complex across = H.get(last - 1, last).rounded() * H.get(last, last - 1).rounded();
  Complex root = std::sqrt(half * half + across);
  if (std::real(half * std::conj(root)) < 0.0) {
    root = -root;
  }
  const Complex sum = half + root;
  return sum == Complex(0.0) ? Complex(0.0) : -across / sum;
}

/// H - σ = G₁ᴴ G₂ᴴ … R by rotations of neighbouring rows, R G₁ᴴ G₂ᴴ … + σ, between two indices.
/// The columns are rotated as rows of `columns`.
void step(Planes& H, Planes& columns, Index first, Index last, Number shift) {
  std::vector<std::pair<Number, Number>> rotations(static_cast<std::size_t>(last - first));
  for (Index k = first; k <= last; ++k) {
    H.set(k, k, H.get(k, k) - shift);
  }
  for (Index k = first; k < last; ++k) {
    auto& [c, s] = rotations[static_cast<std::size_t>(k - first)];
    const Number a = H.get(k, k);
    const Number b = H.get(k + 1, k);
    const Real length = square_root(a.re * a.re + a.im * a.im + b.re * b.re + b.im * b.im);
    if (length.hi == 0.0) {
      c = {{1.0}, {}};
      s = {};
      continue;
    }
    c = {a.re / length, a.im / length};
    s = {b.re / length, b.im / length};
    H.rotate(k, k, last, c, s);
  }
  H.columns_into(columns, first, last);
  for (Index k = first; k < last; ++k) {
    const auto& [c, s] = rotations[static_cast<std::size_t>(k - first)];
    columns.rotate(k, first, std::min(k + 1, last), conjugate(c), conjugate(s));
  }
  columns.rows_into(H, first, last);
  for (Index k = first; k <= last; ++k) {
    H.set(k, k, H.get(k, k) + shift);
  }
}

}  // namespace

/// Declared in extended_eigenvalues_kernel.hpp.
bool extended_eigenvalues(const DoubleDoubleMatrix& M, Complex* values) {
  constexpr int most_steps = 60;
  constexpr double rounding = 1e-32;
  const Index n = M.rows();
  Square real(n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      real(i, j) = Real{M.hi(i, j)} + Real{M.lo(i, j)};
    }
  }
  reduce(real, n);
  Planes H(n);
  Planes columns(n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = std::max<Index>(0, i - 1); j < n; ++j) {
      H.set(i, j, {real(i, j), {}});
    }
  }
  const double size = M.norm();
  int steps = 0;
  for (Index last = n - 1; last >= 0;) {
    Index first = last;
    while (first > 0) {
      const double beside = H.get(first, first).size() + H.get(first - 1, first - 1).size();
      if (H.get(first, first - 1).size() <= rounding * (beside > 0.0 ? beside : size)) {
        H.set(first, first - 1, {});
        break;
      }
      --first;
    }
    if (first == last) {
      values[last] = H.get(last, last).rounded();
      --last;
      steps = 0;
      continue;
    }
    if (++steps > most_steps) {
      return false;
    }
    const Complex apart =
        steps % 10 == 0 ? Complex(H.get(last, last - 1).size(), 0.0) : wilkinson(H, last);
    const Number shift = H.get(last, last) + Number{{apart.real()}, {apart.imag()}};
    step(H, columns, first, last, shift);
  }
  return true;
}

}  // namespace flyball::detail::FLYBALL_VARIANT
