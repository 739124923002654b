#pragma once

// Compiled once for each instruction set; see small_matrix.hpp.

namespace flyball::detail::FLYBALL_VARIANT {

/// (e^x - e^y) / (x - y), for any distance of x and y.
inline double divided_difference(double x, double y) {
  const double half = 0.5 * (x - y);
  if (std::abs(half) < 1.0) {
    // e^((x+y)/2) sinh(h)/h; the series of sinh(h)/h below h where it is exact.
    const double sinch = std::abs(half) < 1e-4 ? 1.0 + half * half / 6.0 : std::sinh(half) / half;
    return std::exp(0.5 * (x + y)) * sinch;
  }
  return (std::exp(x) - std::exp(y)) / (x - y);
}

/// p q - r s without cancellation of the products' rounding errors (Kahan).
inline double difference_of_products(double p, double q, double r, double s) {
  const double rs = r * s;
  return std::fma(p, q, -rs) + std::fma(-r, s, rs);
}

/// Closed form of a 2x2: exp(A) = e^μ (cosh δ I + sinh δ / δ (A - μ I)), μ = (a + d)/2,
/// δ² = ((a - d)/2)² + b c, written in the eigenvalues μ ± δ so that nothing overflows on the way.
inline void exponential_2x2(const double* A, double* E) {
  const double a = A[0];
  const double b = A[2];
  const double c = A[1];
  const double d = A[3];
  const double mean = 0.5 * a + 0.5 * d;
  const double half = 0.5 * a - 0.5 * d;
  // Of huge entries the products are formed in another unit.
  const bool huge = !(std::abs(half) + std::abs(mean) + std::abs(b) + std::abs(c) < 1e150);
  const double unit = huge ? 0x1p-520 : 1.0;
  const double discriminant = difference_of_products(half * unit, half * unit, -b * unit, c * unit);
  double f = 0.0;
  double diagonal = 0.0;
  if (b == 0.0 || c == 0.0) {
    f = divided_difference(a, d);
    E[0] = std::exp(a);
    E[1] = c == 0.0 ? 0.0 : c * f;
    E[2] = b == 0.0 ? 0.0 : b * f;
    E[3] = std::exp(d);
    return;
  }
  if (discriminant >= 0.0) {
    const double delta = std::sqrt(discriminant) / unit;
    // The eigenvalue of larger magnitude is free of cancellation; the other is det / it.
    const double large = mean >= 0.0 ? mean + delta : mean - delta;
    // Below one no eigenvalue is stiff, and the two must rather agree on δ: it may be rounding.
    const double small = std::abs(large) < 1.0
                             ? 2.0 * mean - large
                             : difference_of_products(a * unit, d * unit, b * unit, c * unit) /
                                   (large * unit) / unit;
    f = divided_difference(large, small);
    diagonal = 0.5 * (std::exp(large) + std::exp(small));
  } else {
    const double omega = std::sqrt(-discriminant) / unit;
    const double scale = std::exp(mean);
    f = scale * (std::sin(omega) / omega);
    diagonal = scale * std::cos(omega);
  }
  E[0] = diagonal + half * f;
  E[1] = c * f;
  E[2] = b * f;
  E[3] = diagonal - half * f;
}

}  // namespace flyball::detail::FLYBALL_VARIANT
