#pragma once

// Compiled once for each instruction set; see small_matrix.hpp.

#include "math/dense/double_shift.hpp"
#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// The roots of λ² - trace λ + determinant of a 2x2 block, real ones without cancellation.
inline void eigenvalues_2x2(double a, double b, double c, double d, std::complex<double>* lambda) {
  double p = 0.5 * (a - d);
  double bc = b * c;
  double unit = 1.0;
  if (std::abs(p * p + bc) < 0x1p-800) {
    // Squares that are no doubles, or nearly: in a unit in which they are.
    const double small = std::min(std::abs(b), std::abs(c));
    const double large = std::max(std::abs(b), std::abs(c));
    const double size = std::max(std::abs(p), std::sqrt(small) * std::sqrt(large));
    if (size > 0.0 && size < 0x1p-300) {
      unit = std::ldexp(1.0, std::ilogb(size));
      p /= unit;
      bc = std::copysign(large * (small / unit) / unit, b * std::copysign(1.0, c));
    }
  }
  const double discriminant = p * p + bc;
  if (discriminant >= 0.0) {
    const double root = std::sqrt(discriminant);
    const double z = p >= 0.0 ? p + root : p - root;
    lambda[0] = d + unit * z;
    lambda[1] = z != 0.0 ? d - unit * (bc / z) : d;
  } else {
    const double root = unit * std::sqrt(-discriminant);
    lambda[0] = {d + unit * p, root};
    lambda[1] = {d + unit * p, -root};
  }
}

/// All eigenvalues of an upper Hessenberg H (n x n, destroyed): the double-shift QR iteration on
/// the active block only (hqr). False where `most_sweeps` an eigenvalue do not suffice.
inline bool hessenberg_eigenvalues(int n, int ld, double* H, std::complex<double>* lambda) {
  const auto h = [=](int i, int j) -> double& { return H[i + j * ld]; };
  const double norm = hessenberg_norm(n, ld, H);
  int end = n - 1;
  double shift = 0.0;
  int iteration = 0;
  while (end >= 0) {
    const int low = start_of_block(ld, H, end, norm, iteration);
    double x = h(end, end);
    if (low == end) {
      lambda[end--] = x + shift;
      iteration = 0;
      continue;
    }
    double y = h(end - 1, end - 1);
    double w = h(end, end - 1) * h(end - 1, end);
    if (low == end - 1) {
      eigenvalues_2x2(y + shift, h(end - 1, end), h(end, end - 1), x + shift, lambda + end - 1);
      end -= 2;
      iteration = 0;
      continue;
    }
    if (iteration == most_sweeps) {
      return false;
    }
    if (iteration > 0 && iteration % 10 == 0) {
      shift += x;
      for (int i = 0; i <= end; ++i) {
        h(i, i) -= x;
      }
      const double s = std::abs(h(end, end - 1)) + std::abs(h(end - 1, end - 2));
      x = y = 0.75 * s;
      w = -0.4375 * s * s;
    }
    ++iteration;
    // Whole vectors of rows: those above `low` and below `end` belong to other blocks, whose
    // eigenvalues do not depend on these columns; the others below the bulge are zero.
    const int first = low / 4 * 4;
    sweep(ld, H, start_of_sweep(ld, H, low, end, x, y, w), low, end, end + 1,
          [=](int k, const Reflection& turn, bool last) {
            reflect_columns(H + first + k * ld, ld, std::min(end, k + 3) + 1 - first, turn, last);
          });
  }
  return true;
}

/// All eigenvalues of H (n x n, destroyed): reduction to Hessenberg form by stabilised elimination,
/// then the double-shift QR iteration on the active block only (Martin, Peters and Wilkinson,
/// Numerische Mathematik 14 (1970): elmhes and hqr). False where `most_sweeps` for an eigenvalue do
/// not suffice.
template <int N>
inline bool eigenvalues(Size<N> size, double* H, std::complex<double>* lambda) {
  const int n = size();
  const int ld = size.padded();
  const auto h = [=](int i, int j) -> double& { return H[i + j * ld]; };
  if (n == 1) {
    lambda[0] = H[0];
    return true;
  }
  if (n == 2) {
    eigenvalues_2x2(h(0, 0), h(0, 1), h(1, 0), h(1, 1), lambda);
    return true;
  }

  // The multipliers of one elimination, in memory that is written last: 2n doubles, at least `ld`.
  double* const multipliers = reinterpret_cast<double*>(lambda);
  for (int m = 1; m < n - 1; ++m) {
    int pivot = m;
    double largest = 0.0;
    for (int i = m; i < n; ++i) {
      if (std::abs(h(i, m - 1)) > largest) {
        largest = std::abs(h(i, m - 1));
        pivot = i;
      }
    }
    if (largest == 0.0) {
      continue;
    }
    if (pivot != m) {
      for (int j = m - 1; j < n; ++j) {
        std::swap(h(pivot, j), h(m, j));
      }
      for (int i = 0; i < n; ++i) {
        std::swap(h(i, pivot), h(i, m));
      }
    }
    const double inverse = 1.0 / h(m, m - 1);
    for (int i = 0; i < ld; ++i) {
      multipliers[i] = i > m && i < n ? h(i, m - 1) * inverse : 0.0;
    }
    for (int i = m + 1; i < n; ++i) {
      h(i, m - 1) = 0.0;
    }
    for (int j = m; j < n; ++j) {
      const double head = h(m, j);
      for (int i = m / 4 * 4; i < ld; i += 4) {
        at4(&h(i, j)) -= load4(multipliers + i) * head;
      }
    }
    for (int k = m + 1; k < n; ++k) {
      const double factor = multipliers[k];
      for (int i = 0; i < ld; i += 4) {
        at4(&h(i, m)) += load4(&h(i, k)) * factor;
      }
    }
  }
  return hessenberg_eigenvalues(n, ld, H, lambda);
}

}  // namespace flyball::detail::FLYBALL_VARIANT
