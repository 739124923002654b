#pragma once

// Compiled once for each instruction set; see small_matrix.hpp.

#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// g ← (αH + βI)⁻¹g for R columns g and an upper Hessenberg H (n x n, padded to `ld` rows with
/// zeros). Columns are combined from the last to the first, each with the next as pivot, whichever
/// is larger, into an upper triangle, of which only the column in use is kept; what was combined is
/// undone on the solution in the end. `work` holds three vectors. False where a pivot vanishes.
template <int R>
bool solve_shifted(int n, int ld, const double* H, double alpha, double beta, double* g,
                   double* work) {
  double* const c = work;
  double* const factor = work + ld;
  double* const swapped = work + 2 * ld;
  for (int i = 0; i < ld; i += 4) {
    at4(c + i) = alpha * load4(H + i + (n - 1) * ld);
  }
  c[n - 1] += beta;
  for (int k = n - 1; k > 0; --k) {
    const double* const next = H + (k - 1) * ld;
    const double p = c[k];
    const double s = alpha * next[k];
    double z[R];
    if (std::abs(p) >= std::abs(s)) {
      const double inverse = 1.0 / p;
      const double m = s * inverse;
      for (int r = 0; r < R; ++r) {
        z[r] = g[k + r * ld] * inverse;
      }
      for (int i = 0; i <= k; i += 4) {
        const Vector4 column = load4(c + i);
        at4(c + i) = alpha * load4(next + i) - m * column;
#pragma GCC unroll 3
        for (int r = 0; r < R; ++r) {
          at4(g + i + r * ld) -= z[r] * column;
        }
      }
      c[k - 1] += beta;
      factor[k] = m;
      swapped[k] = 0.0;
    } else {
      const double inverse = 1.0 / s;
      const double m = p * inverse;
      for (int r = 0; r < R; ++r) {
        z[r] = g[k + r * ld] * inverse;
      }
      for (int i = 0; i <= k; i += 4) {
        const Vector4 column = alpha * load4(next + i);
        at4(c + i) -= m * column;
#pragma GCC unroll 3
        for (int r = 0; r < R; ++r) {
          at4(g + i + r * ld) -= z[r] * column;
        }
      }
      c[k - 1] -= m * beta;
      for (int r = 0; r < R; ++r) {
        g[k - 1 + r * ld] -= z[r] * beta;
      }
      factor[k] = m;
      swapped[k] = 1.0;
    }
    c[k] = 0.0;
    for (int r = 0; r < R; ++r) {
      g[k + r * ld] = z[r];
    }
  }
  const double inverse = 1.0 / c[0];
  if (!std::isfinite(inverse)) {
    return false;
  }
  for (int r = 0; r < R; ++r) {
    double* const y = g + r * ld;
    double before = y[0] * inverse;
    for (int k = 1; k < n; ++k) {
      const double rest = y[k] - factor[k] * before;
      y[k - 1] = swapped[k] != 0.0 ? rest : before;
      before = swapped[k] != 0.0 ? before : rest;
    }
    y[n - 1] = before;
  }
  return true;
}

/// A complex number of whose operations the kernels need a few, without the library's care for
/// infinities.
struct Pair {
  double re;
  double im;
};
inline Pair operator*(Pair a, Pair b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
inline double square(Pair a) {
  return a.re * a.re + a.im * a.im;
}
inline Pair inverse_of(Pair a) {
  const double f = 1.0 / square(a);
  return {a.re * f, -a.im * f};
}

/// The same for complex α, β and columns gr + i gi; `work` holds five vectors.
template <int R>
bool solve_shifted(int n, int ld, const double* H, Pair alpha, Pair beta, double* gr, double* gi,
                   double* work) {
  double* const cr = work;
  double* const ci = work + ld;
  double* const swapped = work + 2 * ld;
  Pair* const factor = reinterpret_cast<Pair*>(work + 3 * ld);
  for (int i = 0; i < ld; ++i) {
    cr[i] = alpha.re * H[i + (n - 1) * ld];
    ci[i] = alpha.im * H[i + (n - 1) * ld];
  }
  cr[n - 1] += beta.re;
  ci[n - 1] += beta.im;
  for (int k = n - 1; k > 0; --k) {
    const double* const next = H + (k - 1) * ld;
    const Pair p{cr[k], ci[k]};
    const Pair s{alpha.re * next[k], alpha.im * next[k]};
    Pair z[R];
    if (square(p) >= square(s)) {
      const Pair inverse = inverse_of(p);
      const Pair m = s * inverse;
      for (int r = 0; r < R; ++r) {
        z[r] = Pair{gr[k + r * ld], gi[k + r * ld]} * inverse;
      }
      for (int i = 0; i <= k; i += 4) {
        const Vector4 re = load4(cr + i);
        const Vector4 im = load4(ci + i);
        const Vector4 h = load4(next + i);
        at4(cr + i) = alpha.re * h - m.re * re + m.im * im;
        at4(ci + i) = alpha.im * h - m.re * im - m.im * re;
#pragma GCC unroll 3
        for (int r = 0; r < R; ++r) {
          FourAt a = at4(gr + i + r * ld);
          FourAt b = at4(gi + i + r * ld);
          a = a.get() - z[r].re * re + z[r].im * im;
          b = b.get() - z[r].re * im - z[r].im * re;
        }
      }
      cr[k - 1] += beta.re;
      ci[k - 1] += beta.im;
      factor[k] = m;
      swapped[k] = 0.0;
    } else {
      const Pair inverse = inverse_of(s);
      const Pair m = p * inverse;
      const Pair q = m * alpha;
      Pair step[R];
      for (int r = 0; r < R; ++r) {
        z[r] = Pair{gr[k + r * ld], gi[k + r * ld]} * inverse;
        step[r] = z[r] * alpha;
      }
      for (int i = 0; i <= k; i += 4) {
        const Vector4 h = load4(next + i);
        at4(cr + i) -= q.re * h;
        at4(ci + i) -= q.im * h;
#pragma GCC unroll 3
        for (int r = 0; r < R; ++r) {
          at4(gr + i + r * ld) -= step[r].re * h;
          at4(gi + i + r * ld) -= step[r].im * h;
        }
      }
      const Pair shift = m * beta;
      cr[k - 1] -= shift.re;
      ci[k - 1] -= shift.im;
      for (int r = 0; r < R; ++r) {
        const Pair shift_of = z[r] * beta;
        gr[k - 1 + r * ld] -= shift_of.re;
        gi[k - 1 + r * ld] -= shift_of.im;
      }
      factor[k] = m;
      swapped[k] = 1.0;
    }
    cr[k] = 0.0;
    ci[k] = 0.0;
    for (int r = 0; r < R; ++r) {
      gr[k + r * ld] = z[r].re;
      gi[k + r * ld] = z[r].im;
    }
  }
  const Pair inverse = inverse_of({cr[0], ci[0]});
  if (!std::isfinite(inverse.re) || !std::isfinite(inverse.im)) {
    return false;
  }
  for (int r = 0; r < R; ++r) {
    double* const yr = gr + r * ld;
    double* const yi = gi + r * ld;
    Pair before = Pair{yr[0], yi[0]} * inverse;
    for (int k = 1; k < n; ++k) {
      const Pair product = factor[k] * before;
      const Pair rest{yr[k] - product.re, yi[k] - product.im};
      const Pair kept = swapped[k] != 0.0 ? rest : before;
      before = swapped[k] != 0.0 ? before : rest;
      yr[k - 1] = kept.re;
      yi[k - 1] = kept.im;
    }
    yr[n - 1] = before.re;
    yi[n - 1] = before.im;
  }
  return true;
}

}  // namespace flyball::detail::FLYBALL_VARIANT
