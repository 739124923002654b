#pragma once

// Part of riccati_kernel_body.hpp, compiled with it once for each instruction set: the Lyapunov
// operator of a closed loop, by which the kernel judges and corrects what it found.

#include "core/constants.hpp"
#include "math/dense/gauss_jordan.hpp"
#include "math/dense/small_matrix.hpp"
#include "math/riccati/riccati_two_states.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

constexpr int closed_loop_powers = 8;

/// The Lyapunov operator of a closed loop, L(X) = X - SᵀXS or -(SᵀX + XS), whose inverse takes
/// defects to errors. The continuous one becomes a discrete one by the Cayley transform
/// A = (S - γI)⁻¹(S + γI) = I + 2γM, M = (S - γI)⁻¹: L⁻¹(C) = Σ (Aᵏ)ᵀ(2γ MᵀCM)Aᵏ.
template <int N>
class ClosedLoop {
 public:
  /// `work` holds six matrices; S is kept. Where `powers` holds `closed_loop_powers` matrices, the
  /// powers of A are formed once for all solutions.
  ClosedLoop(Size<N> n, bool continuous, const double* S, double* work, int* pivots,
             double* powers = nullptr)
      : n_(n), continuous_(continuous), S_(S), work_(work), powers_(powers), A_(S) {
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
  /// signs else (Hutchinson); infinite where the powers of A do not fade within so many steps, or
  /// grow beyond `most` times their squared size.
  double gain(double most = std::numeric_limits<double>::infinity(), int steps = 2000) {
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
    return sampled_gain(most, steps);
  }

  /// Whether A^128 is small: of one that is not the series has many terms. Where the powers are
  /// kept, those that are formed for this serve the solutions.
  bool fades_quickly() {
    if (!valid_) {
      return false;
    }
    const double* A = A_;
    for (int k = 1; k <= 7; ++k) {
      A = next_power(k, A);
      const double size = squared_norm(n_, A, n_());
      if (!(size < 1e100) || size < 1e-2) {
        return size < 1.0;
      }
    }
    return squared_norm(n_, A, n_()) < 1.0;
  }

  /// C ← L⁻¹(C), C symmetric; false where the powers of A do not fade. What the series lacks is
  /// `fade`² beside its sum.
  bool solve(double* C, double fade = 1e-9) {
    if (!valid_) {
      return false;
    }
    if (n_() == 2) {
      double X[4];
      const bool solved = lyapunov_two_states(continuous_, S_, C, X);
      for (int k = 0; k < 4; ++k) {
        C[k] = X[k];
      }
      return solved;
    }
    const int size = n_.padded() * n_();
    if (continuous_) {
      congruence<Product::assign>(C, C, M_);
      for (int k = 0; k < size; ++k) {
        C[k] *= 2.0 * gamma_;
      }
    }
    const double* A = A_;
    for (int k = 0; k < 50; ++k) {
      if (k > 0) {
        A = next_power(k, A);
      }
      congruence<Product::add>(C, C, A);
      const double size_of_power = squared_norm(n_, A, n_());
      if (!(size_of_power < 1e300)) {
        return false;
      }
      if (size_of_power < fade) {
        return true;
      }
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

  /// A^(2ᵏ), from the one before.
  const double* next_power(int k, const double* before) {
    const int ld = n_.padded();
    double* power = take(2 + k % 2);
    if (powers_ != nullptr && k <= closed_loop_powers) {
      power = powers_ + (k - 1) * ld * n_();
      if (k <= known_powers_) {
        return power;
      }
      known_powers_ = k;
    }
    multiply(n_, power, ld, before, ld, before, ld, n_(), n_());
    return power;
  }

  /// R = or += MᵀCM, C and R symmetric.
  template <Product Kind>
  void congruence(double* R, const double* C, const double* M) const {
    const int ld = n_.padded();
    double* const Mt = take(4);
    double* const CM = take(5);
    for (int j = 0; j < n_(); ++j) {
      for (int i = n_(); i < ld; ++i) {
        Mt[i + j * ld] = 0.0;
      }
    }
    transpose(n_, Mt, M);
    multiply(n_, CM, ld, C, ld, M, ld, n_(), n_());
    if (n_() > 8) {
      multiply<N, Kind, true>(n_, R, ld, Mt, ld, CM, ld, n_(), n_());
      mirror(n_, R);
    } else {
      multiply<N, Kind>(n_, R, ld, Mt, ld, CM, ld, n_(), n_());
    }
  }

  double sampled_gain(double most, int steps) {
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
    const double largest = most * sum;
    double before = sum;
    for (int k = 0; k < steps; ++k) {
      const double norm = advance(A_);
      sum += norm;
      if (!(norm <= largest)) {
        break;
      }
      // What is left of a slow mode beside fast ones is a long geometric series.
      if (norm < 1e-3 * sum && norm < before) {
        return 0.25 * (sum + norm * norm / (before - norm)) * unit;
      }
      before = norm;
    }
    return std::numeric_limits<double>::infinity();
  }

  Size<N> n_;
  bool continuous_;
  bool valid_ = true;
  double gamma_ = 0.0;
  const double* S_;
  double* work_;
  double* powers_;
  int known_powers_ = 0;
  const double* A_;
  const double* M_ = nullptr;
};

}  // namespace flyball::detail::FLYBALL_VARIANT
