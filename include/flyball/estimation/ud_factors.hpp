#pragma once

#include <algorithm>
#include <limits>

#include <Eigen/Core>

#include <flyball/estimation/forms/cholesky.hpp>

/// Covariances that cannot become negative: P = U D Uᵀ with U unit upper triangular and D diagonal,
/// D >= 0. Every entry of D below is a sum of products that are not negative, so that P is positive
/// semidefinite whatever is rounded.
/// Source: Bierman, "Factorization Methods for Discrete Sequential Estimation" (1977), chapters 3
/// (factorisation), 5 (measurement) and 6 (time); Thornton and Bierman, "Gram-Schmidt algorithms
/// for covariance propagation", International Journal of Control 25 (1977).
namespace flyball::detail {

/// P = U D Uᵀ; a pivot that is rounding alone counts as zero. Reads the upper triangle.
template <class Matrix, class Vector>
void ud_factorize(Matrix P, Matrix& U, Vector& d) noexcept {
  constexpr double rounding = 4.0 * std::numeric_limits<double>::epsilon();
  const Eigen::Index n = P.rows();
  const Vector sizes = P.diagonal();
  U.setIdentity(n, n);
  d.setZero(n);
  for (Eigen::Index j = n; j-- > 0;) {
    if (!(P(j, j) > rounding * static_cast<double>(n) * sizes(j))) {
      continue;
    }
    d(j) = P(j, j);
    for (Eigen::Index i = 0; i < j; ++i) {
      U(i, j) = P(i, j) / d(j);
      for (Eigen::Index k = 0; k <= i; ++k) {
        P(k, i) -= U(i, j) * P(k, j);
      }
    }
  }
}

/// M <- U⁻¹ M.
template <class Matrix, class Rows>
void ud_solve(const Matrix& U, Rows& M) noexcept {
  for (Eigen::Index i = U.rows(); i-- > 0;) {
    for (Eigen::Index k = i + 1; k < U.rows(); ++k) {
      M.row(i) -= U(i, k) * M.row(k);
    }
  }
}

/// U D Uᵀ, symmetric. The entries beside the diagonal are made n (n - 1) ε smaller, which is more
/// than what rounding did to them, so that the rounded matrix is positive semidefinite too.
template <class Matrix, class Vector>
void ud_product(const Matrix& U, const Vector& d, Matrix& P) noexcept {
  const Eigen::Index n = U.rows();
  const double towards_zero =
      1.0 - static_cast<double>(n * (n - 1)) * std::numeric_limits<double>::epsilon();
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i <= j; ++i) {
      double sum = i == j ? d(j) : U(i, j) * d(j);
      for (Eigen::Index k = j + 1; k < n; ++k) {
        sum += U(i, k) * d(k) * U(j, k);
      }
      P(i, j) = P(j, i) = i == j ? sum : towards_zero * sum;
    }
  }
}

/// U D Uᵀ <- A U D Uᵀ Aᵀ + G diag(q) Gᵀ: the rows of [A U, G] made orthogonal under diag(d, q) from
/// the last to the first.
template <class Matrix, class Vector>
void ud_predict(const Matrix& A, const Matrix& G, const Vector& q, Matrix& U, Vector& d) noexcept {
  const Eigen::Index n = A.rows();
  Matrix W = A;
  for (Eigen::Index j = 1; j < n; ++j) {
    for (Eigen::Index k = 0; k < j; ++k) {
      W.col(j) += U(k, j) * A.col(k);
    }
  }
  Matrix V = G;  // Row j keeps its zeros before column j.
  Vector Dw = d;
  Vector Qv = q;
  Vector predicted = d;
  for (Eigen::Index j = n; j-- > 0;) {
    double from_state = 0.0;
    double from_noise = 0.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      Dw(k) = d(k) * W(j, k);
      from_state += W(j, k) * Dw(k);
    }
    for (Eigen::Index k = j; k < n; ++k) {
      Qv(k) = q(k) * V(j, k);
      from_noise += V(j, k) * Qv(k);
    }
    predicted(j) = std::max(from_state + from_noise, least_variance);
    for (Eigen::Index i = 0; i < j; ++i) {
      double shared_state = 0.0;
      double shared_noise = 0.0;
      for (Eigen::Index k = 0; k < n; ++k) {
        shared_state += W(i, k) * Dw(k);
      }
      for (Eigen::Index k = j; k < n; ++k) {
        shared_noise += V(i, k) * Qv(k);
      }
      const double u = (shared_state + shared_noise) / predicted(j);
      U(i, j) = u;
      for (Eigen::Index k = 0; k < n; ++k) {
        W(i, k) -= u * W(j, k);
      }
      for (Eigen::Index k = j; k < n; ++k) {
        V(i, k) -= u * V(j, k);
      }
    }
  }
  d = predicted;
}

/// The factors after one measurement c x with the noise r >= 0, and b = P cᵀ of before.
/// @return  The innovation's variance c P cᵀ + r; the gain is b over it. Zero where it is no number
///          to divide by, and then the factors are of no use any more.
template <class Row, class Matrix, class Vector>
double ud_correct(const Row& c, double r, Matrix& U, Vector& d, Vector& b) noexcept {
  const Eigen::Index n = U.rows();
  double alpha = r;
  for (Eigen::Index i = 0; i < n; ++i) {
    double f = c(i);
    for (Eigen::Index k = 0; k < i; ++k) {
      f += U(k, i) * c(k);
    }
    const double v = d(i) * f;
    const double before = alpha;
    alpha += f * v;
    b(i) = v;
    if (!(before >= least_divisor)) {
      // Nothing has been measured so far, and b is zero up to here.
      d(i) = alpha >= least_divisor ? 0.0 : d(i);
      for (Eigen::Index k = 0; k < i; ++k) {
        b(k) += U(k, i) * v;
      }
      continue;
    }
    d(i) *= before / alpha;
    for (Eigen::Index k = 0; k < i; ++k) {
      const double u = U(k, i);
      U(k, i) -= b(k) / before * f;
      b(k) += u * v;
    }
  }
  return is_divisor(alpha) ? alpha : 0.0;
}

}  // namespace flyball::detail
