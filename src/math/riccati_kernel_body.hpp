#pragma once

// The kernel of riccati_kernel.hpp for one instruction set: the including source has chosen
// FLYBALL_VARIANT and included what stands in the standard library.

#include "math/small_matrix.hpp"
//
#include "math/hessenberg_eigenvalues.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// Cuts one block of memory into padded matrices.
class Workspace {
 public:
  explicit Workspace(double* memory) : next_(memory) {}
  double* take(int count) {
    double* const taken = next_;
    next_ += count;
    return taken;
  }

 private:
  double* next_;
};

/// Columns with gaps of zeros between them.
inline void pad(double* to, int ld, const double* from, int rows, int columns) {
  for (int j = 0; j < columns; ++j) {
    for (int i = 0; i < rows; ++i) {
      to[i + j * ld] = from[i + j * rows];
    }
    for (int i = rows; i < ld; ++i) {
      to[i + j * ld] = 0.0;
    }
  }
}

/// The symmetric part of S, padded likewise.
inline void pad_symmetric(double* to, int ld, const double* from, int n) {
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      to[i + j * ld] = 0.5 * (from[i + j * n] + from[j + i * n]);
    }
    for (int i = n; i < ld; ++i) {
      to[i + j * ld] = 0.0;
    }
  }
}

/// R = LLᵀ in the lower triangle; false where R is not safely positive definite.
inline bool cholesky(double* R, int ld, int m) {
  double smallest = std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (int j = 0; j < m; ++j) {
    double pivot = R[j + j * ld];
    for (int k = 0; k < j; ++k) {
      pivot -= R[j + k * ld] * R[j + k * ld];
    }
    smallest = pivot < smallest ? pivot : smallest;
    largest = pivot > largest ? pivot : largest;
    if (!(pivot > 0.0)) {
      return false;
    }
    const double root = std::sqrt(pivot);
    const double inverse = 1.0 / root;
    R[j + j * ld] = root;
    for (int i = j + 1; i < m; ++i) {
      double entry = R[i + j * ld];
      for (int k = 0; k < j; ++k) {
        entry -= R[i + k * ld] * R[j + k * ld];
      }
      R[i + j * ld] = entry * inverse;
    }
  }
  return smallest > 1e-10 * largest;
}

/// F ← F L⁻ᵀ, F with `ld` rows and m columns.
inline void divide_by_transposed(double* F, int ld, const double* L, int ldl, int m) {
  for (int j = 0; j < m; ++j) {
    for (int k = 0; k < j; ++k) {
      const double factor = L[j + k * ldl];
      for (int i = 0; i < ld; ++i) {
        F[i + j * ld] -= F[i + k * ld] * factor;
      }
    }
    const double inverse = 1.0 / L[j + j * ldl];
    for (int i = 0; i < ld; ++i) {
      F[i + j * ld] *= inverse;
    }
  }
}

/// C (+ or -)= F Gᵀ for F, G with m columns.
template <int N>
inline void outer(Size<N> n, double* C, double sign, const double* F, const double* G, int m) {
  const int ld = n.padded();
  for (int j = 0; j < n(); ++j) {
    for (int k = 0; k < m; ++k) {
      const double factor = sign * G[j + k * ld];
      for (int i = 0; i < ld; ++i) {
        C[i + j * ld] += F[i + k * ld] * factor;
      }
    }
  }
}

/// An estimate of trace(Σ (Aᵏ)ᵀAᵏ), a bound of ‖L⁻¹‖ for L(X) = X - AᵀXA: exact by doubling for few
/// states, from four vectors of signs else (Hutchinson); infinite where the powers do not fade.
template <int N>
inline double stein_gain(Size<N> n, const double* A, double* work) {
  const int ld = n.padded();
  const int size = ld * n();
  if (n() <= 4) {
    double* P = work;
    double* S = work + size;
    double* T = work + 2 * size;
    double* St = work + 3 * size;
    for (int k = 0; k < size; ++k) {
      P[k] = 0.0;
      S[k] = A[k];
      St[k] = 0.0;
    }
    for (int i = 0; i < n(); ++i) {
      P[i + i * ld] = 1.0;
    }
    for (int k = 0; k < 40; ++k) {
      transpose(n, St, S);
      multiply(n, T, ld, P, ld, S, ld, n(), n());
      multiply<N, Product::add>(n, P, ld, St, ld, T, ld, n(), n());
      multiply(n, T, ld, S, ld, S, ld, n(), n());
      double* const swapped = S;
      S = T;
      T = swapped;
      const double power = squared_norm(n, S, n());
      if (power < 0.1) {
        double trace = 0.0;
        for (int i = 0; i < n(); ++i) {
          trace += P[i + i * ld];
        }
        return trace / (1.0 - power);
      }
    }
    return std::numeric_limits<double>::infinity();
  }
  double* y = work;
  double* next = work + 4 * ld;
  std::uint64_t bits = 0x9E3779B97F4A7C15U;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < ld; ++i) {
      bits ^= bits << 13U;
      bits ^= bits >> 7U;
      bits ^= bits << 17U;
      y[i + j * ld] = i < n() ? ((bits & 1U) != 0U ? 1.0 : -1.0) : 0.0;
    }
  }
  double sum = 4.0 * n();
  for (int k = 0; k < 2000; ++k) {
    multiply(n, next, ld, A, ld, y, ld, n(), 4);
    double* const swapped = y;
    y = next;
    next = swapped;
    const double norm = squared_norm(n, y, 4);
    sum += norm;
    if (norm < 1e-3 * sum) {
      return 0.25 * sum;
    }
  }
  return std::numeric_limits<double>::infinity();
}

template <int N>
inline bool solve(const RiccatiData& data, RiccatiAnswer& answer, double* memory, int* pivots) {
  const Size<N> n{data.states};
  const int m = data.inputs;
  const Size<0> msize{m};
  const int ld = n.padded();
  const int ldm = msize.padded();
  const int size = ld * n();
  Workspace work(memory);
  double* const A0 = work.take(size);
  double* const A = work.take(size);
  double* const G = work.take(size);
  double* const H = work.take(size);
  double* const W = work.take(size);
  double* const V = work.take(size);
  double* const T = work.take(size);
  double* const At = work.take(size);
  double* const next = work.take(size);
  double* const Q = work.take(size);
  double* const B = work.take(ld * m);
  double* const F = work.take(ld * m);
  double* const Y = work.take(ld * m);
  double* const AXB = work.take(ld * m);
  double* const R = work.take(ldm * m);
  double* const K = work.take(ldm * n());
  double* const Bt = work.take(ldm * n());

  pad(A0, ld, data.A, n(), n());
  pad(B, ld, data.B, n(), m);
  pad_symmetric(Q, ld, data.Q, n());
  pad_symmetric(R, ldm, data.R, m);
  if (!cholesky(R, ldm, m)) {
    return false;
  }
  for (int k = 0; k < size; ++k) {
    A[k] = A0[k];
    G[k] = 0.0;
    H[k] = Q[k];
    At[k] = 0.0;
  }
  for (int k = 0; k < ld * m; ++k) {
    F[k] = B[k];
  }
  // G = B R⁻¹Bᵀ, A ← A - B R⁻¹Nᵀ, H = Q - N R⁻¹Nᵀ.
  divide_by_transposed(F, ld, R, ldm, m);
  outer(n, G, 1.0, F, F, m);
  if (data.N != nullptr) {
    pad(Y, ld, data.N, n(), m);
    divide_by_transposed(Y, ld, R, ldm, m);
    outer(n, A, -1.0, F, Y, m);
    outer(n, H, -1.0, Y, Y, m);
  }

  // Doubling. With S = A - BK, V = (I + GH)⁻¹A tends to S^(2ᵏ), and what is missing in H after a
  // step is Vᵀ(that step)V: the last step needs no new A and G.
  bool converged = false;
  int iterations = 0;
  while (!converged && iterations < 40) {
    ++iterations;
    multiply(n, W, ld, G, ld, H, ld, n(), n());
    for (int i = 0; i < n(); ++i) {
      W[i + i * ld] += 1.0;
    }
    if (!invert(n, W, pivots)) {
      return false;
    }
    multiply(n, V, ld, W, ld, A, ld, n(), n());
    multiply(n, T, ld, H, ld, V, ld, n(), n());
    transpose(n, At, A);
    multiply<N, Product::assign, true>(n, next, ld, At, ld, T, ld, n(), n());
    mirror(n, next);
    for (int k = 0; k < size; ++k) {
      H[k] += next[k];
    }
    const double step = squared_norm(n, next, n());
    const double total = squared_norm(n, H, n());
    const double power = squared_norm(n, V, n());
    if (!(step + total + power < 1e300)) {
      return false;
    }
    converged = step * power * power <= epsilon * epsilon * total;
    if (!converged) {
      multiply<N, Product::assign, true>(n, T, ld, W, ld, G, ld, n(), n());
      mirror(n, T);
      multiply(n, W, ld, A, ld, T, ld, n(), n());
      multiply<N, Product::add, true>(n, G, ld, W, ld, At, ld, n(), n());
      mirror(n, G);
      multiply(n, T, ld, A, ld, V, ld, n(), n());
      for (int k = 0; k < size; ++k) {
        A[k] = T[k];
      }
    }
  }
  if (!converged) {
    return false;
  }

  // K = (R + BᵀXB)⁻¹(BᵀXA + Nᵀ) and F(X) from the data as it was given.
  double* const XA = T;
  double* const XB = F;
  multiply(n, XA, ld, H, ld, A0, ld, n(), n());
  multiply(n, XB, ld, H, ld, B, ld, n(), m);
  for (int j = 0; j < n(); ++j) {
    for (int i = 0; i < ldm; ++i) {
      Bt[i + j * ldm] = i < m ? B[j + i * ld] : 0.0;
    }
  }
  pad_symmetric(R, ldm, data.R, m);
  multiply<0, Product::add>(msize, R, ldm, Bt, ldm, XB, ld, n(), m);
  if (!cholesky(R, ldm, m)) {
    return false;
  }
  transpose(n, At, A0);
  multiply(n, AXB, ld, At, ld, XB, ld, n(), m);
  if (data.N != nullptr) {
    for (int j = 0; j < m; ++j) {
      for (int i = 0; i < n(); ++i) {
        AXB[i + j * ld] += data.N[i + j * n()];
      }
    }
  }
  // Z = (AᵀXB + N)L⁻ᵀ, so that the feedback term is ZZᵀ and K = L⁻ᵀZᵀ.
  divide_by_transposed(AXB, ld, R, ldm, m);
  for (int j = 0; j < n(); ++j) {
    for (int i = m - 1; i >= 0; --i) {
      double entry = AXB[j + i * ld];
      for (int k = i + 1; k < m; ++k) {
        entry -= R[k + i * ldm] * K[k + j * ldm];
      }
      K[i + j * ldm] = entry / R[i + i * ldm];
    }
    for (int i = m; i < ldm; ++i) {
      K[i + j * ldm] = 0.0;
    }
  }
  for (int k = 0; k < size; ++k) {
    W[k] = 0.0;
    V[k] = A0[k];
  }
  multiply<N, Product::assign, true>(n, next, ld, At, ld, XA, ld, n(), n());
  outer(n, W, 1.0, AXB, AXB, m);
  multiply<N, Product::subtract>(n, V, ld, B, ld, K, ldm, m, n());
  // Errors are measured in the coordinates Dx, d = √X_ii, in which X has a unit diagonal: states in
  // other units (metres beside metres per second) must not make the answer look worse than it is.
  double* const d = T;
  double* const d_inverse = At;
  double largest = 0.0;
  for (int i = 0; i < n(); ++i) {
    largest = std::max(largest, H[i + i * ld]);
  }
  for (int i = 0; i < n(); ++i) {
    d[i] = std::sqrt(std::max(H[i + i * ld], 1e-16 * largest));
    if (!(d[i] > 0.0)) {
      d[i] = 1.0;
    }
    d_inverse[i] = 1.0 / d[i];
  }
  double defect = 0.0;
  double size_AXA = 0.0;
  double size_Q = 0.0;
  double size_X = 0.0;
  double size_W = 0.0;
  for (int j = 0; j < n(); ++j) {
    for (int i = j; i < n(); ++i) {
      const double unit = d_inverse[i] * d_inverse[j];
      const double weight = i == j ? unit * unit : 2.0 * unit * unit;
      const double x = H[i + j * ld];
      const double w = W[i + j * ld];
      const double axa = next[i + j * ld];
      const double q = Q[i + j * ld];
      const double entry = axa - x - w + q;
      defect += weight * entry * entry;
      size_AXA += weight * axa * axa;
      size_Q += weight * q * q;
      size_X += weight * x * x;
      size_W += weight * w * w;
    }
  }
  for (int j = 0; j < n(); ++j) {
    for (int i = 0; i < n(); ++i) {
      V[i + j * ld] *= d[i] * d_inverse[j];
    }
  }
  defect = std::sqrt(defect);
  size_X = std::sqrt(size_X);
  const double scale = std::sqrt(size_AXA) + size_X + std::sqrt(size_W) + std::sqrt(size_Q);
  for (int j = 0; j < n(); ++j) {
    for (int i = 0; i < n(); ++i) {
      answer.X[i + j * n()] = H[i + j * ld];
    }
  }
  const double gain = stein_gain(n, V, A);  // takes the memory of A, G, H and W
  // The computed defect itself is rounded by about eps times the terms.
  const double error = gain * (defect + epsilon * scale);
  if (!(error <= 250.0 * n() * epsilon * size_X)) {
    return false;
  }

  for (int j = 0; j < n(); ++j) {
    for (int i = 0; i < m; ++i) {
      answer.K[i + j * m] = K[i + j * ldm];
    }
  }
  if (!eigenvalues(n, V, answer.poles)) {
    return false;
  }
  for (int i = 0; i < n(); ++i) {
    if (!(std::norm(answer.poles[i]) < 1.0)) {
      return false;
    }
  }
  answer.residual = scale > 0.0 ? defect / scale : 0.0;
  answer.condition = gain * scale / size_X;
  answer.iterations = iterations;
  return true;
}

template <int N>
inline bool solve_on_stack(const RiccatiData& data, RiccatiAnswer& answer) {
  constexpr int largest = N > 0 ? N : kernel_stack_states;
  alignas(32) double memory[kernel_workspace(largest, largest)];
  int pivots[largest];
  return solve<N>(data, answer, memory, pivots);
}

bool solve_riccati(const RiccatiData& data, RiccatiAnswer& answer, double* memory, int* pivots) {
  if (memory != nullptr) {
    return solve<0>(data, answer, memory, pivots);
  }
  switch (data.states) {
    case 1:
      return solve_on_stack<1>(data, answer);
    case 2:
      return solve_on_stack<2>(data, answer);
    case 3:
      return solve_on_stack<3>(data, answer);
    case 4:
      return solve_on_stack<4>(data, answer);
    case 5:
      return solve_on_stack<5>(data, answer);
    case 10:
      return solve_on_stack<10>(data, answer);
    default:
      return solve_on_stack<0>(data, answer);
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
