#pragma once

// symmetric_modes of panel_kernel.hpp for one instruction set; see instruction_set.hpp.

#include "math/dense/panel_kernel_body.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

inline double dot_lanes(int n, const double* a, const double* b) {
  PanelLanes sums[2] = {};
  int i = 0;
  for (; i + 8 <= n; i += 8) {
    sums[0] += load_lanes<4>(a + i) * load_lanes<4>(b + i);
    sums[1] += load_lanes<4>(a + i + 4) * load_lanes<4>(b + i + 4);
  }
  const PanelLanes sum = sums[0] + sums[1];
  double total = (sum[0] + sum[1]) + (sum[2] + sum[3]);
  for (; i < n; ++i) {
    total += a[i] * b[i];
  }
  return total;
}

/// S = H T Hᵀ: diagonal d, beneath it e, H a product of I - τ v vᵀ whose v take the columns of S.
inline void tridiagonal_form(int n, double* S, int step, double* d, double* e, double* tau,
                             double* p) {
  for (int k = 0; k + 1 < n; ++k) {
    double* column = S + k * step;
    d[k] = column[k];
    const int rest = n - k - 1;
    double* v = column + k + 1;
    const double below = dot_lanes(rest - 1, v + 1, v + 1);
    if (!(below > 0.0)) {
      e[k] = v[0];
      tau[k] = 0.0;
      continue;
    }
    const double size = __builtin_sqrt(v[0] * v[0] + below);
    e[k] = v[0] > 0.0 ? -size : size;
    v[0] -= e[k];
    const double factor = 2.0 / (v[0] * v[0] + below);
    tau[k] = factor;
    // p = τ S v, then S -= v wᵀ + w vᵀ with w = p - (τ/2)(pᵀv) v.
    double* block = S + (k + 1) * step + k + 1;
    for (int i = 0; i < rest; ++i) {
      p[i] = 0.0;
    }
    int j = 0;
    for (; j + 4 <= rest; j += 4) {
      const double* c = block + j * step;
      const double v0 = factor * v[j];
      const double v1 = factor * v[j + 1];
      const double v2 = factor * v[j + 2];
      const double v3 = factor * v[j + 3];
      for (int i = 0; i < rest; ++i) {
        p[i] += (v0 * c[i] + v1 * c[i + step]) + (v2 * c[i + 2 * step] + v3 * c[i + 3 * step]);
      }
    }
    for (; j < rest; ++j) {
      const double* c = block + j * step;
      const double of = factor * v[j];
      for (int i = 0; i < rest; ++i) {
        p[i] += of * c[i];
      }
    }
    const double half = 0.5 * factor * dot_lanes(rest, p, v);
    for (int i = 0; i < rest; ++i) {
      p[i] -= half * v[i];
    }
    for (j = 0; j < rest; ++j) {
      double* c = block + j * step;
      const double pj = p[j];
      const double vj = v[j];
      for (int i = 0; i < rest; ++i) {
        c[i] -= v[i] * pj + p[i] * vj;
      }
    }
  }
  d[n - 1] = S[(n - 1) * step + n - 1];
}

/// Eigenvalues of the tridiagonal matrix of diagonal d and squares e beneath it, both overwritten.
inline bool tridiagonal_values(int n, double* d, double* e, double smallest) {
  int left = 60 * n;
  for (int l = 0; l < n;) {
    int m = l;
    while (m + 1 < n && e[m] > smallest) {
      ++m;
    }
    if (m == l) {
      ++l;
      continue;
    }
    if (--left < 0) {
      return false;
    }
    const double root = __builtin_sqrt(e[l]);
    double sigma = (d[l + 1] - d[l]) / (2.0 * root);
    const double r0 = __builtin_sqrt(sigma * sigma + 1.0);
    sigma = d[l] - root / (sigma + (sigma < 0.0 ? -r0 : r0));
    double c = 1.0;
    double s = 0.0;
    double gamma = d[m] - sigma;
    double p = gamma * gamma;
    for (int i = m - 1; i >= l; --i) {
      const double b = e[i];
      const double r = p + b;
      if (i + 1 < m) {
        e[i + 1] = s * r;
      }
      const double old_c = c;
      const double reciprocal = 1.0 / r;
      const double ratio = r / p;  // 1/c, beside it.
      c = p * reciprocal;
      s = b * reciprocal;
      const double old_gamma = gamma;
      gamma = c * (d[i] - sigma) - s * old_gamma;
      d[i + 1] = old_gamma + (d[i] - gamma);
      p = ratio < 1e250 ? gamma * gamma * ratio : old_c * b;
    }
    e[l] = s * p;
    d[l] = sigma + gamma;
  }
  return true;
}

/// (T - λ) x = x in place, by elimination with rows exchanged; `memory` 4n.
inline void solve_shifted(int n, const double* d, const double* e, double shift, double tiny,
                          double* x, double* memory) {
  double* diagonal = memory;
  double* above = memory + n;
  double* second = memory + 2 * n;
  double now = d[0] - shift;
  double next = n > 1 ? e[0] : 0.0;
  for (int i = 0; i + 1 < n; ++i) {
    const double below = e[i];
    const double after = i + 2 < n ? e[i + 1] : 0.0;
    const double own = d[i + 1] - shift;
    if (__builtin_fabs(now) >= __builtin_fabs(below)) {
      const double pivot = __builtin_fabs(now) > tiny ? now : tiny;
      const double factor = below / pivot;
      diagonal[i] = pivot;
      above[i] = next;
      second[i] = 0.0;
      x[i + 1] -= factor * x[i];
      now = own - factor * next;
      next = after;
    } else {
      const double factor = now / below;
      diagonal[i] = below;
      above[i] = own;
      second[i] = after;
      const double kept = x[i];
      x[i] = x[i + 1];
      x[i + 1] = kept - factor * x[i];
      now = next - factor * own;
      next = -factor * after;
    }
  }
  diagonal[n - 1] = __builtin_fabs(now) > tiny ? now : tiny;
  x[n - 1] /= diagonal[n - 1];
  if (n > 1) {
    x[n - 2] = (x[n - 2] - above[n - 2] * x[n - 1]) / diagonal[n - 2];
  }
  for (int i = n - 3; i >= 0; --i) {
    x[i] = (x[i] - above[i] * x[i + 1] - second[i] * x[i + 2]) / diagonal[i];
  }
}

bool symmetric_modes(int n, double* S, int step, int count, double* values, double* vectors,
                     double* memory) {
  double* d = memory;
  double* e = memory + n;
  double* tau = memory + 2 * n;
  double* p = memory + 3 * n;
  double* squares = memory + 4 * n;
  double* work = memory + 5 * n;
  tridiagonal_form(n, S, step, d, e, tau, p);
  double size = 0.0;
  for (int i = 0; i < n; ++i) {
    values[i] = d[i];
    size = __builtin_fmax(size, __builtin_fabs(d[i]));
    if (i + 1 < n) {
      squares[i] = e[i] * e[i];
      size = __builtin_fmax(size, __builtin_fabs(e[i]));
    }
  }
  const double rounding = epsilon * size;
  if (!(size > 0.0) || !(size < 1e150) || size < 1e-140 ||
      !tridiagonal_values(n, values, squares, rounding * rounding)) {
    return false;
  }
  for (int i = 1; i < n; ++i) {
    const double value = values[i];
    int to = i;
    for (; to > 0 && values[to - 1] < value; --to) {
      values[to] = values[to - 1];
    }
    values[to] = value;
  }
  for (int k = 0; k < count; ++k) {
    double* x = vectors + k * n;
    // Equal values are told apart, so that each iteration begins elsewhere.
    double shift = values[k];
    for (int before = 0; before < k; ++before) {
      shift -= values[before] - values[k] < 10.0 * rounding ? 10.0 * rounding : 0.0;
    }
    unsigned state = 12345u + 7919u * static_cast<unsigned>(k);
    for (int i = 0; i < n; ++i) {
      state = state * 1664525u + 1013904223u;
      x[i] = static_cast<double>(state >> 8) / 16777216.0 - 0.5;
    }
    double left = 0.0;
    for (int iteration = 0; iteration < 5; ++iteration) {
      solve_shifted(n, d, e, shift, rounding, x, work);
      double largest = 0.0;
      for (int i = 0; i < n; ++i) {
        largest = __builtin_fmax(largest, __builtin_fabs(x[i]));
      }
      if (!(largest < 1e300) || !(largest > 0.0)) {
        return false;
      }
      for (int i = 0; i < n; ++i) {
        x[i] /= largest;
      }
      for (int before = 0; before < k; ++before) {
        const double* other = vectors + before * n;
        const double part = dot_lanes(n, other, x);
        for (int i = 0; i < n; ++i) {
          x[i] -= part * other[i];
        }
      }
      const double norm = 1.0 / __builtin_sqrt(dot_lanes(n, x, x));
      for (int i = 0; i < n; ++i) {
        x[i] *= norm;
      }
      left = 0.0;
      for (int i = 0; i < n; ++i) {
        const double residual = (d[i] - values[k]) * x[i] + (i > 0 ? e[i - 1] * x[i - 1] : 0.0) +
                                (i + 1 < n ? e[i] * x[i + 1] : 0.0);
        left = __builtin_fmax(left, __builtin_fabs(residual));
      }
      if (left < 100.0 * rounding && iteration > 0) {
        break;
      }
    }
    // What is not orthogonal after the last division is so now.
    for (int before = 0; before < k; ++before) {
      if (!(__builtin_fabs(dot_lanes(n, vectors + before * n, x)) < 1e-12)) {
        return false;
      }
    }
    if (!(left < 1e4 * rounding)) {
      return false;
    }
  }
  for (int k = n - 2; k >= 0; --k) {
    if (tau[k] == 0.0) {
      continue;
    }
    const double* v = S + k * step + k + 1;
    const int rest = n - k - 1;
    for (int j = 0; j < count; ++j) {
      double* x = vectors + j * n + k + 1;
      const double part = tau[k] * dot_lanes(rest, v, x);
      for (int i = 0; i < rest; ++i) {
        x[i] -= part * v[i];
      }
    }
  }
  return true;
}

}  // namespace flyball::detail::FLYBALL_VARIANT
