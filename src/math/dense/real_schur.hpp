#pragma once

// Compiled once for each instruction set; see small_matrix.hpp.

#include "math/dense/double_shift.hpp"
#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// H ← UᵀHU upper Hessenberg by Householder reflections, and U unless it is null; `work` holds
/// three vectors. All with `ld` rows, a multiple of four, the padding zero.
inline void hessenberg(int n, int ld, double* H, double* U, double* work) {
  double* const v = work;
  double* const y = work + ld;
  double* const u = work + 2 * ld;
  for (int k = 0; U != nullptr && k < ld * n; ++k) {
    U[k] = 0.0;
  }
  for (int i = 0; U != nullptr && i < n; ++i) {
    U[i + i * ld] = 1.0;
  }
  for (int c = 0; c + 2 < n; ++c) {
    double* const column = H + c * ld;
    double tail = 0.0;
    for (int i = c + 2; i < n; ++i) {
      tail += column[i] * column[i];
    }
    if (tail == 0.0) {
      continue;
    }
    const double head = column[c + 1];
    const double norm = std::copysign(std::sqrt(head * head + tail), head);
    for (int i = 0; i < ld; ++i) {
      v[i] = i > c + 1 ? column[i] : 0.0;
      y[i] = 0.0;
      u[i] = 0.0;
    }
    v[c + 1] = head + norm;
    const double beta = 1.0 / (norm * v[c + 1]);
    column[c + 1] = -norm;
    for (int i = c + 2; i < n; ++i) {
      column[i] = 0.0;
    }
    // (I - βvvᵀ)H(I - βvvᵀ) = H - v(βHᵀv - γv)ᵀ - (βHv - γv)vᵀ, γ = β²vᵀHv/2.
    const int first = (c + 1) / 4 * 4;
    for (int j = c + 1; j < n; ++j) {
      const double* const h = H + j * ld;
      const double factor = v[j];
      Vector4 dot{};
      int i = 0;
      for (; i < first; i += 4) {
        at4(y + i) += load4(h + i) * factor;
      }
      for (; i < ld; i += 4) {
        const Vector4 a = load4(h + i);
        dot += a * load4(v + i);
        at4(y + i) += a * factor;
      }
      u[j] = beta * ((dot[0] + dot[2]) + (dot[1] + dot[3]));
    }
    double gamma = 0.0;
    for (int i = c + 1; i < n; ++i) {
      gamma += v[i] * y[i];
    }
    gamma *= 0.5 * beta * beta;
    for (int i = 0; i < ld; i += 4) {
      at4(y + i) = beta * load4(y + i) - gamma * load4(v + i);
      at4(u + i) -= gamma * load4(v + i);
    }
    for (int j = c + 1; j < n; ++j) {
      double* const h = H + j * ld;
      const double left = u[j];
      const double right = v[j];
      int i = 0;
      for (; i < first; i += 4) {
        at4(h + i) -= load4(y + i) * right;
      }
      for (; i < ld; i += 4) {
        at4(h + i) -= load4(y + i) * right + load4(v + i) * left;
      }
    }
    // U ← U(I - βvvᵀ).
    for (int i = 0; U != nullptr && i < ld; i += 4) {
      Vector4 sum{};
      for (int j = c + 1; j < n; ++j) {
        sum += load4(U + i + j * ld) * v[j];
      }
      sum *= beta;
      for (int j = c + 1; j < n; ++j) {
        at4(U + i + j * ld) -= sum * v[j];
      }
    }
  }
}

/// A rotation of rows and columns k, k+1 of T and of U's columns that gives the 2x2 block at k
/// equal diagonal entries, or zero below them where its eigenvalues are real (LAPACK's xLANV2).
inline void standardize(int n, int ld, double* T, double* U, int k) {
  const double a = T[k + k * ld];
  const double b = T[k + (k + 1) * ld];
  const double c = T[k + 1 + k * ld];
  const double d = T[k + 1 + (k + 1) * ld];
  if (c == 0.0) {
    return;
  }
  double cosine = 1.0;
  double sine = 0.0;
  const double p = 0.5 * (a - d);
  const double larger = std::max(std::abs(b), std::abs(c));
  const double smaller =
      std::copysign(std::min(std::abs(b), std::abs(c)), b) * std::copysign(1.0, c);
  const double scale = std::max(std::abs(p), larger);
  const double z = (p / scale) * p + (larger / scale) * smaller;
  bool real = false;
  if (b == 0.0) {
    cosine = 0.0;
    sine = 1.0;
    real = true;
  } else if (z >= 0.0) {
    const double root = p + std::copysign(std::sqrt(scale) * std::sqrt(z), p);
    const double length = std::sqrt(c * c + root * root);
    cosine = root / length;
    sine = c / length;
    real = true;
  } else if (p != 0.0) {
    const double sigma = b + c;
    const double length = std::sqrt(sigma * sigma + 4.0 * p * p);
    cosine = std::sqrt(0.5 * (1.0 + std::abs(sigma) / length));
    sine = -(p / (length * cosine)) * std::copysign(1.0, sigma);
  }
  for (int j = k; j < n; ++j) {
    double* const t = T + k + j * ld;
    const double first = t[0];
    t[0] = cosine * first + sine * t[1];
    t[1] = cosine * t[1] - sine * first;
  }
  const auto rotate_columns = [=](double* M, int rows) {
    double* const left = M + k * ld;
    double* const right = M + (k + 1) * ld;
    for (int i = 0; i < rows; ++i) {
      const double first = left[i];
      left[i] = cosine * first + sine * right[i];
      right[i] = cosine * right[i] - sine * first;
    }
  };
  rotate_columns(T, k + 2);
  rotate_columns(U, ld);
  if (real) {
    T[k + 1 + k * ld] = 0.0;
  } else {
    const double mean = 0.5 * (T[k + k * ld] + T[k + 1 + (k + 1) * ld]);
    T[k + k * ld] = T[k + 1 + (k + 1) * ld] = mean;
  }
}

/// H (upper Hessenberg) ← real Schur form with standardised 2x2 blocks, U ← U times the
/// transformation, by the double-shift QR iteration (Martin, Peters and Wilkinson, Numerische
/// Mathematik 14 (1970): hqr2). False where `most_sweeps` an eigenvalue do not suffice.
inline bool real_schur(int n, int ld, double* H, double* U) {
  const auto h = [=](int i, int j) -> double& { return H[i + j * ld]; };
  const double norm = hessenberg_norm(n, ld, H);
  int end = n - 1;
  int iteration = 0;
  while (end > 0) {
    const int low = start_of_block(ld, H, end, norm, iteration);
    if (low == end) {
      --end;
      iteration = 0;
      continue;
    }
    if (low == end - 1) {
      standardize(n, ld, H, U, low);
      end -= 2;
      iteration = 0;
      continue;
    }
    if (iteration == most_sweeps) {
      return false;
    }
    double x = h(end, end);
    double y = h(end - 1, end - 1);
    double w = h(end, end - 1) * h(end - 1, end);
    if (iteration > 0 && iteration % 10 == 0) {
      const double s = std::abs(h(end, end - 1)) + std::abs(h(end - 1, end - 2));
      x = y = x + 0.75 * s;
      w = -0.4375 * s * s;
    }
    ++iteration;
    // Rows below the bulge and below `end` are zero in these columns: whole vectors.
    sweep(ld, H, start_of_sweep(ld, H, low, end, x, y, w), low, end, n,
          [=](int k, const Reflection& turn, bool last) {
            reflect_columns(H + k * ld, ld, std::min(end, k + 3) + 1, turn, last);
            reflect_columns(U + k * ld, ld, n, turn, last);
          });
  }
  return true;
}

}  // namespace flyball::detail::FLYBALL_VARIANT
