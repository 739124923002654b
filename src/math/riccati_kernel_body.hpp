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

/// The symmetric solution of X = AᵀXA + C or of AᵀX + XA + C = 0 for two states, by its three
/// equations; false where they are singular.
inline bool lyapunov_2x2(bool continuous, const double* A, const double* C, double* X) {
  const double a = A[0];
  const double c = A[1];
  const double b = A[2];
  const double d = A[3];
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

/// The Lyapunov operator of a closed loop, L(X) = X - SᵀXS or -(SᵀX + XS), whose inverse takes
/// defects to errors. The continuous one becomes a discrete one by the Cayley transform
/// A = (S - γI)⁻¹(S + γI) = I + 2γM, M = (S - γI)⁻¹: L⁻¹(C) = Σ (Aᵏ)ᵀ(2γ MᵀCM)Aᵏ.
template <int N>
class ClosedLoop {
 public:
  /// `work` holds six matrices; S is kept.
  ClosedLoop(Size<N> n, bool continuous, const double* S, double* work, int* pivots)
      : n_(n), continuous_(continuous), S_(S), work_(work), A_(S) {
    if (n() == 2 || !continuous) {
      return;
    }
    const int size = n.padded() * n();
    double* const M = take(0);
    double* const A = take(1);
    gamma_ = std::sqrt(squared_norm(n, S, n()) / n());
    for (int k = 0; k < size; ++k) {
      M[k] = S[k];
    }
    add_diagonal(n, M, -gamma_);
    valid_ = gamma_ > 0.0 && invert(n, M, pivots);
    for (int k = 0; k < size; ++k) {
      A[k] = 2.0 * gamma_ * M[k];
    }
    add_diagonal(n, A, 1.0);
    M_ = M;
    A_ = A;
  }

  /// An estimate of trace(L⁻¹(I)), a bound of ‖L⁻¹‖: exact for few states, from four vectors of
  /// signs else (Hutchinson); infinite where the powers of A do not fade.
  double gain() {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!valid_) {
      return infinity;
    }
    if (n_() <= 4) {
      double C[16] = {};
      const int ld = n_.padded();
      for (int i = 0; i < n_(); ++i) {
        C[i + i * ld] = 1.0;
      }
      if (!solve(C)) {
        return infinity;
      }
      double trace = 0.0;
      for (int i = 0; i < n_(); ++i) {
        if (!(C[i + i * ld] > 0.0)) {
          return infinity;
        }
        trace += C[i + i * ld];
      }
      return trace;
    }
    return sampled_gain();
  }

  /// C ← L⁻¹(C), C symmetric; false where the powers of A do not fade.
  bool solve(double* C) {
    if (!valid_) {
      return false;
    }
    if (n_() == 2) {
      double X[4];
      const bool solved = lyapunov_2x2(continuous_, S_, C, X);
      for (int k = 0; k < 4; ++k) {
        C[k] = X[k];
      }
      return solved;
    }
    const int ld = n_.padded();
    const int size = ld * n_();
    double* A = take(2);
    double* T = take(3);
    double* const At = take(4);
    for (int k = 0; k < size; ++k) {
      At[k] = 0.0;
    }
    if (continuous_) {
      congruence(C, M_, At, T);
      for (int k = 0; k < size; ++k) {
        C[k] *= 2.0 * gamma_;
      }
    }
    for (int k = 0; k < size; ++k) {
      A[k] = A_[k];
    }
    double* const term = take(5);
    for (int k = 0; k < 50; ++k) {
      for (int i = 0; i < size; ++i) {
        term[i] = C[i];
      }
      congruence(term, A, At, T);
      for (int i = 0; i < size; ++i) {
        C[i] += term[i];
      }
      const double power = squared_norm(n_, A, n_());
      if (!(power < 1e300)) {
        return false;
      }
      if (power < 1e-17) {
        return true;
      }
      multiply(n_, T, ld, A, ld, A, ld, n_(), n_());
      double* const swapped = A;
      A = T;
      T = swapped;
    }
    return false;
  }

 private:
  double* take(int index) const { return work_ + index * n_.padded() * n_(); }

  static void add_diagonal(Size<N> n, double* M, double value) {
    for (int i = 0; i < n(); ++i) {
      M[i + i * n.padded()] += value;
    }
  }

  /// C ← MᵀCM.
  void congruence(double* C, const double* M, double* Mt, double* work) const {
    const int ld = n_.padded();
    transpose(n_, Mt, M);
    multiply(n_, work, ld, C, ld, M, ld, n_(), n_());
    multiply(n_, C, ld, Mt, ld, work, ld, n_(), n_());
  }

  double sampled_gain() {
    const int ld = n_.padded();
    double* y = take(2);
    double* next = y + 4 * ld;
    std::uint64_t bits = 0x9E3779B97F4A7C15U;
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < ld; ++i) {
        bits ^= bits << 13U;
        bits ^= bits >> 7U;
        bits ^= bits << 17U;
        y[i + j * ld] = i < n_() ? ((bits & 1U) != 0U ? 1.0 : -1.0) : 0.0;
      }
    }
    const auto advance = [&](const double* M) {
      multiply(n_, next, ld, M, ld, y, ld, n_(), 4);
      double* const swapped = y;
      y = next;
      next = swapped;
      return squared_norm(n_, y, 4);
    };
    double sum = 4.0 * n_();
    double unit = 1.0;
    if (continuous_) {
      unit = 2.0 * gamma_;
      sum = advance(M_);
    }
    for (int k = 0; k < 2000; ++k) {
      const double norm = advance(A_);
      sum += norm;
      if (norm < 1e-3 * sum) {
        return 0.25 * sum * unit;
      }
    }
    return std::numeric_limits<double>::infinity();
  }

  Size<N> n_;
  bool continuous_;
  bool valid_ = true;
  double gamma_ = 0.0;
  const double* S_;
  double* work_;
  const double* A_;
  const double* M_ = nullptr;
};

/// The whole of one solution, in one block of memory.
template <int N>
class Kernel {
 public:
  Kernel(const RiccatiData& data, RiccatiAnswer& answer, double* memory, int* pivots)
      : data_(data),
        answer_(answer),
        n_{data.states},
        msize_{data.inputs},
        pivots_(pivots),
        work_(memory) {}

  bool run() {
    if (!load() || (data_.continuous && !cayley()) || !doubling() || !close_loop()) {
      return false;
    }
    for (int refinements = 0;; ++refinements) {
      ClosedLoop<N> loop(n_, data_.continuous, V_, A_, pivots_);  // overwrites A, G, H, W, T, At
      const double gain = loop.gain();
      const double bound = epsilon * size_X_;
      // The computed defect itself is rounded by about eps times the terms.
      const double error = gain * (defect_ + epsilon * scale_);
      answer_.condition = gain * scale_ / size_X_;
      if (refinements == 0 && error <= 250.0 * n_() * bound) {
        break;
      }
      if (refinements == 4 || !(answer_.condition < 1e11)) {
        return false;
      }
      const double step = refine(loop);
      if (!(step <= 1e-2 * size_X_) || !close_loop()) {
        return false;
      }
      // What a step leaves is its square and its rounding, both times the condition.
      if (step * answer_.condition * (step / size_X_ + epsilon) <= bound) {
        break;
      }
    }
    return check_poles();
  }

 private:
  [[nodiscard]] int ld() const { return n_.padded(); }
  [[nodiscard]] int ldm() const { return msize_.padded(); }
  [[nodiscard]] int size() const { return ld() * n_(); }

  bool load() {
    const int n = n_();
    const int m = data_.inputs;
    for (double** matrix : {&A_, &G_, &H_, &W_, &T_, &At_, &V_, &next_, &A0_, &Q_, &X_}) {
      *matrix = work_.take(size());
    }
    for (double** matrix : {&B_, &F_, &Y_, &AXB_}) {
      *matrix = work_.take(ld() * m);
    }
    R_ = work_.take(ldm() * m);
    K_ = work_.take(ldm() * n);
    Bt_ = work_.take(ldm() * n);
    pad(A0_, ld(), data_.A, n, n);
    pad(B_, ld(), data_.B, n, m);
    pad_symmetric(Q_, ld(), data_.Q, n);
    pad_symmetric(R_, ldm(), data_.R, m);
    if (!cholesky(R_, ldm(), m)) {
      return false;
    }
    for (int k = 0; k < size(); ++k) {
      A_[k] = A0_[k];
      G_[k] = 0.0;
      H_[k] = Q_[k];
      At_[k] = 0.0;
    }
    for (int k = 0; k < ld() * m; ++k) {
      F_[k] = B_[k];
    }
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < ldm(); ++i) {
        Bt_[i + j * ldm()] = i < m ? B_[j + i * ld()] : 0.0;
      }
    }
    // G = B R⁻¹Bᵀ, A ← A - B R⁻¹Nᵀ, H = Q - N R⁻¹Nᵀ.
    divide_by_transposed(F_, ld(), R_, ldm(), m);
    outer(n_, G_, 1.0, F_, F_, m);
    if (data_.N != nullptr) {
      pad(Y_, ld(), data_.N, n, m);
      divide_by_transposed(Y_, ld(), R_, ldm(), m);
      outer(n_, A_, -1.0, F_, Y_, m);
      outer(n_, H_, -1.0, Y_, Y_, m);
    }
    return true;
  }

  void square(double* C, const double* A, const double* B) const {
    multiply(n_, C, ld(), A, ld(), B, ld(), n_(), n_());
  }

  /// With A_γ = A - γI and W = A_γᵀ + H A_γ⁻¹G the discrete equation with
  ///   A = I + 2γ W⁻ᵀ,  G = 2γ A_γ⁻¹G W⁻¹,  H = 2γ W⁻¹H A_γ⁻¹
  /// has the same X (Chu, Fan and Lin 2005).
  bool cayley() {
    const int n = n_();
    const double norms = std::sqrt(squared_norm(n_, A_, n)) +
                         std::sqrt(std::sqrt(squared_norm(n_, G_, n) * squared_norm(n_, H_, n)));
    const double gamma = norms / std::sqrt(static_cast<double>(n));
    if (!(gamma > 0.0 && gamma < 1e150)) {
      return false;
    }
    for (int i = 0; i < n; ++i) {
      A_[i + i * ld()] -= gamma;
    }
    transpose(n_, At_, A_);
    double* const inverse = A_;
    if (!invert(n_, inverse, pivots_)) {
      return false;
    }
    square(T_, inverse, G_);  // A_γ⁻¹G
    square(W_, H_, T_);
    for (int k = 0; k < size(); ++k) {
      W_[k] += At_[k];
    }
    if (!invert(n_, W_, pivots_)) {
      return false;
    }
    square(G_, T_, W_);
    square(T_, W_, H_);
    square(H_, T_, inverse);
    transpose(n_, A_, W_);
    for (double* matrix : {A_, G_, H_}) {
      for (int k = 0; k < size(); ++k) {
        matrix[k] *= 2.0 * gamma;
      }
    }
    for (int i = 0; i < n; ++i) {
      A_[i + i * ld()] += 1.0;
    }
    mirror(n_, G_);
    mirror(n_, H_);
    return true;
  }

  /// With S = A - BK, V = (I + GH)⁻¹A tends to S^(2ᵏ), and what is missing in H after a step is
  /// Vᵀ(that step)V: the last step needs no new A and G.
  bool doubling() {
    // Locals: stores of vectors may alias everything, members too.
    double* const A = A_;
    double* const G = G_;
    double* const H = H_;
    double* const W = W_;
    double* const T = T_;
    double* const At = At_;
    double* const V = V_;
    double* const next = next_;
    const int n = n_();
    for (answer_.iterations = 1; answer_.iterations <= 40; ++answer_.iterations) {
      square(W, G, H);
      for (int i = 0; i < n; ++i) {
        W[i + i * ld()] += 1.0;
      }
      if (!invert(n_, W, pivots_)) {
        return false;
      }
      square(V, W, A);
      square(T, H, V);
      transpose(n_, At, A);
      multiply<N, Product::assign, true>(n_, next, ld(), At, ld(), T, ld(), n, n);
      mirror(n_, next);
      for (int k = 0; k < size(); ++k) {
        H[k] += next[k];
      }
      const double step = squared_norm(n_, next, n);
      const double total = squared_norm(n_, H, n);
      const double power = squared_norm(n_, V, n);
      if (!(step + total + power < 1e300)) {
        return false;
      }
      if (step * power * power <= epsilon * epsilon * total) {
        for (int k = 0; k < size(); ++k) {
          X_[k] = H[k];
        }
        return true;
      }
      multiply<N, Product::assign, true>(n_, T, ld(), W, ld(), G, ld(), n, n);
      mirror(n_, T);
      square(W, A, T);
      multiply<N, Product::add, true>(n_, G, ld(), W, ld(), At, ld(), n, n);
      mirror(n_, G);
      square(T, A, V);
      for (int k = 0; k < size(); ++k) {
        A[k] = T[k];
      }
    }
    return false;
  }

  /// K and F(X) from the data as it was given, in the coordinates of `scale_states`.
  bool close_loop() {
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
    scale_states();
    measure();
    return true;
  }

  /// Errors are measured in the coordinates Dx, d = √X_ii, in which X has a unit diagonal: states
  /// in other units (metres beside metres per second) must not make the answer look worse than it
  /// is.
  void scale_states() {
    double* const V = V_;
    double* const X = X_;
    const int n = n_();
    double* const d = Y_;  // n <= ld·m
    double* const d_inverse = T_;
    d_ = d;
    d_inverse_ = d_inverse;
    double largest = 0.0;
    for (int i = 0; i < n; ++i) {
      largest = std::max(largest, X[i + i * ld()]);
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
  }

  void measure() {
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
        const double weight = i == j ? unit * unit : 2.0 * unit * unit;
        const double x = X[i + j * ld()];
        const double w = W[i + j * ld()];
        const double axa =
            continuous ? next[i + j * ld()] + next[j + i * ld()] : next[i + j * ld()];
        const double q = Q[i + j * ld()];
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

  /// One step of Newton's method with the residual in twice the working precision; its norm in the
  /// coordinates of `scale_states`.
  double refine(ClosedLoop<N>& loop) {
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

  bool check_poles() {
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

  const RiccatiData& data_;
  RiccatiAnswer& answer_;
  Size<N> n_;
  Size<0> msize_;
  int* pivots_;
  Workspace work_;
  // A, G, H, W, T and At lie side by side: the closed loop's operator takes their place.
  double *A_, *G_, *H_, *W_, *T_, *At_, *V_, *next_, *A0_, *Q_, *X_;
  double *B_, *F_, *Y_, *AXB_, *R_, *K_, *Bt_;
  double* d_ = nullptr;
  double* d_inverse_ = nullptr;
  double defect_ = 0.0;
  double scale_ = 0.0;
  double size_X_ = 0.0;
};

template <int N>
inline bool solve_on_stack(const RiccatiData& data, RiccatiAnswer& answer) {
  constexpr int largest = N > 0 ? N : kernel_stack_states;
  alignas(32) double memory[kernel_workspace(largest, largest)];
  int pivots[largest];
  return Kernel<N>(data, answer, memory, pivots).run();
}

bool solve_riccati(const RiccatiData& data, RiccatiAnswer& answer, double* memory, int* pivots) {
  if (memory != nullptr) {
    return Kernel<0>(data, answer, memory, pivots).run();
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
