#pragma once

// Compiled once for each instruction set; see small_matrix.hpp. What the double-shift QR iterations
// for eigenvalues and for the real Schur form share (Martin, Peters and Wilkinson, Numerische
// Mathematik 14 (1970): hqr, hqr2). H is upper Hessenberg, its columns lie `ld` apart.

#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

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
/// which is rounding beside its neighbours, is made zero.
inline int start_of_block(int ld, double* H, int end, double norm) {
  for (int low = end; low > 0; --low) {
    double size_here = std::abs(H[low - 1 + (low - 1) * ld]) + std::abs(H[low + low * ld]);
    if (size_here == 0.0) {
      size_here = norm;
    }
    if (std::abs(H[low + (low - 1) * ld]) <= epsilon * size_here) {
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

}  // namespace flyball::detail::FLYBALL_VARIANT
