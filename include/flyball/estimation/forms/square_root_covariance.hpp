#pragma once

#include <flyball/estimation/forms/joseph_covariance.hpp>

namespace flyball {

/// A covariance as its factor, P = S Sᵀ with S lower triangular: symmetric and positive
/// semidefinite whatever is rounded, with the range of numbers of P's square root. Predicted by a
/// QR decomposition, corrected by Carlson's formula, which keeps S triangular and cannot fail.
/// Source: Carlson, "Fast triangular formulation of the square root filter", AIAA Journal 11
/// (1973).
template <int N>
class SquareRootCovariance {
 public:
  static constexpr int size = N;
  using Matrix = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;
  using Noise = FactoredNoise<N>;

  /// P = 0, of no size where it is dynamic.
  SquareRootCovariance() noexcept {
    if constexpr (N != Eigen::Dynamic) {
      S_.setZero();
    }
  }

  /// As JosephCovariance::set.
  bool set(const Matrix& P) noexcept {
    Matrix S;
    const bool usable = detail::is_variance(P) && detail::is_symmetric(P) && cholesky_factor(P, S);
    if (usable) {
      S_ = S;
    }
    return usable;
  }
  /// S Sᵀ. The entries beside the diagonal are made n² ε smaller, which is more than what rounding
  /// did to them, so that the rounded matrix is positive semidefinite too.
  [[nodiscard]] Matrix P() const noexcept {
    const Eigen::Index n = S_.rows();
    const double towards_zero =
        1.0 - static_cast<double>(n * n) * std::numeric_limits<double>::epsilon();
    Matrix P(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j; i < n; ++i) {
        double sum = 0.0;
        for (Eigen::Index k = 0; k <= j; ++k) {
          sum += S_(i, k) * S_(j, k);
        }
        P(i, j) = P(j, i) = i == j ? sum : towards_zero * sum;
      }
    }
    return P;
  }
  [[nodiscard]] const Matrix& factor() const noexcept { return S_; }
  /// The factor itself. @param S  Lower triangular, its diagonal not negative.
  /// @return  Whether it is finite, and was taken.
  bool set_factor(const Matrix& S) noexcept {
    const bool usable = is_signal(S);
    if (usable) {
      S_ = S;
    }
    return usable;
  }

  /// P <- F P Fᵀ + Q, [F S, G] made triangular. @return  As JosephCovariance::predict.
  bool predict(const Matrix& F, const Noise& noise) noexcept {
    const Eigen::Index n = S_.rows();
    Matrix Z(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = 0; i < n; ++i) {
        double sum = 0.0;
        for (Eigen::Index k = j; k < n; ++k) {
          sum += F(i, k) * S_(k, j);
        }
        Z(i, j) = sum;
      }
    }
    return assign(Z, noise);
  }

  /// P <- Z Zᵀ + Q. @param Z  n x k, any k. @return  As `predict`.
  template <class Columns>
  bool assign(const Columns& Z, const Noise& noise) noexcept {
    constexpr int K = Columns::ColsAtCompileTime;
    constexpr int rows = K == Eigen::Dynamic || N == Eigen::Dynamic ? Eigen::Dynamic : K + N;
    const Eigen::Index n = S_.rows();
    const Eigen::Index k = Z.cols();
    Eigen::Matrix<double, rows, N> Zt(k + n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = 0; i < k; ++i) {
        Zt(i, j) = Z(j, i);
      }
      for (Eigen::Index i = 0; i < n; ++i) {
        Zt(k + i, j) = noise.G(j, i);
      }
    }
    Matrix S;
    triangular_factor(Zt, S);
    return take(S);
  }

  /// As JosephCovariance::correct.
  double correct(const Vector& h, double r, Vector& K) noexcept {
    const Eigen::Index n = S_.rows();
    double alpha = r;
    double root = std::sqrt(r);
    Vector b = Vector::Zero(n);
    for (Eigen::Index j = n; j-- > 0;) {
      double f = 0.0;
      for (Eigen::Index i = j; i < n; ++i) {
        f += S_(i, j) * h(i);
      }
      const double before = alpha;
      alpha += f * f;
      const double before_root = root;
      root = std::sqrt(alpha);
      if (!(before >= detail::least_divisor)) {
        // Nothing has been measured so far, and b is zero.
        const bool measured = alpha >= detail::least_divisor;
        for (Eigen::Index i = j; i < n; ++i) {
          b(i) += S_(i, j) * f;
          S_(i, j) = measured ? 0.0 : S_(i, j);
        }
        continue;
      }
      const double c = before_root / root;
      const double g = f / (before_root * root);
      for (Eigen::Index i = j; i < n; ++i) {
        const double s = S_(i, j);
        S_(i, j) = s * c - b(i) * g;
        b(i) += s * f;
      }
    }
    const bool usable = detail::is_divisor(alpha);
    K = usable ? Vector(b * (1.0 / alpha)) : b;
    return usable ? alpha : 0.0;
  }

  /// As JosephCovariance::scale.
  bool scale(double factor) noexcept { return take(S_ * std::sqrt(factor)); }

 private:
  bool take(const Matrix& S) noexcept {
    bool bounded = true;
    for (Eigen::Index i = 0; i < S.rows(); ++i) {
      double variance = 0.0;
      for (Eigen::Index j = 0; j <= i; ++j) {
        variance += S(i, j) * S(i, j);
      }
      bounded = bounded & (variance <= detail::largest_variance);
    }
    if (bounded) {
      S_ = S;
    }
    return bounded;
  }

  Matrix S_;
};

}  // namespace flyball
