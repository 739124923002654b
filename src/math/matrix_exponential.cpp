#include <flyball/math/matrix_exponential.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "math/dense.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

using detail::norm1;
using detail::product;

/// (e^x - e^y) / (x - y), for any distance of x and y.
double divided_difference(double x, double y) {
  const double half = 0.5 * (x - y);
  if (std::abs(half) < 1.0) {
    // e^((x+y)/2) sinh(h)/h; the series of sinh(h)/h below h where it is exact.
    const double sinch = std::abs(half) < 1e-4 ? 1.0 + half * half / 6.0 : std::sinh(half) / half;
    return std::exp(0.5 * (x + y)) * sinch;
  }
  return (std::exp(x) - std::exp(y)) / (x - y);
}

/// p q - r s without cancellation of the products' rounding errors (Kahan).
double difference_of_products(double p, double q, double r, double s) {
  const double rs = r * s;
  return std::fma(p, q, -rs) + std::fma(-r, s, rs);
}

/// Closed form of a 2x2: exp(A) = e^μ (cosh δ I + sinh δ / δ (A - μ I)), μ = (a + d)/2,
/// δ² = ((a - d)/2)² + b c, written in the eigenvalues μ ± δ so that nothing overflows on the way.
MatrixXd expm_2x2(const MatrixXd& A) {
  const double a = A(0, 0);
  const double b = A(0, 1);
  const double c = A(1, 0);
  const double d = A(1, 1);
  MatrixXd E(2, 2);
  const double mean = 0.5 * a + 0.5 * d;
  const double half = 0.5 * a - 0.5 * d;
  const double discriminant = difference_of_products(half, half, -b, c);
  if (b == 0.0 || c == 0.0) {
    const double f = divided_difference(a, d);
    E << std::exp(a), b == 0.0 ? 0.0 : b * f, c == 0.0 ? 0.0 : c * f, std::exp(d);
  } else if (discriminant >= 0.0) {
    const double delta = std::sqrt(discriminant);
    // The eigenvalue of larger magnitude is free of cancellation; the other is det / it.
    const double large = mean >= 0.0 ? mean + delta : mean - delta;
    const double small = large == 0.0 ? 0.0 : difference_of_products(a, d, b, c) / large;
    const double f = divided_difference(large, small);
    const double cosh = 0.5 * (std::exp(large) + std::exp(small));
    // With g = half·f, e^μ cosh δ ± g; a - λ is formed without cancellation where signs agree.
    E << cosh + half * f, b * f, c * f, cosh - half * f;
  } else {
    const double omega = std::sqrt(-discriminant);
    const double scale = std::exp(mean);
    const double f = scale * (std::sin(omega) / omega);
    const double cosine = scale * std::cos(omega);
    E << cosine + half * f, b * f, c * f, cosine - half * f;
  }
  return E;
}

/// Extra squarings that the rounding of the order-m approximant asks for (Al-Mohy and Higham,
/// equation 3.11 and 5.1): ‖ |A|^(2m+1) ‖₁ is exact by products of |A| with a vector.
int extra_squarings(const MatrixXd& A, int m) {
  const MatrixXd absolute = A.cwiseAbs();
  Eigen::RowVectorXd sums = Eigen::RowVectorXd::Ones(A.cols());
  double log2_scale = 0.0;
  for (int k = 0; k < 2 * m + 1; ++k) {
    sums = sums * absolute;
    const double largest = sums.maxCoeff();
    if (largest == 0.0) {
      return 0;
    }
    log2_scale += std::log2(largest);
    sums /= largest;
  }
  // 1 / |c_(2m+1)| = binomial(2m, m) (2m + 1)!
  double log2_c = 0.0;
  for (int k = 1; k <= m; ++k) {
    log2_c += std::log2(static_cast<double>(m + k) / k);
  }
  for (int k = 2; k <= 2 * m + 1; ++k) {
    log2_c += std::log2(static_cast<double>(k));
  }
  const double log2_alpha = log2_scale - log2_c - std::log2(norm1(A));
  return std::max(0, static_cast<int>(std::ceil((log2_alpha + 53.0) / (2.0 * m))));
}

/// (V - U)⁻¹ (V + U) with the odd part U and the even part V of the Padé numerator.
MatrixXd pade_quotient(const MatrixXd& U, const MatrixXd& V) {
  return detail::solve_linear(V - U, V + U);
}

/// Order 3, 5, 7, 9: coefficients b₀ … b_m, powers[k] = A^(2k).
MatrixXd pade_low(const MatrixXd& A, std::span<const double> b, std::span<const MatrixXd> powers) {
  const Index n = A.rows();
  MatrixXd odd = b[1] * MatrixXd::Identity(n, n);
  MatrixXd even = b[0] * MatrixXd::Identity(n, n);
  for (std::size_t k = 1; 2 * k < b.size(); ++k) {
    even += b[2 * k] * powers[k];
    odd += b[2 * k + 1] * powers[k];
  }
  return pade_quotient(product(A, odd), even);
}

MatrixXd pade_13(const MatrixXd& A, const MatrixXd& A2, const MatrixXd& A4, const MatrixXd& A6) {
  constexpr std::array<double, 14> b{64764752532480000.0,
                                     32382376266240000.0,
                                     7771770303897600.0,
                                     1187353796428800.0,
                                     129060195264000.0,
                                     10559470521600.0,
                                     670442572800.0,
                                     33522128640.0,
                                     1323241920.0,
                                     40840800.0,
                                     960960.0,
                                     16380.0,
                                     182.0,
                                     1.0};
  const MatrixXd I = MatrixXd::Identity(A.rows(), A.cols());
  const MatrixXd U = product(A, product(A6, b[13] * A6 + b[11] * A4 + b[9] * A2) + b[7] * A6 +
                                    b[5] * A4 + b[3] * A2 + b[1] * I);
  const MatrixXd V = product(A6, b[12] * A6 + b[10] * A4 + b[8] * A2) + b[6] * A6 + b[4] * A4 +
                     b[2] * A2 + b[0] * I;
  return pade_quotient(U, V);
}

/// The exact diagonal and first superdiagonal of exp(2^-k T) (Algorithm 2.1), T upper triangular.
void restore_diagonals(const MatrixXd& T, int k, MatrixXd& E) {
  const Index n = T.rows();
  for (Index i = 0; i < n; ++i) {
    E(i, i) = std::exp(std::ldexp(T(i, i), -k));
    if (i + 1 < n) {
      const double f = divided_difference(std::ldexp(T(i, i), -k), std::ldexp(T(i + 1, i + 1), -k));
      E(i, i + 1) = std::ldexp(T(i, i + 1), -k) * f;
    }
  }
}

MatrixXd scaling_and_squaring(MatrixXd A, bool triangular) {
  constexpr std::array<double, 4> b3{120.0, 60.0, 12.0, 1.0};
  constexpr std::array<double, 6> b5{30240.0, 15120.0, 3360.0, 420.0, 30.0, 1.0};
  constexpr std::array<double, 8> b7{17297280.0, 8648640.0, 1995840.0, 277200.0,
                                     25200.0,    1512.0,    56.0,      1.0};
  constexpr std::array<double, 10> b9{17643225600.0, 8821612800.0, 2075673600.0, 302702400.0,
                                      30270240.0,    2162160.0,    110880.0,     3960.0,
                                      90.0,          1.0};
  constexpr double theta3 = 1.495585217958292e-2;
  constexpr double theta5 = 2.539398330063230e-1;
  constexpr double theta7 = 9.504178996162932e-1;
  constexpr double theta9 = 2.097847961257068;
  constexpr double theta13 = 4.25;

  const MatrixXd original = A;
  // Powers up to the tenth must not overflow while the order is chosen.
  const double norm = norm1(A);
  const int prescale = norm > 1e25 ? static_cast<int>(std::ceil(std::log2(norm / 1e25))) : 0;
  A *= std::ldexp(1.0, -prescale);

  std::array<MatrixXd, 5> powers;
  powers[1] = product(A, A);
  powers[2] = product(powers[1], powers[1]);
  powers[3] = product(powers[1], powers[2]);
  const double d4 = std::pow(norm1(powers[2]), 1.0 / 4.0);
  const double d6 = std::pow(norm1(powers[3]), 1.0 / 6.0);
  int squarings = prescale;
  MatrixXd E;
  if (prescale == 0) {
    const double eta1 = std::max(d4, d6);
    if (eta1 <= theta3 && extra_squarings(A, 3) == 0) {
      E = pade_low(A, b3, powers);
    } else if (eta1 <= theta5 && extra_squarings(A, 5) == 0) {
      E = pade_low(A, b5, powers);
    }
  }
  if (E.size() == 0) {
    powers[4] = product(powers[2], powers[2]);
    const double d8 = std::pow(norm1(powers[4]), 1.0 / 8.0);
    const double eta3 = std::max(d6, d8);
    if (prescale == 0 && eta3 <= theta7 && extra_squarings(A, 7) == 0) {
      E = pade_low(A, b7, powers);
    } else if (prescale == 0 && eta3 <= theta9 && extra_squarings(A, 9) == 0) {
      E = pade_low(A, b9, powers);
    } else {
      const double d10 = std::pow(norm1(product(powers[2], powers[3])), 1.0 / 10.0);
      const double eta5 = std::min(eta3, std::max(d8, d10));
      int s = eta5 > 0.0 ? std::max(0, static_cast<int>(std::ceil(std::log2(eta5 / theta13)))) : 0;
      s += extra_squarings(std::ldexp(1.0, -s) * A, 13);
      squarings += s;
      E = pade_13(std::ldexp(1.0, -s) * A, std::ldexp(1.0, -2 * s) * powers[1],
                  std::ldexp(1.0, -4 * s) * powers[2], std::ldexp(1.0, -6 * s) * powers[3]);
    }
  }
  if (triangular) {
    E.triangularView<Eigen::StrictlyLower>().setZero();
    restore_diagonals(original, squarings, E);
  }
  for (int k = squarings - 1; k >= 0; --k) {
    E = product(E, E);
    if (triangular) {
      restore_diagonals(original, k, E);
    }
  }
  return E;
}

bool is_upper_triangular(const MatrixXd& A) {
  for (Index j = 0; j < A.cols(); ++j) {
    for (Index i = j + 1; i < A.rows(); ++i) {
      if (A(i, j) != 0.0) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace

ErrorInfo error_info(MatrixExponentialError code) {
  constexpr std::string_view family = "matrix_exponential";
  switch (code) {
    case MatrixExponentialError::overflow:
      return {family, "overflow", "exp(A) exceeds the largest double", ErrorKind::no_answer};
  }
  return {family, "unknown", "unknown error", ErrorKind::defect};
}

Expected<MatrixXd> expm(const MatrixRef& A) {
  if (auto check = check_square(A, "expm", "A"); !check) {
    return tl::unexpected(std::move(check).error());
  }
  if (auto check = check_finite(A, "expm", "A"); !check) {
    return tl::unexpected(std::move(check).error());
  }
  MatrixXd E;
  if (A.rows() == 1) {
    E = A.array().exp();
  } else if (A.rows() == 2) {
    E = expm_2x2(A);
  } else if (is_upper_triangular(A)) {
    E = scaling_and_squaring(A, true);
  } else if (is_upper_triangular(A.transpose())) {
    E = scaling_and_squaring(A.transpose(), true).transpose();
  } else {
    const VectorXd d = detail::balance_of(A);
    E = d.asDiagonal() *
        scaling_and_squaring(d.cwiseInverse().asDiagonal() * A * d.asDiagonal(), false) *
        d.cwiseInverse().asDiagonal();
  }
  if (!E.allFinite()) {
    const double scale = std::max(1.0, A.cwiseAbs().maxCoeff());
    const double abscissa = detail::eigenvalues_of(A / scale).real().maxCoeff() * scale;
    return tl::unexpected(Error(MatrixExponentialError::overflow)
                              .in("expm")
                              .about("exp(A)")
                              .hint("exponents above 709.78 have no double; shorten the time step")
                              .with("spectral abscissa of A", abscissa));
  }
  return E;
}

}  // namespace flyball
