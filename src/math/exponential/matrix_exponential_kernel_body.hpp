#pragma once

// The kernel of matrix_exponential_kernel.hpp for one instruction set; see riccati_kernel_body.hpp.

#include "math/dense/balance_small.hpp"
#include "math/dense/gauss_jordan.hpp"
#include "math/dense/small_matrix.hpp"
#include "math/exponential/exponential_2x2.hpp"
#include "math/exponential/pade.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// Scaling and squaring after Al-Mohy and Higham, "A new scaling and squaring algorithm for the
/// matrix exponential", SIAM J. Matrix Anal. Appl. 31 (2009), Algorithms 2.1, 5.1 and 6.1.
template <int N>
class Exponential {
 public:
  Exponential(int n, double* memory) : n_{n} {
    Workspace work(memory);
    for (double** matrix : {&A_, &A2_, &A4_, &A6_, &U_, &V_, &W_, &T_}) {
      *matrix = work.take(size());
    }
    original_ = work.take(size());
    sums_ = work.take(ld());
    next_ = work.take(ld());
    d_ = work.take(ld());
    paths_ = work.take(ld());
    paths_next_ = work.take(ld());
    inverse_d_ = work.take(ld());
  }

  void run(const double* data, double* E) {
    const int n = n_();
    pad(A_, ld(), data, n, n);
    const bool upper = is_triangular(true);
    const bool lower = !upper && is_triangular(false);
    const bool triangular = upper || lower;
    if (lower) {
      copy(T_, A_);
      for (int k = 0; k < size(); ++k) {
        A_[k] = 0.0;
      }
      transpose(n_, A_, T_);
    }
    if (triangular) {
      copy(original_, A_);
    } else {
      balance(n_, A_, d_, sums_, next_);
      take_units();
    }
    const int squarings = approximate();
    double* result = V_;
    double* other = W_;
    if (triangular) {
      for (int j = 0; j < n; ++j) {
        for (int i = j + 1; i < n; ++i) {
          result[i + j * ld()] = 0.0;
        }
      }
      restore_diagonals(squarings, result);
    }
    for (int k = squarings - 1; k >= 0; --k) {
      square(other, result, result);
      double* const held = result;
      result = other;
      other = held;
      if (triangular) {
        restore_diagonals(k, result);
      }
    }
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        E[i + j * n] = lower        ? result[j + i * ld()]
                       : triangular ? result[i + j * ld()]
                                    : result[i + j * ld()] * (d_[i] / d_[j]);
      }
    }
  }

 private:
  [[nodiscard]] int ld() const { return n_.padded(); }
  [[nodiscard]] int size() const { return ld() * n_(); }

  void copy(double* to, const double* from) const {
    for (int k = 0; k < size(); ++k) {
      to[k] = from[k];
    }
  }
  void square(double* C, const double* A, const double* B) const {
    multiply(n_, C, ld(), A, ld(), B, ld(), n_(), n_());
  }
  void scale(double* M, double factor) const {
    for (int k = 0; k < size(); ++k) {
      M[k] *= factor;
    }
  }

  [[nodiscard]] bool is_triangular(bool upper) const {
    for (int j = 0; j < n_(); ++j) {
      for (int i = j + 1; i < n_(); ++i) {
        if (A_[upper ? i + j * ld() : j + i * ld()] != 0.0) {
          return false;
        }
      }
    }
    return true;
  }

  /// ‖M‖₁.
  [[nodiscard]] double norm1(const double* M) const {
    double largest = 0.0;
    for (int j = 0; j < n_(); ++j) {
      Vector4 sum{};
      for (int i = 0; i < ld(); i += 4) {
        const Vector4 entries = load4(M + i + j * ld());
        sum += entries < 0.0 ? -entries : entries;
      }
      const double total = (sum[0] + sum[2]) + (sum[1] + sum[3]);
      // Not a number stays one.
      largest = total <= largest ? largest : total;
    }
    return largest;
  }

  /// Extra squarings that the rounding of the approximant asks for (Algorithm 5.1), of 2⁻ˢA:
  /// ‖ |A|^(2m+1) ‖₁ is exact by products of |A| with a vector, here of |A|/‖A‖.
  [[nodiscard]] int extra_squarings(const Pade& p, double norm, int s) {
    const double log2_norm = std::log2(norm) - s;
    if (2.0 * p.order * log2_norm - p.log2_inverse_error + 53.0 <= 0.0) {
      return 0;  // ‖A‖^(2m+1) bounds it
    }
    const double inverse = 1.0 / norm;
    double* const T = W_;
    for (int k = 0; k < size(); ++k) {
      T[k] = 0.0;
    }
    for (int j = 0; j < n_(); ++j) {
      for (int i = 0; i < n_(); ++i) {
        T[j + i * ld()] = std::abs(A_[i + j * ld()]) * inverse;
      }
    }
    double* sums = sums_;
    double* next = next_;
    for (int i = 0; i < ld(); ++i) {
      sums[i] = i < n_() ? 1.0 : 0.0;
    }
    const auto advance = [&](const double* M) {
      multiply(n_, next, ld(), M, ld(), sums, ld(), n_(), 1);
      double* const held = sums;
      sums = next;
      next = held;
    };
    const auto largest_sum = [&] {
      double largest = 0.0;
      for (int i = 0; i < n_(); ++i) {
        largest = std::max(largest, sums[i]);
      }
      return largest;
    };
    const double rest = 2.0 * p.order * log2_norm - p.log2_inverse_error;
    advance(T);
    advance(T);
    if (p.order * std::log2(largest_sum()) + rest + 53.0 <= 0.0) {
      return 0;  // ‖ |A|² ‖ᵐ ‖A‖ bounds it
    }
    if (n_() <= 12) {  // a product for half of the steps
      advance(T);
      square(V_, T, T);
      for (int k = 1; k < p.order; ++k) {
        advance(V_);
      }
    } else {
      for (int k = 2; k < 2 * p.order + 1; ++k) {
        advance(T);
      }
    }
    const double largest = largest_sum();
    if (!(largest > 0.0)) {
      return 0;
    }
    const double log2_alpha = std::log2(largest) + rest;
    return std::max(0, static_cast<int>(std::ceil((log2_alpha + 53.0) / (2.0 * p.order))));
  }

  /// Where balancing gave units, what the given matrix is in its own.
  void take_units() {
    for (int i = 0; i < n_(); ++i) {
      has_units_ = has_units_ || d_[i] != 1.0;
    }
    if (!has_units_) {
      return;
    }
    const auto [least, most] = std::minmax_element(d_, d_ + n_());
    log2_units_ = std::ilogb(*most) - std::ilogb(*least);
    for (int j = 0; j < n_(); ++j) {
      double sum = 0.0;
      for (int i = 0; i < n_(); ++i) {
        sum += std::abs(A_[i + j * ld()]) * (d_[i] / d_[j]);
      }
      given_norm_ = std::max(given_norm_, sum);
    }
  }

  /// log₂ ‖ |A|ᵏ ‖₁ in the given units, of A_ as it is: dᵀ|A|ᵏ beside d. Powers that were asked for
  /// are kept; `original_` is free, since a triangular A is not balanced.
  [[nodiscard]] double log2_of_power(int k) {
    double* const T = original_;
    if (powers_ == 0) {
      for (int i = 0; i < size(); ++i) {
        T[i] = 0.0;
      }
      for (int j = 0; j < n_(); ++j) {
        for (int i = 0; i < n_(); ++i) {
          T[j + i * ld()] = std::abs(A_[i + j * ld()]);
        }
      }
      for (int i = 0; i < ld(); ++i) {
        paths_[i] = i < n_() ? d_[i] : 0.0;
        inverse_d_[i] = i < n_() ? 1.0 / d_[i] : 0.0;
      }
    }
    while (powers_ < k) {
      multiply(n_, paths_next_, ld(), T, ld(), paths_, ld(), n_(), 1);
      std::swap(paths_, paths_next_);
      double of_paths = 0.0;
      double largest = 0.0;
      for (int i = 0; i < n_(); ++i) {
        of_paths = std::max(of_paths, paths_[i]);
        largest = std::max(largest, paths_[i] * inverse_d_[i]);
      }
      ++powers_;
      power_[powers_] = largest;
      exponent_[powers_] = exponent_of_paths_;
      if (of_paths > 1e100 || of_paths < 1e-100) {
        const int exponent = of_paths > 0.0 ? std::ilogb(of_paths) : 0;
        scale_paths(exponent);
      }
    }
    return std::log2(power_[k]) + exponent_[k];
  }

  void scale_paths(int exponent) {
    const double inverse = std::ldexp(1.0, -exponent);
    for (int i = 0; i < n_(); ++i) {
      paths_[i] *= inverse;
    }
    exponent_of_paths_ += exponent;
  }

  /// Extra squarings in the units that were given: what the series leaves out is next to nothing
  /// beside the balanced 2⁻ˢA, but may count beside the given one, where what the balanced units
  /// made small is not. ‖ |A|ᵏ ‖₁ for the first k from 2m + 1 on.
  /// @param norm  Of A_, which is the balanced one times 2^-prescale.
  [[nodiscard]] int extra_squarings_of_given(const Pade& p, double norm, int prescale, int s) {
    if (!has_units_) {
      return 0;
    }
    const double log2_norm = std::log2(given_norm_) - prescale - s;
    const double log2_balanced = (2.0 * p.order + 1.0) * (std::log2(norm) - s);
    if (std::min(2.0 * p.order * log2_norm, log2_balanced + log2_units_ - log2_norm) -
            p.log2_inverse_error + 53.0 <=
        0.0) {
      return 0;  // ‖A‖^(2m+1) bounds it, or what the units make of that of the balanced
    }
    double log2_most = -std::numeric_limits<double>::infinity();
    for (int k = 2 * p.order + 1; k <= 2 * p.order + terms; ++k) {
      log2_most = std::max(log2_most, log2_of_power(k) - k * s);
    }
    const double log2_alpha = log2_most - log2_norm - p.log2_inverse_error;
    return std::max(0, static_cast<int>(std::ceil((log2_alpha + 53.0) / (2.0 * p.order))));
  }

  /// By which ‖Aᵏ‖^(1/k) = eta comes within the reach of the highest order.
  static int squarings_for(double eta) {
    return eta > pade[4].theta ? static_cast<int>(std::ceil(std::log2(eta / pade[4].theta))) : 0;
  }

  /// V_ ← the approximant of exp(2⁻ˢA); returns s.
  int approximate() {
    double norm = norm1(A_);
    if (!(norm > 0.0)) {
      set_identity(V_);
      return 0;
    }
    // Powers up to the tenth must not overflow while the order is chosen, nor the sums of columns.
    int prescale = 0;
    if (!(norm < 1e300)) {
      prescale = 900;
      scale(A_, std::ldexp(1.0, -prescale));
      norm = norm1(A_);
    }
    if (norm > 1e25) {
      const int halvings = static_cast<int>(std::ceil(std::log2(norm / 1e25)));
      scale(A_, std::ldexp(1.0, -halvings));
      norm = norm1(A_);
      prescale += halvings;
    }
    square(A2_, A_, A_);
    // ‖A‖ bounds every ‖Aᵏ‖^(1/k), and where it serves, no squaring can be called for.
    const auto serves = [&](const Pade& p) {
      return extra_squarings_of_given(p, norm, prescale, 0) == 0;
    };
    if (norm <= pade[0].theta && serves(pade[0])) {
      quotient(pade[0]);
      return 0;
    }
    square(A4_, A2_, A2_);
    if (norm <= pade[1].theta && serves(pade[1])) {
      quotient(pade[1]);
      return 0;
    }
    square(A6_, A2_, A4_);
    if (norm <= pade[2].theta && serves(pade[2])) {
      quotient(pade[2]);
      return 0;
    }
    const double d4 = std::sqrt(std::sqrt(norm1(A4_)));
    const double d6 = std::cbrt(std::sqrt(norm1(A6_)));
    const bool unscaled = prescale == 0;
    const double eta1 = std::max(d4, d6);
    for (int k = 0; k < 2; ++k) {
      if (unscaled && eta1 <= pade[k].theta && extra_squarings(pade[k], norm, 0) == 0 &&
          serves(pade[k])) {
        quotient(pade[k]);
        return 0;
      }
    }
    // max(d6, d8) is at least d6 and max(d8, d10) at least d8: where that bound asks for as many
    // squarings, the next product is not worth it.
    int s = squarings_for(eta1);
    if (!unscaled || d6 <= pade[3].theta || squarings_for(d6) < s) {
      square(A8(), A4_, A4_);
      const double d8 = std::sqrt(std::sqrt(std::sqrt(norm1(A8()))));
      const double eta3 = std::max(d6, d8);
      for (int k = 2; k < 4; ++k) {
        if (unscaled && eta3 <= pade[k].theta && extra_squarings(pade[k], norm, 0) == 0 &&
            serves(pade[k])) {
          quotient(pade[k]);
          return 0;
        }
      }
      s = std::min(s, squarings_for(eta3));
      if (squarings_for(d8) < s) {
        square(T_, A4_, A6_);
        s = std::min(s, squarings_for(std::max(d8, std::pow(norm1(T_), 0.1))));
      }
    }
    s += extra_squarings(pade[4], norm, s);
    s += extra_squarings_of_given(pade[4], norm, prescale, s);
    scale(A_, std::ldexp(1.0, -s));
    scale(A2_, std::ldexp(1.0, -2 * s));
    scale(A4_, std::ldexp(1.0, -4 * s));
    scale(A6_, std::ldexp(1.0, -6 * s));
    quotient_13();
    return prescale + s;
  }

  double* A8() { return T_; }

  void set_identity(double* M) const {
    for (int k = 0; k < size(); ++k) {
      M[k] = 0.0;
    }
    for (int i = 0; i < n_(); ++i) {
      M[i + i * ld()] = 1.0;
    }
  }

  /// V_ ← (V - U)⁻¹(V + U) with the odd part U = A·(…) and the even part V of the numerator.
  void quotient(const Pade& p) {
    double* const odd = W_;
    double* const V = V_;
    const double* const even_powers[5] = {nullptr, A2_, A4_, A6_, A8()};
    const double* const A2 = A2_;
    const double even_1 = p.b[2];
    const double odd_1 = p.b[3];
    for (int k = 0; k < size(); ++k) {
      V[k] = even_1 * A2[k];
      odd[k] = odd_1 * A2[k];
    }
    for (int power = 2; 2 * power < p.order; ++power) {
      const double* const M = even_powers[power];
      const double even = p.b[2 * power];
      const double uneven = p.b[2 * power + 1];
      for (int k = 0; k < size(); ++k) {
        V[k] += even * M[k];
        odd[k] += uneven * M[k];
      }
    }
    for (int i = 0; i < n_(); ++i) {
      V[i + i * ld()] += p.b[0];
      odd[i + i * ld()] += p.b[1];
    }
    square(U_, A_, odd);
    divide();
  }

  void quotient_13() {
    const double* const b = pade[4].b;
    double* const T = T_;
    double* const W = W_;
    double* const V = V_;
    const double* const A2 = A2_;
    const double* const A4 = A4_;
    const double* const A6 = A6_;
    for (int k = 0; k < size(); ++k) {
      T[k] = b[13] * A6[k] + b[11] * A4[k] + b[9] * A2[k];
      V[k] = b[12] * A6[k] + b[10] * A4[k] + b[8] * A2[k];
    }
    square(W, A6, T);
    square(T, A6, V);
    for (int k = 0; k < size(); ++k) {
      W[k] += b[7] * A6[k] + b[5] * A4[k] + b[3] * A2[k];
      V[k] = T[k] + (b[6] * A6[k] + b[4] * A4[k] + b[2] * A2[k]);
    }
    for (int i = 0; i < n_(); ++i) {
      W[i + i * ld()] += b[1];
      V[i + i * ld()] += b[0];
    }
    square(U_, A_, W);
    divide();
  }

  /// V ← (V - U)⁻¹(V + U).
  void divide() {
    double* const M = U_;
    double* const R = V_;
    for (int k = 0; k < size(); ++k) {
      const double u = M[k];
      const double v = R[k];
      M[k] = v - u;
      R[k] = v + u;
    }
    if (!solve_in_place(n_, M, R)) {
      // Singular, or not a number: so is the result.
      scale(R, std::numeric_limits<double>::quiet_NaN());
    }
  }

  /// The exact diagonal and first superdiagonal of exp(2^-k T) (Algorithm 2.1), T upper triangular.
  void restore_diagonals(int k, double* E) const {
    const double* const T = original_;
    for (int i = 0; i < n_(); ++i) {
      const double here = std::ldexp(T[i + i * ld()], -k);
      E[i + i * ld()] = std::exp(here);
      if (i + 1 < n_()) {
        const double there = std::ldexp(T[(i + 1) * (ld() + 1)], -k);
        E[i + (i + 1) * ld()] =
            std::ldexp(T[i + (i + 1) * ld()], -k) * divided_difference(here, there);
      }
    }
  }

  Size<N> n_;
  double *A_, *A2_, *A4_, *A6_, *U_, *V_, *W_, *T_, *original_;
  double *sums_, *next_, *d_, *paths_, *paths_next_, *inverse_d_;
  double given_norm_ = 0.0;
  bool has_units_ = false;
  int log2_units_ = 0;  ///< Of the largest d beside the smallest.
  static constexpr int terms = 4;
  int powers_ = 0;
  int exponent_of_paths_ = 0;  ///< Of what `paths_` were divided by.
  double power_[2 * 13 + terms + 1];
  int exponent_[2 * 13 + terms + 1];
};

void exponential(int n, const double* A, double* E, double* memory) {
  switch (n) {
    case 1:
      E[0] = std::exp(A[0]);
      return;
    case 2:
      return exponential_2x2(A, E);
    case 3:
      return Exponential<3>(n, memory).run(A, E);
    case 4:
      return Exponential<4>(n, memory).run(A, E);
    case 5:
      return Exponential<5>(n, memory).run(A, E);
    case 6:
      return Exponential<6>(n, memory).run(A, E);
    default:
      return Exponential<0>(n, memory).run(A, E);
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
