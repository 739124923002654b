#pragma once

// The second half of the kernel, from X to the gain, the residual and the poles; see
// riccati_kernel_body.hpp.

#include "math/riccati/riccati_kernel_body.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

template <int N>
inline bool Kernel<N>::close_loop() {
  double* const At = At_;
  double* const V = V_;
  double* const W = W_;
  double* const X = X_;
  double* const A0 = A0_;
  double* const B = B_;
  double* const R = R_;
  double* const K = K_;
  double* const AXB = AXB_;
  double* const T = T_;
  double* const next = next_;
  const int n = n_();
  const int m = data_.inputs;
  const bool continuous = data_.continuous;
  double* const XB = F_;
  multiply(n_, XB, ld(), X, ld(), B, ld(), n, m);
  pad_symmetric(R, ldm(), data_.R, m);
  if (!continuous) {
    multiply<0, Product::add>(msize_, R, ldm(), Bt_, ldm(), XB, ld(), n, m);
  }
  if (!cholesky(R, ldm(), m)) {
    return false;
  }
  for (int k = 0; k < size(); ++k) {
    At[k] = 0.0;
  }
  transpose(n_, At, A0);
  if (continuous) {
    for (int k = 0; k < ld() * m; ++k) {
      AXB[k] = XB[k];
    }
  } else {
    multiply(n_, AXB, ld(), At, ld(), XB, ld(), n, m);
  }
  if (data_.N != nullptr) {
    for (int j = 0; j < m; ++j) {
      for (int i = 0; i < n; ++i) {
        AXB[i + j * ld()] += data_.N[i + j * n];
      }
    }
  }
  // Z = (AᵀXB + N)L⁻ᵀ, so that the feedback term is ZZᵀ and K = L⁻ᵀZᵀ.
  divide_by_transposed(AXB, ld(), R, ldm(), m);
  for (int j = 0; j < n; ++j) {
    for (int i = m - 1; i >= 0; --i) {
      double entry = AXB[j + i * ld()];
      for (int k = i + 1; k < m; ++k) {
        entry -= R[k + i * ldm()] * K[k + j * ldm()];
      }
      K[i + j * ldm()] = entry / R[i + i * ldm()];
      answer_.K[i + j * m] = K[i + j * ldm()];
    }
    for (int i = m; i < ldm(); ++i) {
      K[i + j * ldm()] = 0.0;
    }
  }
  for (int k = 0; k < size(); ++k) {
    W[k] = 0.0;
    V[k] = A0[k];
  }
  // Of F the part linear in X: AᵀXA, or AᵀX, to which its transpose belongs.
  if (continuous) {
    square(next, At, X);
  } else {
    square(T, X, A0);
    multiply<N, Product::assign, true>(n_, next, ld(), At, ld(), T, ld(), n, n);
  }
  outer(n_, W, 1.0, AXB, AXB, m);
  multiply<N, Product::subtract>(n_, V, ld(), B, ld(), K, ldm(), m, n);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      answer_.X[i + j * n] = X[i + j * ld()];
    }
  }
  if (!scale_states()) {
    return false;
  }
  measure();
  return true;
}

template <int N>
inline bool Kernel<N>::scale_states() {
  double* const V = V_;
  double* const X = X_;
  const int n = n_();
  double* const d = Y_;  // n <= ld·m
  double* const d_inverse = T_;
  d_ = d;
  d_inverse_ = d_inverse;
  double largest = 0.0;
  double least = 0.0;
  for (int i = 0; i < n; ++i) {
    largest = std::max(largest, X[i + i * ld()]);
    least = std::min(least, X[i + i * ld()]);
  }
  // Of an X that is indefinite the diagonal gives no units.
  if (least < -1e-8 * largest) {
    return false;
  }
  for (int i = 0; i < n; ++i) {
    d[i] = std::sqrt(std::max(X[i + i * ld()], 1e-16 * largest));
    if (!(d[i] > 0.0)) {
      d[i] = 1.0;
    }
    d_inverse[i] = 1.0 / d[i];
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      V[i + j * ld()] *= d[i] * d_inverse[j];
    }
  }
  return true;
}

template <int N>
inline void Kernel<N>::measure() {
  double* const X = X_;
  double* const W = W_;
  double* const next = next_;
  double* const Q = Q_;
  const int n = n_();
  const bool continuous = data_.continuous;
  const double* const d_inverse = d_inverse_;
  double defect = 0.0;
  double size_AXA = 0.0;
  double size_Q = 0.0;
  double size_X = 0.0;
  double size_W = 0.0;
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) {
      const double unit = d_inverse[i] * d_inverse[j];
      const double weight = i == j ? 1.0 : 2.0;
      const double x = unit * X[i + j * ld()];
      const double w = unit * W[i + j * ld()];
      const double axa =
          unit * (continuous ? next[i + j * ld()] + next[j + i * ld()] : next[i + j * ld()]);
      const double q = unit * Q[i + j * ld()];
      const double entry = (continuous ? axa : axa - x) - w + q;
      defect += weight * entry * entry;
      size_AXA += weight * axa * axa;
      size_Q += weight * q * q;
      size_X += weight * x * x;
      size_W += weight * w * w;
    }
  }
  defect_ = std::sqrt(defect);
  size_X_ = std::sqrt(size_X);
  scale_ =
      std::sqrt(size_AXA) + (continuous ? 0.0 : size_X_) + std::sqrt(size_W) + std::sqrt(size_Q);
  answer_.residual = scale_ > 0.0 ? defect_ / scale_ : 0.0;
}

template <int N>
inline double Kernel<N>::refine(ClosedLoop<N>& loop) {
  const int n = n_();
  double* const D = next_;
  if (!riccati_residual(data_, answer_.X, answer_.K, W_)) {
    return std::numeric_limits<double>::infinity();
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      D[i + j * ld()] = 0.5 * (W_[i + j * n] + W_[j + i * n]) / (d_[i] * d_[j]);
    }
    for (int i = n; i < ld(); ++i) {
      D[i + j * ld()] = 0.0;
    }
  }
  if (!loop.solve(D)) {
    return std::numeric_limits<double>::infinity();
  }
  const double step = std::sqrt(squared_norm(n_, D, n));
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      X_[i + j * ld()] += 0.5 * (D[i + j * ld()] + D[j + i * ld()]) * (d_[i] * d_[j]);
    }
  }
  return step;
}

template <int N>
inline bool Kernel<N>::check_poles() {
  if (!eigenvalues(n_, V_, answer_.poles)) {
    return false;
  }
  for (int i = 0; i < n_(); ++i) {
    const bool stable =
        data_.continuous ? answer_.poles[i].real() < 0.0 : std::norm(answer_.poles[i]) < 1.0;
    if (!stable) {
      return false;
    }
  }
  return true;
}

}  // namespace flyball::detail::FLYBALL_VARIANT
