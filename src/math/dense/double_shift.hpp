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

}  // namespace flyball::detail::FLYBALL_VARIANT
