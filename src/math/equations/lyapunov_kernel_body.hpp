#pragma once

// The kernel of lyapunov_kernel.hpp for one instruction set; see riccati_kernel_body.hpp.

#include "math/dense/balance_small.hpp"
#include "math/dense/small_matrix.hpp"
#include "math/riccati/riccati_closed_loop.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

template <int N>
class StableLyapunov {
 public:
  StableLyapunov(const LyapunovData& data, LyapunovAnswer& answer, double* memory, int* pivots)
      : data_(data), answer_(answer), n_{data.states}, pivots_(pivots) {
    Workspace work(memory);
    loop_work_ = work.take(6 * size());
    powers_ = work.take(closed_loop_powers * size());
    for (double** matrix : {&S_, &C_, &X_, &F_, &T_}) {
      *matrix = work.take(size());
    }
    for (double** vector : {&d_, &rows_, &columns_}) {
      *vector = work.take(ld());
    }
  }

  bool run() {
    // The eigenvalues' sum tells of many an unstable A.
    double trace = 0.0;
    for (int i = 0; i < n_(); ++i) {
      trace += data_.A[i + i * n_()];
    }
    if (data_.continuous ? !(trace < 0.0) : !(std::abs(trace) < n_())) {
      return false;
    }
    load();
    ClosedLoop<N> loop(n_, data_.continuous, S_, loop_work_, pivots_, powers_);
    // A Schur form costs less than a series of many terms.
    if (n_() > 5 && !loop.fades_quickly()) {
      return false;
    }
    const double gain = loop.gain(1e10);
    copy(X_, C_);
    if (!std::isfinite(gain) || !loop.solve(X_)) {
      return false;
    }
    mirror(n_, X_);
    // One correction by the defect in twice the working precision, of which two digits do.
    defect_twice_precise();
    if (!loop.solve(F_, 1e-2)) {
      return false;
    }
    const double step = std::sqrt(squared_norm(n_, F_, n_()));
    for (int k = 0; k < size(); ++k) {
      X_[k] += F_[k];
    }
    const double defect = measure();
    const double error = gain * (defect + epsilon * scale_);
    answer_.condition = size_X_ > 0.0 ? std::max(1.0, gain * scale_ / size_X_) : gain;
    // Beyond, more corrections earn digits.
    if (!(answer_.condition < 1e4) || !(step <= 1e-10 * size_X_) ||
        !(error <= 250.0 * n_() * epsilon * size_X_) || !holds_by_entries() ||
        defect > 1e-6 * scale_) {
      return false;
    }
    for (int j = 0; j < n_(); ++j) {
      for (int i = 0; i < n_(); ++i) {
        answer_.X[i + j * n_()] = 0.5 * (X_[i + j * ld()] + X_[j + i * ld()]) * (d_[i] * d_[j]);
      }
    }
    return true;
  }

 private:
  [[nodiscard]] int ld() const { return n_.padded(); }
  [[nodiscard]] int size() const { return ld() * n_(); }
  void copy(double* to, const double* from) const {
    for (int k = 0; k < size(); ++k) {
      to[k] = from[k];
    }
  }

  /// S = (D⁻¹AD)ᵀ and C = D⁻¹QD⁻¹.
  void load() {
    const int n = n_();
    pad(T_, ld(), data_.A, n, n);
    balance(n_, T_, d_, rows_, columns_);
    for (int k = 0; k < size(); ++k) {
      S_[k] = 0.0;
      C_[k] = 0.0;
    }
    transpose(n_, S_, T_);
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        C_[i + j * ld()] = 0.5 * (data_.Q[i + j * n] + data_.Q[j + i * n]) / (d_[i] * d_[j]);
      }
    }
  }

  /// F = C - L(X), summed in twice the working precision.
  void defect_twice_precise() {
    const int n = n_();
    if constexpr (N == 2 || N == 0) {
      if (n <= 2) {
        // Of two states the rows are padded to two; wanted are four.
        double A[8] = {};
        double S[8] = {};
        double X[8] = {};
        double C[8] = {};
        double R[8];
        double work[24];
        for (int j = 0; j < n; ++j) {
          for (int i = 0; i < n; ++i) {
            A[i + 4 * j] = S_[j + 2 * i];
            S[i + 4 * j] = S_[i + 2 * j];
            X[i + 4 * j] = X_[i + 2 * j];
            C[i + 4 * j] = -C_[i + 2 * j];
          }
        }
        sylvester_residual({n, n, data_.continuous, true, A, S, C}, X, R, work);
        for (int j = 0; j < n; ++j) {
          for (int i = 0; i < n; ++i) {
            F_[i + 2 * j] = -R[i + 4 * j];
          }
          for (int i = n; i < 2; ++i) {
            F_[i + 2 * j] = 0.0;
          }
        }
        return;
      }
    }
    double* const work = loop_work_ + 2 * size();
    double* const A = loop_work_ + 5 * size();
    for (int k = 0; k < size(); ++k) {
      A[k] = 0.0;
      T_[k] = -C_[k];
    }
    transpose(n_, A, S_);
    sylvester_residual({n, n, data_.continuous, true, A, S_, T_}, X_, F_, work);
    for (int k = 0; k < size(); ++k) {
      F_[k] = -F_[k];
    }
  }

  /// F = C - L(X) and the sizes of its terms.
  double measure() {
    const int n = n_();
    double* const F = F_;
    double* const T = T_;
    const double* const X = X_;
    const double* const C = C_;
    multiply(n_, T, ld(), X, ld(), S_, ld(), n, n);
    if (data_.continuous) {
      // XS, whose transpose is SᵀX.
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          F[i + j * ld()] = C[i + j * ld()] + (T[i + j * ld()] + T[j + i * ld()]);
        }
        for (int i = n; i < ld(); ++i) {
          F[i + j * ld()] = 0.0;
        }
      }
      scale_ = 2.0 * std::sqrt(squared_norm(n_, T, n));
    } else {
      double* const St = loop_work_ + 4 * size();
      transpose(n_, St, S_);
      multiply(n_, F, ld(), St, ld(), T, ld(), n, n);
      scale_ = std::sqrt(squared_norm(n_, F, n));
      for (int k = 0; k < size(); ++k) {
        F[k] += C[k] - X[k];
      }
    }
    size_X_ = std::sqrt(squared_norm(n_, X, n));
    scale_ += std::sqrt(squared_norm(n_, C, n)) + (data_.continuous ? 0.0 : size_X_);
    return std::sqrt(squared_norm(n_, F, n));
  }

  /// What is left of each entry of the equation is rounding beside the terms that made it, whatever
  /// the units of the states.
  bool holds_by_entries() {
    const int n = n_();
    double* const X = loop_work_ + 2 * size();
    double* const S = loop_work_ + 3 * size();
    double* const St = loop_work_ + 4 * size();
    double* const terms = loop_work_ + 5 * size();
    double* const T = T_;
    for (int k = 0; k < size(); ++k) {
      X[k] = std::abs(X_[k]);
      S[k] = std::abs(S_[k]);
      St[k] = 0.0;
    }
    multiply(n_, T, ld(), X, ld(), S, ld(), n, n);
    if (!data_.continuous) {
      transpose(n_, St, S);
      multiply(n_, terms, ld(), St, ld(), T, ld(), n, n);
    }
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const double size = data_.continuous ? T[i + j * ld()] + T[j + i * ld()]
                                             : terms[i + j * ld()] + X[i + j * ld()];
        const double left = std::abs(F_[i + j * ld()]);
        const double all = size + std::abs(C_[i + j * ld()]);
        if (!(left <= (16.0 + n) * epsilon * all)) {
          return false;
        }
        answer_.residual = left > answer_.residual * all ? left / all : answer_.residual;
      }
    }
    return true;
  }

  const LyapunovData& data_;
  LyapunovAnswer& answer_;
  Size<N> n_;
  int* pivots_;
  double* loop_work_;
  double* powers_;
  double *S_, *C_, *X_, *F_, *T_;
  double *d_, *rows_, *columns_;
  double scale_ = 0.0;
  double size_X_ = 0.0;
};

bool solve_stable_lyapunov(const LyapunovData& data, LyapunovAnswer& answer, double* memory,
                           int* pivots) {
  switch (data.states) {
    case 2:
      return StableLyapunov<2>(data, answer, memory, pivots).run();
    case 3:
      return StableLyapunov<3>(data, answer, memory, pivots).run();
    case 4:
      return StableLyapunov<4>(data, answer, memory, pivots).run();
    case 5:
      return StableLyapunov<5>(data, answer, memory, pivots).run();
    default:
      return StableLyapunov<0>(data, answer, memory, pivots).run();
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
