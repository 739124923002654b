#pragma once

// Part of riccati_kernel_body.hpp, compiled with it once for each instruction set: both Riccati
// equations of two states in closed form, from the spectral factor of their characteristic
// polynomial.

#include "math/dense/small_matrix.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// [a b; c d].
struct TwoByTwo {
  double a, b, c, d;

  static TwoByTwo from(const double* M) { return {M[0], M[2], M[1], M[3]}; }
  [[nodiscard]] double trace() const { return a + d; }
  [[nodiscard]] double determinant() const { return a * d - b * c; }
  [[nodiscard]] TwoByTwo adjugate() const { return {d, -b, -c, a}; }
  [[nodiscard]] TwoByTwo transposed() const { return {a, c, b, d}; }
};

inline TwoByTwo operator+(TwoByTwo M, TwoByTwo N) {
  return {M.a + N.a, M.b + N.b, M.c + N.c, M.d + N.d};
}
inline TwoByTwo operator-(TwoByTwo M, TwoByTwo N) {
  return {M.a - N.a, M.b - N.b, M.c - N.c, M.d - N.d};
}
inline TwoByTwo operator*(double s, TwoByTwo M) {
  return {s * M.a, s * M.b, s * M.c, s * M.d};
}
inline TwoByTwo operator*(TwoByTwo M, TwoByTwo N) {
  return {M.a * N.a + M.b * N.c, M.a * N.b + M.b * N.d, M.c * N.a + M.d * N.c,
          M.c * N.b + M.d * N.d};
}
inline TwoByTwo identity_times(double s) {
  return {s, 0.0, 0.0, s};
}

/// tr(MN).
inline double trace_of_product(TwoByTwo M, TwoByTwo N) {
  return M.a * N.a + M.b * N.c + M.c * N.b + M.d * N.d;
}

/// The symmetric solution of X = AᵀXA + C or of AᵀX + XA + C = 0 by its three equations; false
/// where they are singular.
inline bool lyapunov_two_states(bool continuous, const double* A, const double* C, double* X) {
  const auto [a, b, c, d] = TwoByTwo::from(A);
  double M[3][4] = {
      {2.0 * a, 2.0 * c, 0.0, -C[0]}, {b, a + d, c, -C[1]}, {0.0, 2.0 * b, 2.0 * d, -C[3]}};
  if (!continuous) {
    const double discrete[3][4] = {{1.0 - a * a, -2.0 * a * c, -c * c, C[0]},
                                   {-a * b, 1.0 - a * d - b * c, -c * d, C[1]},
                                   {-b * b, -2.0 * b * d, 1.0 - d * d, C[3]}};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 4; ++j) {
        M[i][j] = discrete[i][j];
      }
    }
  }
  for (int k = 0; k < 3; ++k) {
    int pivot = k;
    for (int i = k + 1; i < 3; ++i) {
      if (std::abs(M[i][k]) > std::abs(M[pivot][k])) {
        pivot = i;
      }
    }
    if (pivot != k) {
      for (int j = k; j < 4; ++j) {
        const double held = M[k][j];
        M[k][j] = M[pivot][j];
        M[pivot][j] = held;
      }
    }
    if (M[k][k] == 0.0) {
      return false;
    }
    for (int i = k + 1; i < 3; ++i) {
      const double factor = M[i][k] / M[k][k];
      for (int j = k + 1; j < 4; ++j) {
        M[i][j] -= factor * M[k][j];
      }
    }
  }
  const double x22 = M[2][3] / M[2][2];
  const double x12 = (M[1][3] - M[1][2] * x22) / M[1][1];
  X[0] = (M[0][3] - M[0][1] * x12 - M[0][2] * x22) / M[0][0];
  X[1] = X[2] = x12;
  X[3] = x22;
  return true;
}

/// det [P -G; -H -Pᵀ] with the sign of det P² : the characteristic polynomial of the Hamiltonian
/// matrix at zero (P = A) and of the symplectic pencil at ±1 (P = A ∓ I).
inline double even_determinant(TwoByTwo P, TwoByTwo G, TwoByTwo H) {
  const TwoByTwo adjugate = P.adjugate();
  const double det = P.determinant();
  return det * det + H.determinant() * G.determinant() +
         trace_of_product(adjugate.transposed() * H, adjugate * G);
}

/// X of 0 = AᵀX + XA - XGX + H. The closed loop A - GX has the polynomial p(s) = s² + c₁s + c₀ with
/// p(s)p(-s) = det(sI - M), M = [A -G; -H -Aᵀ], so
///   c₀² = det M,  c₁² = 2c₀ + ½ tr M²,
/// and p(M)[I; X] = 0, whose upper half is (c₁G + AG - GAᵀ)X = p(A) + GH: regular where (A, G) is
/// controllable.
inline bool care_two_states(TwoByTwo A, TwoByTwo G, TwoByTwo H, double* X) {
  const double det = A.determinant();
  const double det_M = even_determinant(A, G, H);
  if (!(det_M > 0.0)) {
    return false;
  }
  const double c0 = std::sqrt(det_M);
  const double c0_less_det = det > 0.0 ? (det_M - det * det) / (c0 + det) : c0 - det;
  const double square = 2.0 * c0_less_det + A.trace() * A.trace() + trace_of_product(G, H);
  if (!(square > 0.0)) {
    return false;
  }
  const double c1 = std::sqrt(square);
  const TwoByTwo AG = A * G;
  const TwoByTwo left = c1 * G + AG - AG.transposed();
  // p(A) by A² = tr(A)A - det(A)I.
  const TwoByTwo right = (A.trace() + c1) * A + identity_times(c0_less_det) + G * H;
  const TwoByTwo solution = (1.0 / left.determinant()) * (left.adjugate() * right);
  X[0] = solution.a;
  X[1] = X[2] = 0.5 * (solution.b + solution.c);
  X[3] = solution.d;
  return std::isfinite(X[0] + X[1] + X[3]);
}

/// X of X = AᵀX(I + GX)⁻¹A + H. With P = A - I the closed loop S has the polynomial
/// q(z) = z² + q₁z + q₀, ρ²q(z)q(1/z) = det(M - zL)/z² for the symplectic pencil
/// M - zL = [A 0; -H I] - z[I G; 0 Aᵀ]. Its values at ±1 are the squares of s± = ρ(1 ± q₁ + q₀),
/// and ρ²q₀ = det A, so that ρ(1 + q₀) = ½(s₊ + s₋) and
///   ρ²(1 - q₀)² = ¼(s₊ + s₋)² - 4 det A,
/// here in terms of P, because the poles of a loop that is sampled fast lie near 1. With Z = XS,
/// S = A - GZ and X = H + AᵀZ, the equation q(S) = 0 becomes (AG - q₀GAᵀ)Z = q(A) + q₀GH.
inline bool dare_two_states(TwoByTwo A, TwoByTwo G, TwoByTwo H, double* X) {
  const TwoByTwo P = A - identity_times(1.0);
  const double at_one = even_determinant(P, G, H);
  const double at_minus_one = even_determinant(A + identity_times(1.0), G, H);
  if (!(at_one > 0.0 && at_minus_one > 0.0)) {
    return false;
  }
  const double plus = std::sqrt(at_one);
  const double minus = std::sqrt(at_minus_one);
  const TwoByTwo adjugate = A.adjugate();
  const double one_less_det = -(P.trace() + P.determinant());
  const double discriminant = (A.a - A.d) * (A.a - A.d) + 4.0 * A.b * A.c;  // tr² - 4 det
  const double square =
      0.5 * (one_less_det * one_less_det + discriminant + H.determinant() * G.determinant() +
             trace_of_product(adjugate.transposed() * H, adjugate * G) + trace_of_product(G, H) +
             plus * minus);
  if (!(square > 0.0)) {
    return false;
  }
  const double difference = std::sqrt(square);  // ρ(1 - q₀)
  const double rho = 0.5 * (0.5 * (plus + minus) + difference);
  const double one_less_q0 = difference / rho;
  const double q0 = 1.0 - one_less_q0;
  const double q_at_one = plus / rho;  // 1 + q₁ + q₀
  const TwoByTwo PG = P * G;
  const TwoByTwo left = one_less_q0 * G + PG - q0 * PG.transposed();
  // q(A) = q(1)I + (1 + q(1) - q₀)P + P², and P² = tr(P)P - det(P)I.
  const TwoByTwo right = (P.trace() + q_at_one + one_less_q0) * P +
                         identity_times(q_at_one - P.determinant()) + q0 * (G * H);
  const TwoByTwo Z = (1.0 / left.determinant()) * (left.adjugate() * right);
  const TwoByTwo solution = H + A.transposed() * Z;
  X[0] = solution.a;
  X[1] = X[2] = 0.5 * (solution.b + solution.c);
  X[3] = solution.d;
  return std::isfinite(X[0] + X[1] + X[3]);
}

}  // namespace flyball::detail::FLYBALL_VARIANT
