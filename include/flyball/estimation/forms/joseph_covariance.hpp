#pragma once

#include <algorithm>

#include <flyball/estimation/forms/cholesky.hpp>

namespace flyball {

/// A noise's covariance as it is.
template <int N>
struct PlainNoise {
  Eigen::Matrix<double, N, N> Q;  ///< n x n

  explicit PlainNoise(const Eigen::Matrix<double, N, N>& covariance) noexcept : Q(covariance) {}
  /// That of `factor` samples; @param factor  Not negative.
  [[nodiscard]] PlainNoise scaled(double factor) const noexcept { return PlainNoise(Q * factor); }
};

/// A noise's covariance as Q = G Gᵀ.
template <int N>
struct FactoredNoise {
  Eigen::Matrix<double, N, N> G;  ///< n x n, lower triangular.

  /// @param covariance  Q, n x n.
  explicit FactoredNoise(const Eigen::Matrix<double, N, N>& covariance) noexcept {
    cholesky_factor(covariance, G);
  }
  /// That of `factor` samples; @param factor  Not negative.
  [[nodiscard]] FactoredNoise scaled(double factor) const noexcept {
    FactoredNoise other = *this;
    other.G *= std::sqrt(factor);
    return other;
  }
};

/// A covariance as the matrix itself, corrected by Joseph's form (9.24 in the form that stays
/// positive): the fastest of the forms, to be taken where P0/R stays below about 1e12. Beyond that
/// it stays a covariance, but no longer the exact one: an allowance for its own rounding is part of
/// it, so that it can only be too large.
///
/// All forms have this interface: run-time objects, noexcept, and for sizes known at compile time
/// allocation-free.
/// Source: book, equations 9.21 and 9.24; Bierman, "Factorization Methods for Discrete Sequential
/// Estimation" (1977), section V.2, equations (2.18) to (2.21), "stabilized Kalman".
template <int N>
class JosephCovariance {
 public:
  static constexpr int size = N;
  using Matrix = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;
  using Noise = PlainNoise<N>;

  /// P = 0, of no size where it is dynamic.
  JosephCovariance() noexcept {
    if constexpr (N != Eigen::Dynamic) {
      P_.setZero();
    }
  }

  /// @param P  n x n, symmetric, positive semidefinite. @return  Whether it is and was taken.
  bool set(const Matrix& P) noexcept {
    Matrix S;
    if (!detail::is_variance(P) || !detail::is_symmetric(P) || !cholesky_factor(P, S)) {
      return false;
    }
    P_ = P;
    detail::mirror_lower(P_);
    return true;
  }
  [[nodiscard]] const Matrix& P() const noexcept { return P_; }
  /// S of P = S Sᵀ, lower triangular.
  [[nodiscard]] Matrix factor() const noexcept {
    Matrix S;
    cholesky_factor(P_, S);
    return S;
  }

  /// P <- F P Fᵀ + Q (9.21).
  /// @return  Whether it has moved: a variance beyond `largest_variance` is not taken.
  bool predict(const Matrix& F, const Noise& noise) noexcept {
    const Eigen::Index n = P_.rows();
    const Matrix T = F.lazyProduct(P_);
    Matrix P = noise.Q;
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j; i < n; ++i) {
        double sum = P(i, j);
        for (Eigen::Index k = 0; k < n; ++k) {
          sum += T(i, k) * F(j, k);
        }
        P(i, j) = sum;
      }
    }
    // What rounding can have done to F P Fᵀ: |(F P Fᵀ)_ij| <= Σ |F_ik| √P_kk Σ |F_jk| √P_kk.
    const double allowance = rounding(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      double size_of_row = 0.0;
      for (Eigen::Index k = 0; k < n; ++k) {
        size_of_row += F(i, k) * F(i, k) * P_(k, k);
      }
      P(i, i) += allowance * size_of_row + detail::least_variance;
    }
    return take(P);
  }

  /// P <- Z Zᵀ + Q. @param Z  n x k, any k. @return  As `predict`.
  template <class Columns>
  bool assign(const Columns& Z, const Noise& noise) noexcept {
    const Eigen::Index n = P_.rows();
    Matrix P = noise.Q;
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j; i < n; ++i) {
        double sum = P(i, j);
        for (Eigen::Index k = 0; k < Z.cols(); ++k) {
          sum += Z(i, k) * Z(j, k);
        }
        P(i, j) = sum;
      }
      P(j, j) += rounding(n) * P(j, j) + detail::least_variance;
    }
    return take(P);
  }

  /// P after one measurement h x with the noise r >= 0, P⁺ = (I - K h) P (I - K h)ᵀ + r K Kᵀ.
  /// @param h  n x 1, the row of C. @param K  n x 1, the gain P hᵀ/(h P hᵀ + r).
  /// @return   The innovation's variance h P hᵀ + r; zero where it is no number to divide by, and
  ///           then P is of no use any more: the caller has kept what it was.
  double correct(const Vector& h, double r, Vector& K) noexcept {
    const Eigen::Index n = P_.rows();
    Vector b = h;
    for (Eigen::Index i = 0; i < n; ++i) {
      double sum = P_(i, 0) * h(0);
      for (Eigen::Index j = 1; j < n; ++j) {
        sum += P_(i, j) * h(j);
      }
      b(i) = sum;
    }
    double of_estimate = 0.0;
    double without_cancellation = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      of_estimate += h(i) * b(i);
      without_cancellation += h(i) * h(i) * P_(i, i);
    }
    const double variance = of_estimate + r;
    if (!detail::is_divisor(variance) || !(without_cancellation <= detail::largest_variance)) {
      K.setZero(n);
      return 0.0;
    }
    const double inverse = 1.0 / variance;
    for (Eigen::Index i = 0; i < n; ++i) {
      K(i) = b(i) * inverse;
    }
    // T = (I - K h) P
    const double allowance = rounding(n);
    bool unstable = r < 1e-3 * variance;
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j; i < n; ++i) {
        P_(i, j) -= K(i) * b(j);
        P_(j, i) = P_(i, j);
      }
      P_(j, j) += allowance * P_(j, j) + detail::least_variance;
      unstable = unstable | !(P_(j, j) > 0.0);
    }
    if (unstable) {
      stabilize(h, r, K, b, without_cancellation);
    }
    return variance;
  }

  /// P <- factor P, for a start with more doubt. @return  As `predict`. @param factor  Positive.
  bool scale(double factor) noexcept { return take(P_ * factor); }

 private:
  /// T + (r K - T hᵀ) Kᵀ, which but for rounding is T: where little is left of what was subtracted
  /// from, that makes the difference.
  void stabilize(const Vector& h, double r, const Vector& K, const Vector& b,
                 double without_cancellation) noexcept {
    const Eigen::Index n = P_.rows();
    Vector w = r * K;
    for (Eigen::Index j = 0; j < n; ++j) {
      w -= P_.col(j) * h(j);
    }
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j; i < n; ++i) {
        P_(i, j) += w(i) * K(j);
        P_(j, i) = P_(i, j);
      }
    }
    // Of a measurement so exact, what is left is rounding.
    if (r < 1e-10 * without_cancellation) {
      for (Eigen::Index j = 0; j < n; ++j) {
        P_(j, j) = std::max(P_(j, j), 0.0) + rounding(n) * (P_(j, j) + 2.0 * K(j) * b(j) +
                                                            without_cancellation * K(j) * K(j));
      }
    }
    bound_by_variances();
  }
  [[nodiscard]] static constexpr double rounding(Eigen::Index n) noexcept {
    return 2.0 * static_cast<double>(n * n) * std::numeric_limits<double>::epsilon();
  }
  /// Reads the lower triangle.
  bool take(const Matrix& P) noexcept {
    constexpr double underflows = 1e-150;  // Its square.
    bool bounded = true;
    bool odd = false;
    for (Eigen::Index i = 0; i < P.rows(); ++i) {
      bounded = bounded && P(i, i) >= 0.0 && P(i, i) <= detail::largest_variance;
      odd = odd || P(i, i) < underflows;
    }
    if (bounded) {
      P_.resize(P.rows(), P.cols());
      for (Eigen::Index j = 0; j < P.cols(); ++j) {
        for (Eigen::Index i = j; i < P.rows(); ++i) {
          P_(i, j) = P_(j, i) = P(i, j);
          odd = odd | (P(i, j) * P(i, j) > P(i, i) * P(j, j));
        }
      }
      if (odd) [[unlikely]] {
        bound_by_variances();
      }
    }
    return bounded;
  }
  /// P_ii > 0 and |P_ij| <= √(P_ii P_jj): where numbers are as far apart as doubles can be,
  /// rounding and underflow leave less than that.
  void bound_by_variances() noexcept {
    const Eigen::Index n = P_.rows();
    for (Eigen::Index j = 0; j < n; ++j) {
      P_(j, j) = std::max(P_(j, j), detail::least_variance);
    }
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j + 1; i < n; ++i) {
        const double most = std::sqrt(P_(i, i)) * std::sqrt(P_(j, j));
        P_(i, j) = P_(j, i) = std::clamp(P_(i, j), -most, most);
      }
    }
  }

  Matrix P_;
};

}  // namespace flyball
