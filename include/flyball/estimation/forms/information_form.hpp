#pragma once

#include <algorithm>
#include <limits>

#include <flyball/estimation/forms/joseph_covariance.hpp>

namespace flyball {

/// A covariance as the factor of its inverse, P⁻¹ = Rᵀ R with R upper triangular: a filter of this
/// form may start without knowing anything (`forget`), and each measurement adds what it knows.
/// Where nothing is known yet, a variance is `largest_variance` and the estimate stays where it is.
///
/// A prediction needs a transition F that has an inverse, as that of continuous dynamics does; a
/// measurement needs noise, r > 0.
/// Source: Bierman, "Factorization Methods for Discrete Sequential Estimation" (1977), chapters V.3
/// and VI.5, the square-root information filter.
template <int N>
class InformationForm {
 public:
  static constexpr int size = N;
  using Matrix = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;
  using Noise = FactoredNoise<N>;

  /// Nothing is known.
  InformationForm() noexcept {
    if constexpr (N != Eigen::Dynamic) {
      R_.setZero();
    }
  }

  /// @param P  n x n, symmetric, positive definite: with a variance of zero in some direction there
  ///           is no information matrix. @return  Whether it is and was taken.
  bool set(const Matrix& P) noexcept {
    const Eigen::Index n = P.rows();
    Matrix S;
    if (!detail::is_variance(P) || !detail::is_symmetric(P) || !cholesky_factor(P, S)) {
      return false;
    }
    // The rows of S⁻¹, one after the other.
    Matrix inverse = Matrix::Identity(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!(S(i, i) > 0.0)) {
        return false;
      }
      for (Eigen::Index j = 0; j <= i; ++j) {
        double sum = inverse(i, j);
        for (Eigen::Index k = j; k < i; ++k) {
          sum -= S(i, k) * inverse(k, j);
        }
        inverse(i, j) = sum / S(i, i);
      }
    }
    Matrix R = Matrix::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      Vector row = inverse.row(i);
      insert(R, row, n);
    }
    return take(R);
  }
  /// P⁻¹ = 0: nothing is known. @param n  The number of states.
  void forget(Eigen::Index n = N) noexcept { R_.setZero(n, n); }
  /// Rᵀ R = P⁻¹
  [[nodiscard]] Matrix information() const noexcept { return R_.transpose().lazyProduct(R_); }

  [[nodiscard]] Matrix P() const noexcept {
    const Matrix Z = inverse_factor();
    const Eigen::Index n = R_.rows();
    // Beside the diagonal smaller by more than what rounding did: the rounded matrix stays a
    // covariance.
    const double towards_zero =
        1.0 - 2.0 * static_cast<double>(n * n) * std::numeric_limits<double>::epsilon();
    Matrix P(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j; i < n; ++i) {
        double sum = 0.0;
        for (Eigen::Index k = i; k < n; ++k) {
          sum += Z(i, k) * Z(j, k);
        }
        sum *= i == j ? 1.0 : towards_zero;
        P(i, j) = P(j, i) = std::clamp(sum, -detail::largest_variance, detail::largest_variance);
      }
    }
    return P;
  }
  /// S of P = S Sᵀ, lower triangular.
  [[nodiscard]] Matrix factor() const noexcept {
    Matrix Zt = inverse_factor().transpose();
    Matrix S;
    triangular_factor(Zt, S);
    return S;
  }

  /// P <- F P Fᵀ + Q: with x⁺ = F x + G w, R x is R F⁻¹ (x⁺ - G w); w, of which I w is known, is
  /// eliminated. @return  Whether F has an inverse; if not, nothing has changed.
  bool predict(const Matrix& F, const Noise& noise) noexcept {
    const Eigen::Index n = R_.rows();
    Matrix M;
    if (!solve_from_right(R_, F, M)) {
      return false;
    }
    constexpr int both = N == Eigen::Dynamic ? Eigen::Dynamic : 2 * N;
    using Joint = Eigen::Matrix<double, both, both>;
    Joint joint = Joint::Zero(2 * n, 2 * n);
    joint.topLeftCorner(n, n).setIdentity();
    // A noise too small to count bounds what is known of a state that goes to zero by itself.
    const Matrix MG = M.lazyProduct(noise.G) + M * least_noise;
    for (Eigen::Index i = 0; i < n; ++i) {
      Eigen::Matrix<double, both, 1> row(2 * n);
      for (Eigen::Index j = 0; j < n; ++j) {
        row(j) = -MG(i, j);
        row(n + j) = M(i, j);
      }
      insert(joint, row, 2 * n);
    }
    return take(joint.bottomRightCorner(n, n));
  }

  /// P <- Z Zᵀ + Q, which must be positive definite. @return  Whether it is.
  template <class Columns>
  bool assign(const Columns& Z, const Noise& noise) noexcept {
    const Matrix P = Z.lazyProduct(Z.transpose()) + noise.G.lazyProduct(noise.G.transpose());
    return set(P);
  }

  /// As JosephCovariance::correct; of what nothing was known the variance is infinite.
  /// @return  NaN for r = 0: nothing has changed.
  double correct(const Vector& h, double r, Vector& K) noexcept {
    const Eigen::Index n = R_.rows();
    K.setZero(n);
    if (!(r > 0.0)) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    Vector w = h;
    const double variance =
        r + (solve_transposed(R_, w) ? w.squaredNorm() : std::numeric_limits<double>::infinity());
    Vector row = h * (1.0 / std::sqrt(r));
    insert(R_, row, n);
    // Rᵀ R K = hᵀ/r.
    K = h * (1.0 / r);
    solve_transposed(R_, K);
    for (Eigen::Index i = n; i-- > 0;) {
      double sum = K(i);
      for (Eigen::Index j = i + 1; j < n; ++j) {
        sum -= R_(i, j) * K(j);
      }
      K(i) = R_(i, i) > 0.0 ? sum / R_(i, i) : 0.0;
    }
    return variance;
  }

  /// As JosephCovariance::scale.
  bool scale(double factor) noexcept { return take(R_ * (1.0 / std::sqrt(factor))); }

 private:
  static constexpr double least_noise = 1e-98;

  /// Adds a row's information by plane rotations. The rows of R are zero or begin with a positive
  /// entry on the diagonal.
  template <class Triangle, class Row>
  static void insert(Triangle& R, Row& row, Eigen::Index n) noexcept {
    for (Eigen::Index i = 0; i < n; ++i) {
      if (row(i) == 0.0) {
        continue;
      }
      const double r = std::hypot(R(i, i), row(i));
      const double c = R(i, i) / r;
      const double s = row(i) / r;
      R(i, i) = r;
      row(i) = 0.0;
      for (Eigen::Index j = i + 1; j < n; ++j) {
        const double above = R(i, j);
        R(i, j) = c * above + s * row(j);
        row(j) = c * row(j) - s * above;
      }
    }
  }
  /// v <- R⁻ᵀ v, zero where R is. @return  Whether R has rows for all of v.
  static bool solve_transposed(const Matrix& R, Vector& v) noexcept {
    bool known = true;
    for (Eigen::Index i = 0; i < R.rows(); ++i) {
      double sum = v(i);
      double size_of_sum = std::abs(sum);
      for (Eigen::Index k = 0; k < i; ++k) {
        sum -= R(k, i) * v(k);
        size_of_sum += std::abs(R(k, i) * v(k));
      }
      const bool empty = !(R(i, i) > 0.0);
      known = known && !(empty && std::abs(sum) > 1e-14 * size_of_sum);
      v(i) = empty ? 0.0 : sum / R(i, i);
    }
    return known;
  }
  /// M F = R by Gaussian elimination with pivots from the columns of F.
  static bool solve_from_right(const Matrix& R, Matrix F, Matrix& M) noexcept {
    const Eigen::Index n = F.rows();
    M = R;
    for (Eigen::Index k = 0; k < n; ++k) {
      Eigen::Index pivot = k;
      for (Eigen::Index j = k + 1; j < n; ++j) {
        pivot = std::abs(F(k, j)) > std::abs(F(k, pivot)) ? j : pivot;
      }
      if (!(std::abs(F(k, pivot)) > 0.0)) {
        return false;
      }
      F.col(k).swap(F.col(pivot));
      M.col(k).swap(M.col(pivot));
      for (Eigen::Index j = k + 1; j < n; ++j) {
        const double share = F(k, j) / F(k, k);
        F.col(j) -= share * F.col(k);
        M.col(j) -= share * M.col(k);
      }
    }
    for (Eigen::Index k = n; k-- > 0;) {
      M.col(k) *= 1.0 / F(k, k);
      for (Eigen::Index j = 0; j < k; ++j) {
        M.col(j) -= F(k, j) * M.col(k);
      }
    }
    return true;
  }
  /// R⁻¹, upper triangular; 1/√least where nothing is known.
  [[nodiscard]] Matrix inverse_factor() const noexcept {
    const Eigen::Index n = R_.rows();
    Matrix Z = Matrix::Zero(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j + 1; i-- > 0;) {
        double sum = i == j ? 1.0 : 0.0;
        for (Eigen::Index k = i + 1; k <= j; ++k) {
          sum -= R_(i, k) * Z(k, j);
        }
        const double pivot = std::max(R_(i, i), std::sqrt(detail::least_variance));
        Z(i, j) = sum / pivot;
      }
    }
    return Z;
  }
  bool take(const Matrix& R) noexcept {
    const bool usable = is_signal(R);
    if (usable) {
      R_ = R;
    }
    return usable;
  }

  Matrix R_;
};

}  // namespace flyball
