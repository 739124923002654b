#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/constants.hpp"
#include "math/dense/dense.hpp"
#include "math/exponential/triangular_function.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;

double norm1_of(const MatrixXcd& M) {
  return M.cwiseAbs().colwise().sum().maxCoeff();
}

/// log λ, also near 1 to full relative accuracy.
Complex logarithm(const Complex& lambda) {
  const double re = lambda.real();
  const double im = lambda.imag();
  const double modulus = std::abs(lambda);
  const double log_modulus = std::abs(modulus - 1.0) < 0.25
                                 ? 0.5 * std::log1p((re - 1.0) * (re + 1.0) + im * im)
                                 : std::log(modulus);
  return {log_modulus, std::arg(lambda)};
}

/// e^z - 1.
Complex expm1(const Complex& z) {
  const double half = std::sin(0.5 * z.imag());
  return {std::expm1(z.real()) * std::cos(z.imag()) - 2.0 * half * half,
          std::exp(z.real()) * std::sin(z.imag())};
}

/// log b - log a without cancellation where they are close.
Complex difference_of_logarithms(const Complex& a, const Complex& b) {
  const Complex plain = logarithm(b) - logarithm(a);
  const Complex z = (b - a) / (b + a);
  if (!(std::abs(z) < 0.5)) {
    return plain;
  }
  // 2 atanh z = log b - log a up to multiples of 2πi.
  const Complex accurate = 2.0 * std::atanh(z);
  const double turns = std::round((plain.imag() - accurate.imag()) / (2.0 * pi));
  return accurate + Complex(0.0, 2.0 * pi * turns);
}

/// (b^s - a^s)/(b - a).
Complex divided_difference_of_powers(const Complex& a, const Complex& b, double s) {
  if (a == b) {
    return s * std::exp((s - 1.0) * logarithm(a));
  }
  const Complex mean = 0.5 * s * (logarithm(a) + logarithm(b));
  const Complex half = 0.5 * s * difference_of_logarithms(a, b);
  return std::exp(mean) * 2.0 * std::sinh(half) / (b - a);
}

/// The diagonal and the first superdiagonal of T^s.
void restore_power(const MatrixXcd& T, double s, MatrixXcd& P) {
  for (Index i = 0; i < T.rows(); ++i) {
    const Complex lambda = T(i, i);
    P(i, i) = lambda.imag() == 0.0 && lambda.real() > 0.0 ? std::pow(lambda.real(), s)
                                                          : std::exp(s * logarithm(lambda));
    if (i + 1 < T.rows()) {
      P(i, i + 1) = T(i, i + 1) * divided_difference_of_powers(T(i, i), T(i + 1, i + 1), s);
    }
  }
}

/// Up to here rows and columns one by one; beyond, matrices are halved, so that most of the work is
/// in products.
constexpr Index unhalved = 40;

/// C becomes the X of A X + X B = C, A and B upper triangular (Jonsson and Kågström, ACM
/// Transactions on Mathematical Software 28 (2002)).
void solve_sylvester(const Eigen::Ref<const MatrixXcd>& A, const Eigen::Ref<const MatrixXcd>& B,
                     Eigen::Ref<MatrixXcd> C) {
  const Index n = A.rows();
  const Index m = B.rows();
  if (n <= unhalved && m <= unhalved) {
    for (Index j = 0; j < m; ++j) {
      for (Index k = 0; k < j; ++k) {
        C.col(j) -= B(k, j) * C.col(k);
      }
      for (Index i = n - 1; i >= 0; --i) {
        C(i, j) /= A(i, i) + B(j, j);
        C.col(j).head(i) -= C(i, j) * A.col(i).head(i);
      }
    }
    return;
  }
  if (n >= m) {
    const Index half = n / 2;
    solve_sylvester(A.bottomRightCorner(n - half, n - half), B, C.bottomRows(n - half));
    C.topRows(half) -= complex_product(A.topRightCorner(half, n - half), C.bottomRows(n - half));
    solve_sylvester(A.topLeftCorner(half, half), B, C.topRows(half));
  } else {
    const Index half = m / 2;
    solve_sylvester(A, B.topLeftCorner(half, half), C.leftCols(half));
    C.rightCols(m - half) -= complex_product(C.leftCols(half), B.topRightCorner(half, m - half));
    solve_sylvester(A, B.bottomRightCorner(m - half, m - half), C.rightCols(m - half));
  }
}

/// The principal square root R of an upper triangular matrix (Björck and Hammarling; by halves:
/// Deadman, Higham and Ralha, Applied Parallel and Scientific Computing (2013)), R zero before.
void square_root(const Eigen::Ref<const MatrixXcd>& T, Eigen::Ref<MatrixXcd> R) {
  const Index n = T.rows();
  if (n > unhalved) {
    const Index half = n / 2;
    square_root(T.topLeftCorner(half, half), R.topLeftCorner(half, half));
    square_root(T.bottomRightCorner(n - half, n - half), R.bottomRightCorner(n - half, n - half));
    R.topRightCorner(half, n - half) = T.topRightCorner(half, n - half);
    solve_sylvester(R.topLeftCorner(half, half), R.bottomRightCorner(n - half, n - half),
                    R.topRightCorner(half, n - half));
    return;
  }
  for (Index j = 0; j < n; ++j) {
    R(j, j) = std::sqrt(T(j, j));
    for (Index i = j - 1; i >= 0; --i) {
      Complex sum = T(i, j);
      for (Index k = i + 1; k < j; ++k) {
        sum -= R(i, k) * R(k, j);
      }
      R(i, j) = sum / (R(i, i) + R(j, j));
    }
  }
}

MatrixXcd square_root(const MatrixXcd& T) {
  MatrixXcd R = MatrixXcd::Zero(T.rows(), T.cols());
  square_root(T, R);
  return R;
}

/// Bounds of ‖I - R‖₁ under which the [m/m] Padé approximants of log(1 + x) and (1 + x)^p, m = 1 …
/// 7, are exact to double precision (Higham and Lin, Table 3.1; those of log are a little larger).
constexpr std::array<double, 7> pade_bounds{1.51e-5, 2.24e-3, 1.88e-2, 6.04e-2,
                                            1.24e-1, 2.00e-1, 2.79e-1};

/// T^(1/2^k) - I with k so large that a Padé approximant serves, and that approximant's degree.
struct NearIdentity {
  MatrixXcd X;
  int roots = 0;
  int degree = 0;
};

NearIdentity take_roots(const MatrixXcd& T) {
  const Index n = T.rows();
  NearIdentity near;
  MatrixXcd R = T;
  int after_bound = 0;
  for (;;) {
    near.X = R;
    const double s = std::ldexp(1.0, -near.roots);
    for (Index i = 0; i < n; ++i) {
      near.X(i, i) = expm1(s * logarithm(T(i, i)));
    }
    const double size = norm1_of(near.X);
    if (size <= pade_bounds.back() || near.roots >= 100) {
      const auto at = [&](double value) {
        return static_cast<int>(std::lower_bound(pade_bounds.begin(), pade_bounds.end(), value) -
                                pade_bounds.begin()) +
               1;
      };
      near.degree = std::min(at(size), 7);
      // Another root halves X and costs as much as two degrees save.
      if (near.roots >= 100 || after_bound == 1 || near.degree - at(0.5 * size) <= 1) {
        return near;
      }
      ++after_bound;
    }
    R = square_root(R);
    ++near.roots;
    restore_power(T, std::ldexp(1.0, -near.roots), R);
  }
}

/// Nodes and weights of Gauss and Legendre's quadrature on [0, 1], by Newton's method.
struct Quadrature {
  std::vector<double> nodes;
  std::vector<double> weights;
};

Quadrature gauss_legendre(int m) {
  Quadrature rule;
  for (int i = 0; i < m; ++i) {
    double x = std::cos(pi * (i + 0.75) / (m + 0.5));
    double slope = 1.0;
    for (int pass = 0; pass < 50; ++pass) {
      double p = 1.0;
      double previous = 0.0;
      for (int k = 1; k <= m; ++k) {
        const double next = ((2.0 * k - 1.0) * x * p - (k - 1.0) * previous) / k;
        previous = p;
        p = next;
      }
      slope = m * (x * p - previous) / (x * x - 1.0);
      const double step = p / slope;
      x -= step;
      if (std::abs(step) < 1e-16) {
        break;
      }
    }
    rule.nodes.push_back(0.5 * (1.0 + x));
    rule.weights.push_back(1.0 / ((1.0 - x * x) * slope * slope));
  }
  return rule;
}

MatrixXcd shifted_by_identity(MatrixXcd X) {
  X.diagonal().array() += 1.0;
  return X;
}

}  // namespace

namespace {

void divide_by_triangle(const Eigen::Ref<const MatrixXcd>& T, Eigen::Ref<MatrixXcd> B) {
  const Index n = T.rows();
  if (n > unhalved) {
    const Index half = n / 2;
    // Of an upper triangular B the lower rows begin with zeros, which stay.
    const bool upper = B.cols() == n && B.bottomLeftCorner(n - half, half).isZero(0.0);
    const Index columns = upper ? n - half : B.cols();
    auto lower_rows = B.bottomRightCorner(n - half, columns);
    divide_by_triangle(T.bottomRightCorner(n - half, n - half), lower_rows);
    B.topRightCorner(half, columns) -=
        complex_product(T.topRightCorner(half, n - half), lower_rows);
    if (upper) {
      divide_by_triangle(T.topLeftCorner(half, half), B.topLeftCorner(half, half));
    }
    divide_by_triangle(T.topLeftCorner(half, half), B.topRightCorner(half, columns));
    return;
  }
  for (Index j = 0; j < B.cols(); ++j) {
    for (Index k = n - 1; k >= 0; --k) {
      if (B(k, j) != 0.0) {
        const Complex factor = B(k, j) / T(k, k);
        B(k, j) = factor;
        B.col(j).head(k) -= factor * T.col(k).head(k);
      }
    }
  }
}

}  // namespace

MatrixXcd solve_triangular(const MatrixXcd& T, MatrixXcd B) {
  divide_by_triangle(T, B);
  return B;
}

Eigen::MatrixXd logarithm_near_identity(const Eigen::MatrixXd& X) {
  const Quadrature rule = gauss_legendre(7);
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(X.rows(), X.cols());
  for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
    Eigen::MatrixXd denominator = rule.nodes[k] * X;
    denominator.diagonal().array() += 1.0;
    L += rule.weights[k] * solve_linear(denominator, X);
  }
  return L;
}

MatrixXcd triangular_logarithm(const MatrixXcd& T) {
  const NearIdentity near = take_roots(T);
  const Quadrature rule = gauss_legendre(near.degree);
  MatrixXcd L = MatrixXcd::Zero(T.rows(), T.cols());
  for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
    L += rule.weights[k] * solve_triangular(shifted_by_identity(rule.nodes[k] * near.X), near.X);
  }
  L *= std::ldexp(1.0, near.roots);
  for (Index i = 0; i < T.rows(); ++i) {
    L(i, i) = logarithm(T(i, i));
    if (i + 1 < T.rows()) {
      const Complex a = T(i, i);
      const Complex b = T(i + 1, i + 1);
      L(i, i + 1) =
          a == b ? T(i, i + 1) / a : T(i, i + 1) * (difference_of_logarithms(a, b) / (b - a));
    }
  }
  return L;
}

MatrixXcd triangular_power(const MatrixXcd& T, double p) {
  const NearIdentity near = take_roots(T);
  // (1 + x)^p as a continued fraction, from the inside out (Higham and Lin 2011, section 4, with
  // x for -x).
  const auto coefficient = [p](int k) {
    if (k == 1) {
      return -p;
    }
    const double j = k / 2;
    return k % 2 == 0 ? (-j + p) / (2.0 * (2.0 * j - 1.0)) : (-j - p) / (2.0 * (2.0 * j + 1.0));
  };
  const MatrixXcd x = -near.X;
  MatrixXcd S = coefficient(2 * near.degree) * x;
  for (int k = 2 * near.degree - 1; k >= 1; --k) {
    S = solve_triangular(shifted_by_identity(S), coefficient(k) * x);
  }
  MatrixXcd P = shifted_by_identity(std::move(S));
  restore_power(T, p * std::ldexp(1.0, -near.roots), P);
  for (int k = near.roots - 1; k >= 0; --k) {
    P = complex_product(P, P);
    restore_power(T, p * std::ldexp(1.0, -k), P);
  }
  return P;
}

void move_eigenvalue(MatrixXcd& T, MatrixXcd& U, Index from, Index to) {
  const Index step = from < to ? 1 : -1;
  for (Index at = from; at != to; at += step) {
    const Index k = std::min(at, at + step);
    // A rotation whose first column is the eigenvector (T_{k,k+1}, λ_{k+1} - λ_k) of λ_{k+1}.
    const Complex above = T(k, k + 1);
    const Complex gap = T(k + 1, k + 1) - T(k, k);
    const double size = std::hypot(std::abs(above), std::abs(gap));
    if (size == 0.0) {
      continue;
    }
    const Complex c = above / size;
    const Complex s = gap / size;
    const Complex first = T(k, k);
    const Complex second = T(k + 1, k + 1);
    const auto rotate_columns = [&](MatrixXcd& M) {
      const Eigen::VectorXcd left = M.col(k);
      const Eigen::VectorXcd right = M.col(k + 1);
      M.col(k) = left * c + right * s;
      M.col(k + 1) = right * std::conj(c) - left * std::conj(s);
    };
    rotate_columns(T);
    rotate_columns(U);
    const Eigen::RowVectorXcd upper = T.row(k);
    const Eigen::RowVectorXcd lower = T.row(k + 1);
    T.row(k) = std::conj(c) * upper + std::conj(s) * lower;
    T.row(k + 1) = c * lower - s * upper;
    T(k + 1, k) = 0.0;
    T(k, k) = second;
    T(k + 1, k + 1) = first;
  }
}

}  // namespace flyball::detail
