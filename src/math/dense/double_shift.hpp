#pragma once

// Compiled once for each instruction set; see small_matrix.hpp. What the double-shift QR iterations
// for eigenvalues and for the real Schur form share (Martin, Peters and Wilkinson, Numerische
// Mathematik 14 (1970): hqr, hqr2). H is upper Hessenberg, its columns lie `ld` apart.

#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// Of one block before its iteration is given up; hqr has 30, which lightly damped chains of some
/// hundred masses exceed.
inline constexpr int most_sweeps = 60;

/// The sum of the magnitudes of H's entries.
inline double hessenberg_norm(int n, int ld, const double* H) {
  double norm = 0.0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= std::min(j + 1, n - 1); ++i) {
      norm += std::abs(H[i + j * ld]);
    }
  }
  return norm;
}

/// The first row of the unreduced block that ends with row `end`; the subdiagonal entry above it,
/// which is rounding beside its neighbours, is made zero. After `iteration` sweeps without one so
/// is what is rounding beside H: eigenvalues that are nothing beside others have no digits to lose.
inline int start_of_block(int ld, double* H, int end, double norm, int iteration) {
  constexpr int patience = 15;
  const double nothing = iteration < patience ? 0.0 : epsilon * norm / (end + 1);
  for (int low = end; low > 0; --low) {
    double size_here = std::abs(H[low - 1 + (low - 1) * ld]) + std::abs(H[low + low * ld]);
    if (size_here == 0.0) {  // the size of what is beside, as LAPACK's xLAHQR
      size_here = (low > 1 ? std::abs(H[low - 1 + (low - 2) * ld]) : 0.0) +
                  (low < end ? std::abs(H[low + 1 + low * ld]) : 0.0);
    }
    if (std::abs(H[low + (low - 1) * ld]) <= std::max(epsilon * size_here, nothing)) {
      H[low + (low - 1) * ld] = 0.0;
      return low;
    }
  }
  return 0;
}

/// The first column (p q r)ᵀ of (H - s₁)(H - s₂) from row m on, up to a factor.
struct Bulge {
  int m;
  double p, q, r;
};

/// @param x, y, w  The shifts' s₁ + s₂ = x + y and s₁s₂ = x y - w. Two consecutive small
///                 subdiagonals let the sweep start below `low`.
inline Bulge start_of_sweep(int ld, const double* H, int low, int end, double x, double y,
                            double w) {
  const auto h = [=](int i, int j) { return H[i + j * ld]; };
  for (int m = end - 2;; --m) {
    const double z = h(m, m);
    const double rr = x - z;
    const double ss = y - z;
    double p = (rr * ss - w) / h(m + 1, m) + h(m, m + 1);
    double q = h(m + 1, m + 1) - z - rr - ss;
    double r = h(m + 2, m + 1);
    const double s = std::abs(p) + std::abs(q) + std::abs(r);
    p /= s;
    q /= s;
    r /= s;
    if (m == low) {
      return {m, p, q, r};
    }
    const double u = std::abs(h(m, m - 1)) * (std::abs(q) + std::abs(r));
    const double v =
        std::abs(p) * (std::abs(h(m - 1, m - 1)) + std::abs(z) + std::abs(h(m + 1, m + 1)));
    if (u <= epsilon * v) {
      return {m, p, q, r};
    }
  }
}

/// The reflection I - (x y z)ᵀ(1 q r) that turns (p q r)ᵀ into (top 0 0)ᵀ; I where that is zero.
struct Reflection {
  double x = 0.0, y = 0.0, z = 0.0, q = 0.0, r = 0.0, top = 0.0;
};
inline Reflection reflection_of(double p, double q, double r) {
  double scale = 1.0;
  double square = p * p + q * q + r * r;
  if (!(square > 1e-280 && square < 1e280)) {
    scale = std::abs(p) + std::abs(q) + std::abs(r);
    if (!(scale > 0.0)) {
      return {};
    }
    p /= scale;
    q /= scale;
    r /= scale;
    square = p * p + q * q + r * r;
  }
  const double s = std::copysign(std::sqrt(square), p);
  p += s;
  const double inverse_s = 1.0 / s;
  const double inverse_p = 1.0 / p;
  return {p * inverse_s, q * inverse_s, r * inverse_s, q * inverse_p, r * inverse_p, -s * scale};
}

/// (c0 c1 c2) ← (c0 c1 c2)(I - (x y z)ᵀ(1 q r)) on the first `rows` rows and the rest of the last
/// vector; `last`: c2 and z are not there.
inline __attribute__((always_inline)) void reflect_columns(double* M, int ld, int rows,
                                                           const Reflection& turn, bool last) {
  const auto [x, y, z, q, r, top] = turn;
  if (last) {
    for (int i = 0; i < rows; i += 4) {
      FourAt c0 = at4(M + i);
      FourAt c1 = at4(M + i + ld);
      const Vector4 t = x * c0.get() + y * c1.get();
      c0 -= t;
      c1 -= t * q;
    }
    return;
  }
  for (int i = 0; i < rows; i += 4) {
    FourAt c0 = at4(M + i);
    FourAt c1 = at4(M + i + ld);
    FourAt c2 = at4(M + i + 2 * ld);
    const Vector4 t = x * c0.get() + y * c1.get() + z * c2.get();
    c0 -= t;
    c1 -= t * q;
    c2 -= t * r;
  }
}

/// One sweep of the block from row `low` to row `end`: the bulge is chased to its lower end.
/// @param stop          The rows are turned in the columns before this one.
/// @param turn_columns  Turns the columns from k on: called with k, the reflection, and whether it
///                      is the last one, of two columns.
template <class TurnColumns>
inline __attribute__((always_inline)) void sweep(int ld, double* H, const Bulge& bulge, int low,
                                                 int end, int stop,
                                                 const TurnColumns& turn_columns) {
  const auto h = [=](int i, int j) -> double& { return H[i + j * ld]; };
  auto [m, p, q, r] = bulge;
  for (int k = m; k < end; ++k) {
    const bool last = k == end - 1;
    if (k != m) {
      p = h(k, k - 1);
      q = h(k + 1, k - 1);
      r = last ? 0.0 : h(k + 2, k - 1);
    }
    const Reflection turn = reflection_of(p, q, r);
    if (k != m) {
      h(k, k - 1) = turn.top;
      h(k + 1, k - 1) = 0.0;
      if (!last) {
        h(k + 2, k - 1) = 0.0;
      }
    } else if (low != m) {
      h(k, k - 1) = -h(k, k - 1);
    }
    if (last) {
      for (int j = k; j < stop; ++j) {
        double* const column = &h(k, j);
        const double t = column[0] + turn.q * column[1];
        column[0] -= t * turn.x;
        column[1] -= t * turn.y;
      }
    } else {
      for (int j = k; j < stop; ++j) {
        double* const column = &h(k, j);
        const double t = column[0] + turn.q * column[1] + turn.r * column[2];
        column[0] -= t * turn.x;
        column[1] -= t * turn.y;
        column[2] -= t * turn.z;
      }
    }
    turn_columns(k, turn, last);
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
