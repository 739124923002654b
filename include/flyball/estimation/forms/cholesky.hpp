#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

#include <flyball/core/signal.hpp>

/// Triangular factors of small matrices, P = S Sᵀ with S lower triangular, in plain loops: for
/// sizes known at compile time without allocation, and without Eigen's decompositions in user code.
namespace flyball {

namespace detail {

/// What a variance is kept between, the squares of 1/largest_signal and largest_signal: a sensor
/// without noise then still finds something to correct after each prediction.
inline constexpr double least_variance = 1e-200;
inline constexpr double largest_variance = 1e200;
/// What is less counts as zero where it is divided by: its inverse may not be finite.
inline constexpr double least_divisor = 1e-300;

/// Whether an innovation of this variance can be divided by it.
[[nodiscard]] constexpr bool is_divisor(double variance) noexcept {
  return variance >= least_divisor && variance <= largest_variance;
}

/// Whether no entry is NaN or beyond `largest_variance`.
template <class Derived>
[[nodiscard]] bool is_variance(const Eigen::MatrixBase<Derived>& P) noexcept {
  bool all = true;
  for (Eigen::Index j = 0; j < P.cols(); ++j) {
    for (Eigen::Index i = 0; i < P.rows(); ++i) {
      all = all & (__builtin_fabs(P(i, j)) <= largest_variance);
    }
  }
  return all;
}

/// Whether P_ij is P_ji but for rounding, in the units of their variances.
template <class Derived>
[[nodiscard]] bool is_symmetric(const Eigen::MatrixBase<Derived>& P) noexcept {
  constexpr double rounding = 1e-9;
  bool all = true;
  for (Eigen::Index j = 1; j < P.cols(); ++j) {
    for (Eigen::Index i = 0; i < j; ++i) {
      const double off = (P(i, j) - P(j, i)) / rounding;
      all = all & (off * off <= __builtin_fabs(P(i, i) * P(j, j)));
    }
  }
  return all;
}

/// The upper triangle becomes the lower one.
template <class Matrix>
void mirror_lower(Matrix& P) noexcept {
  for (Eigen::Index j = 1; j < P.cols(); ++j) {
    for (Eigen::Index i = 0; i < j; ++i) {
      P(i, j) = P(j, i);
    }
  }
}

}  // namespace detail

/// P = S Sᵀ. A pivot that is rounding alone counts as zero, and so does its column.
/// @param P  n x n, symmetric; its lower triangle is read. @param S  n x n, lower triangular.
/// @return  Whether P is positive semidefinite, judged entry by entry in the units of its
/// variances;
///          if not, S is the factor of what is left without the negative part.
template <class Matrix>
bool cholesky_factor(const Matrix& P, Matrix& S) noexcept {
  constexpr double eps = std::numeric_limits<double>::epsilon();
  const Eigen::Index n = P.rows();
  const double rounding = 8.0 * eps * static_cast<double>(n);
  bool definite = true;
  S.setZero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    double pivot = P(j, j);
    for (Eigen::Index k = 0; k < j; ++k) {
      pivot -= S(j, k) * S(j, k);
    }
    if (!(pivot > rounding * P(j, j))) {
      definite = definite && pivot >= -1e3 * rounding * std::abs(P(j, j));
      for (Eigen::Index i = j + 1; i < n; ++i) {
        double rest = P(i, j);
        for (Eigen::Index k = 0; k < j; ++k) {
          rest -= S(i, k) * S(j, k);
        }
        // |P_ij| <= √(P_ii P_jj), of what is left.
        definite = definite && rest * rest <= 1e3 * rounding * std::abs(P(i, i) * P(j, j));
      }
      continue;
    }
    const double root = std::sqrt(pivot);
    const double inverse = 1.0 / root;
    S(j, j) = root;
    for (Eigen::Index i = j + 1; i < n; ++i) {
      double sum = P(i, j);
      for (Eigen::Index k = 0; k < j; ++k) {
        sum -= S(i, k) * S(j, k);
      }
      S(i, j) = sum * inverse;
    }
  }
  return definite;
}

/// S Sᵀ <- S Sᵀ + v vᵀ by plane rotations.
/// @param S  n x n, lower triangular, its diagonal not negative. @param v  n x 1.
/// Cost: 2 n² products and n roots. Source: Golub and Van Loan, "Matrix Computations" (2013),
/// section 6.5.4.
template <class Matrix, class Vector>
void cholesky_update(Matrix& S, Vector v) noexcept {
  const Eigen::Index n = S.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    if (v(j) == 0.0) {
      continue;
    }
    const double r = std::hypot(S(j, j), v(j));
    const double c = S(j, j) / r;
    const double s = v(j) / r;
    S(j, j) = r;
    for (Eigen::Index i = j + 1; i < n; ++i) {
      const double below = S(i, j);
      S(i, j) = c * below + s * v(i);
      v(i) = c * v(i) - s * below;
    }
  }
}

/// S Sᵀ <- S Sᵀ - v vᵀ if that is a covariance.
/// @param S  n x n, lower triangular, its diagonal not negative. @param v  n x 1.
/// @return  Whether it is one. If not, S has not changed: what to do then is the caller's, and it
///          must be done.
/// Cost: 3 n² products and n roots.
/// Source: Stewart, "The effects of rounding error on an algorithm for downdating a Cholesky
/// factorization", J. Inst. Maths Applics 23 (1979), the algorithm of LINPACK's DCHDD.
template <class Matrix, class Vector>
[[nodiscard]] bool cholesky_downdate(Matrix& S, const Vector& v) noexcept {
  const Eigen::Index n = S.rows();
  // S p = v; with |p| < 1 there is an orthogonal matrix that takes (p, √(1 - |p|²)) to (0, 1).
  Vector p = v;
  double left = 1.0;
  for (Eigen::Index j = 0; j < n; ++j) {
    double sum = p(j);
    for (Eigen::Index k = 0; k < j; ++k) {
      sum -= S(j, k) * p(k);
    }
    if (sum == 0.0) {
      p(j) = 0.0;
      continue;
    }
    p(j) = sum / S(j, j);
    left -= p(j) * p(j);
  }
  if (!(left > 0.0)) {
    return false;
  }
  Matrix smaller = S;
  Vector w = v;
  w.setZero();
  double alpha = std::sqrt(left);
  for (Eigen::Index j = n; j-- > 0;) {
    const double r = std::hypot(alpha, p(j));
    const double c = alpha / r;
    const double s = p(j) / r;
    alpha = r;
    for (Eigen::Index i = j; i < n; ++i) {
      const double entry = smaller(i, j);
      smaller(i, j) = c * entry - s * w(i);
      w(i) = s * entry + c * w(i);
    }
  }
  if (!detail::is_variance(smaller)) {
    return false;
  }
  S = smaller;
  return true;
}

/// S of S Sᵀ = Z Zᵀ, lower triangular: the rows of Z made orthogonal, the modified Gram-Schmidt
/// form of a QR decomposition of Zᵀ, whose S is as exact as Householder's.
/// @param Zt  k x n, Zᵀ; it is used up. @param S  n x n.
/// Cost: k n² products and n roots. Source: Bjorck, "Solving linear least squares problems by
/// Gram-Schmidt orthogonalization", BIT 7 (1967).
template <class Tall, class Matrix>
void triangular_factor(Tall& Zt, Matrix& S) noexcept {
  const Eigen::Index n = Zt.cols();
  const Eigen::Index k = Zt.rows();
  S.setZero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    double square = 0.0;
    for (Eigen::Index l = 0; l < k; ++l) {
      square += Zt(l, j) * Zt(l, j);
    }
    if (!(square > detail::least_variance)) {
      S(j, j) = std::sqrt(detail::least_variance);
      continue;
    }
    S(j, j) = std::sqrt(square);
    const double inverse = 1.0 / S(j, j);
    for (Eigen::Index i = j + 1; i < n; ++i) {
      double dot = 0.0;
      for (Eigen::Index l = 0; l < k; ++l) {
        dot += Zt(l, i) * Zt(l, j);
      }
      const double along = dot * inverse;
      S(i, j) = along;
      const double share = along * inverse;
      for (Eigen::Index l = 0; l < k; ++l) {
        Zt(l, i) -= share * Zt(l, j);
      }
    }
  }
}

}  // namespace flyball
