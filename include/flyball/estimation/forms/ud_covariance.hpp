#pragma once

#include <flyball/estimation/forms/joseph_covariance.hpp>
#include <flyball/estimation/ud_factors.hpp>

namespace flyball {

/// A noise's covariance as Q = G diag(q) Gᵀ.
template <int N>
struct UdNoise {
  Eigen::Matrix<double, N, N> G;  ///< n x n, unit upper triangular.
  Eigen::Matrix<double, N, 1> q;  ///< n x 1, not negative.

  /// @param covariance  Q, n x n.
  explicit UdNoise(const Eigen::Matrix<double, N, N>& covariance) noexcept {
    detail::ud_factorize(covariance, G, q);
  }
  /// That of `factor` samples; @param factor  Not negative.
  [[nodiscard]] UdNoise scaled(double factor) const noexcept {
    UdNoise other = *this;
    other.q *= factor;
    return other;
  }
};

/// A covariance as P = U D Uᵀ, U unit upper triangular and D diagonal, of Bierman and Thornton: as
/// safe as the square root, without roots. The filter `KalmanFilter` has this form.
/// Source: `ud_factors.hpp`.
template <int N>
class UdCovariance {
 public:
  static constexpr int size = N;
  using Matrix = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;
  using Noise = UdNoise<N>;

  /// P = 0, of no size where it is dynamic.
  UdCovariance() noexcept {
    if constexpr (N != Eigen::Dynamic) {
      U_.setIdentity();
      d_.setZero();
    }
  }

  /// As JosephCovariance::set.
  bool set(const Matrix& P) noexcept {
    Matrix S;
    const bool usable = detail::is_variance(P) && detail::is_symmetric(P) && cholesky_factor(P, S);
    if (usable) {
      detail::ud_factorize(P, U_, d_);
    }
    return usable;
  }
  [[nodiscard]] Matrix P() const noexcept {
    Matrix P = U_;
    detail::ud_product(U_, d_, P);
    return P;
  }
  /// S of P = S Sᵀ, lower triangular.
  [[nodiscard]] Matrix factor() const noexcept {
    // [U √D]ᵀ made lower triangular.
    Matrix Zt = U_.transpose();
    for (Eigen::Index j = 0; j < Zt.rows(); ++j) {
      Zt.row(j) *= std::sqrt(d_(j));
    }
    Matrix S;
    triangular_factor(Zt, S);
    return S;
  }

  /// P <- F P Fᵀ + Q. @return  As JosephCovariance::predict.
  bool predict(const Matrix& F, const Noise& noise) noexcept {
    Matrix U = U_;
    Vector d = d_;
    detail::ud_predict(F, noise.G, noise.q, U, d);
    return take(U, d);
  }

  /// P <- Z Zᵀ + Q. @param Z  n x k, any k. @return  As `predict`.
  template <class Columns>
  bool assign(const Columns& Z, const Noise& noise) noexcept {
    // Z Zᵀ of at most n columns first.
    Eigen::Matrix<double, Columns::ColsAtCompileTime, N> Zt = Z.transpose();
    Matrix S;
    triangular_factor(Zt, S);
    Matrix U = Matrix::Identity(S.rows(), S.cols());
    Vector d = Vector::Ones(S.rows());
    detail::ud_predict(S, noise.G, noise.q, U, d);
    return take(U, d);
  }

  /// As JosephCovariance::correct.
  double correct(const Vector& h, double r, Vector& K) noexcept {
    K = d_;
    const double variance = detail::ud_correct(h, r, U_, d_, K);
    if (variance > 0.0) {
      K *= 1.0 / variance;
    }
    return variance;
  }

  /// As JosephCovariance::scale.
  bool scale(double factor) noexcept { return take(U_, d_ * factor); }

 private:
  bool take(const Matrix& U, const Vector& d) noexcept {
    bool bounded = true;
    for (Eigen::Index i = 0; i < d.size(); ++i) {
      double variance = d(i);
      for (Eigen::Index k = i + 1; k < d.size(); ++k) {
        variance += U(i, k) * U(i, k) * d(k);
      }
      bounded = bounded & (variance <= detail::largest_variance);
    }
    if (bounded) {
      U_ = U;
      d_ = d;
    }
    return bounded;
  }

  Matrix U_;
  Vector d_;
};

}  // namespace flyball
