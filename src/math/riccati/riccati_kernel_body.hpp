#pragma once

// The kernel of riccati_kernel.hpp for one instruction set: the including source has chosen
// FLYBALL_VARIANT and included what stands in the standard library.

#include "math/dense/gauss_jordan.hpp"
#include "math/dense/hessenberg_eigenvalues.hpp"
#include "math/dense/small_matrix.hpp"
#include "math/riccati/riccati_closed_loop.hpp"
#include "math/riccati/riccati_two_states.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// The whole of one solution, in one block of memory.
template <int N>
class Kernel {
 public:
  Kernel(const RiccatiData& data, RiccatiAnswer& answer, double* memory, int* pivots)
      : data_(data), answer_(answer), n_{data.states}, msize_{data.inputs}, pivots_(pivots) {
    allocate(Workspace(memory));
  }

  bool run() {
    if (!load()) {
      return false;
    }
    if constexpr (N == 2) {
      if (closed_form() && verify(50.0)) {
        return true;
      }
      load();
    }
    return (!data_.continuous || cayley()) && doubling() && verify(250.0 * n_());
  }

 private:
  /// The gain and the residual of X, corrected by Newton's method where they do not vouch for it to
  /// `allowed` roundings.
  bool verify(double allowed) {
    if (!close_loop()) {
      return false;
    }
    for (int refinements = 0;; ++refinements) {
      ClosedLoop<N> loop(n_, data_.continuous, V_, A_, pivots_);  // overwrites A, G, H, W, T, At
      const double gain = loop.gain();
      const double bound = epsilon * size_X_;
      // The computed defect itself is rounded by about eps times the terms.
      const double error = gain * (defect_ + epsilon * scale_);
      answer_.condition = size_X_ > 0.0 ? gain * scale_ / size_X_ : gain;
      if (refinements == 0 && error <= allowed * bound) {
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
        // Where XB cancels, K and with it the condition are not what X's exact ones are; near the
        // margin of stability the terms themselves cancel, which leaves up to 1e-11.
        if (!(answer_.residual <= largest_residual)) {
          if (n_() <= kernel_few_states) {
            return false;
          }
          // Products that cancel hide in doubles whether F is small. A further correction, by the
          // residual in twice the precision, that is no more than X's rounding shows it.
          if (refinements == 0 || !(step <= bound)) {
            continue;
          }
        }
        break;
      }
    }
    return check_poles();
  }

  [[nodiscard]] int ld() const { return n_.padded(); }
  [[nodiscard]] int ldm() const { return msize_.padded(); }
  [[nodiscard]] int size() const { return ld() * n_(); }

  void allocate(Workspace work) {
    const int n = n_();
    const int m = data_.inputs;
    for (double** matrix : {&A_, &G_, &H_, &W_, &T_, &At_, &V_, &next_, &A0_, &Q_, &X_}) {
      *matrix = work.take(size());
    }
    for (double** matrix : {&B_, &F_, &Y_, &AXB_}) {
      *matrix = work.take(ld() * m);
    }
    R_ = work.take(ldm() * m);
    K_ = work.take(ldm() * n);
    Bt_ = work.take(ldm() * n);
  }

  bool load() {
    const int n = n_();
    const int m = data_.inputs;
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

  bool closed_form() {
    const TwoByTwo A = TwoByTwo::from(A_);
    const TwoByTwo G = TwoByTwo::from(G_);
    const TwoByTwo H = TwoByTwo::from(H_);
    answer_.iterations = 0;
    return data_.continuous ? care_two_states(A, G, H, X_) : dare_two_states(A, G, H, X_);
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
  bool close_loop();
  /// Errors are measured in the coordinates Dx, d = √X_ii, in which X has a unit diagonal: states
  /// in other units (metres beside metres per second) must not make the answer look worse than it
  /// is. False where X has none.
  bool scale_states();
  void measure();
  /// One step of Newton's method with the residual in twice the working precision; its norm in the
  /// coordinates of `scale_states`.
  double refine(ClosedLoop<N>& loop);
  bool check_poles();

  const RiccatiData& data_;
  RiccatiAnswer& answer_;
  Size<N> n_;
  Size<0> msize_;
  int* pivots_;
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
