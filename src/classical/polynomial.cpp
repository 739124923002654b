#include <algorithm>
#include <cmath>

#include "classical/polynomial.hpp"
#include "math/extended/extended_eigenvalues.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Row i of a column vector.
Polynomial entry(const Polynomial& p, Index i) {
  return p.block(i, 0, 1, 1);
}

/// Zero rows in front, so that there are that many in all.
Polynomial padded(const Polynomial& p, Index rows) {
  Polynomial more = Polynomial::zero(rows, 1);
  more.hi.bottomRows(p.rows()) = p.hi;
  more.lo.bottomRows(p.rows()) = p.lo;
  return more;
}

}  // namespace

Polynomial polynomial(const VectorXd& coefficients) {
  return Polynomial(MatrixXd(coefficients));
}

Polynomial times(const Polynomial& a, const Polynomial& b) {
  Polynomial convolution = Polynomial::zero(a.rows() + b.rows() - 1, b.rows());
  for (Index j = 0; j < b.rows(); ++j) {
    convolution.hi.block(j, j, a.rows(), 1) = a.hi;
    convolution.lo.block(j, j, a.rows(), 1) = a.lo;
  }
  return product(convolution, b);
}

Polynomial plus(const Polynomial& a, double sign, const Polynomial& b) {
  const Index rows = std::max(a.rows(), b.rows());
  return sum(padded(a, rows), sign, padded(b, rows));
}

Polynomial trimmed(const Polynomial& p) {
  Index first = 0;
  while (first + 1 < p.rows() && p.hi(first, 0) == 0.0 && p.lo(first, 0) == 0.0) {
    ++first;
  }
  return p.block(first, 0, p.rows() - first, 1);
}

Polynomial derivative(const Polynomial& p) {
  const Index n = p.rows() - 1;
  if (n == 0) {
    return Polynomial::zero(1, 1);
  }
  Polynomial weights = Polynomial::zero(n, n);
  for (Index i = 0; i < n; ++i) {
    weights.hi(i, i) = static_cast<double>(n - i);
  }
  return product(weights, p.block(0, 0, n, 1));
}

std::complex<double> value(const VectorXd& p, std::complex<double> at) {
  std::complex<double> sum = 0.0;
  for (const double coefficient : p) {
    sum = sum * at + coefficient;
  }
  return sum;
}

std::optional<Eigen::VectorXcd> roots(const Polynomial& given) {
  const Polynomial p = trimmed(given);
  Index n = p.rows() - 1;
  Index at_zero = 0;
  while (n > 0 && p.hi(n, 0) == 0.0 && p.lo(n, 0) == 0.0) {
    --n;
    ++at_zero;
  }
  Eigen::VectorXcd all = Eigen::VectorXcd::Zero(n + at_zero);
  if (n == 0) {
    return all;
  }
  // Divided in 31 digits, in a unit in which the roots' geometric mean is about one.
  const int unit = unit_of(p.hi.col(0));
  Polynomial companion = Polynomial::zero(n, n);
  for (Index i = 1; i <= n; ++i) {
    auto share = solve(entry(p, 0), entry(p, i));
    if (!share) {
      return std::nullopt;
    }
    const int power = -unit * static_cast<int>(i);
    companion.hi(0, i - 1) = -std::ldexp(share->hi(0, 0), power);
    companion.lo(0, i - 1) = -std::ldexp(share->lo(0, 0), power);
    if (i < n) {
      companion.hi(i, i - 1) = 1.0;
    }
  }
  if (!companion.all_finite()) {
    return std::nullopt;
  }
  const auto found = flyball::detail::balanced_extended_eigenvalues_of(companion);
  if (!found) {
    return std::nullopt;
  }
  for (Index i = 0; i < n; ++i) {
    all(i) = {std::ldexp((*found)(i).real(), unit), std::ldexp((*found)(i).imag(), unit)};
  }
  return all;
}

int unit_of(const VectorXd& p) {
  const Index n = p.size() - 1;
  for (Index i = n; i > 0; --i) {
    if (p(i) != 0.0) {
      const double mean =
          (std::log2(std::abs(p(i))) - std::log2(std::abs(p(0)))) / static_cast<double>(i);
      return static_cast<int>(std::lround(mean));
    }
  }
  return 0;
}

void change_unit(Polynomial& p, int unit) {
  const Index n = p.rows() - 1;
  for (Index i = 0; i <= n; ++i) {
    const int power = unit * static_cast<int>(n - i);
    p.hi(i, 0) = std::ldexp(p.hi(i, 0), power);
    p.lo(i, 0) = std::ldexp(p.lo(i, 0), power);
  }
}

OnTheAxis on_the_axis(const Polynomial& p) {
  const Index n = p.rows() - 1;
  OnTheAxis parts{Polynomial::zero(n / 2 + 1, 1), Polynomial::zero((n + 1) / 2 + (n == 0), 1)};
  for (Index power = 0; power <= n; ++power) {
    // (jω)^{2k} = (-1)^k x^k, (jω)^{2k+1} = jω (-1)^k x^k.
    const double sign = (power / 2) % 2 == 0 ? 1.0 : -1.0;
    Polynomial& part = power % 2 == 0 ? parts.even : parts.odd;
    const Index row = part.rows() - 1 - power / 2;
    part.hi(row, 0) = sign * p.hi(n - power, 0);
    part.lo(row, 0) = sign * p.lo(n - power, 0);
  }
  return parts;
}

Polynomial bilinear(const Polynomial& p, Index degree) {
  // Σ pᵢ (1 + w)ⁱ (1 - w)^{n-i}, by Horner's scheme on (1 + w) and the powers of (1 - w).
  const Polynomial up = polynomial(Eigen::Vector2d(1.0, 1.0));
  const Polynomial down = polynomial(Eigen::Vector2d(-1.0, 1.0));
  const Index n = p.rows() - 1;
  Polynomial sum = entry(p, 0);
  Polynomial power = polynomial(VectorXd::Ones(1));
  for (Index i = 1; i <= n; ++i) {
    power = times(power, down);
    sum = plus(times(sum, up), 1.0, times(entry(p, i), power));
  }
  for (Index i = n; i < degree; ++i) {
    sum = times(sum, down);
  }
  return sum;
}

void settle_on_border(Eigen::VectorXcd& roots, const Polynomial& p, bool discrete) {
  constexpr double beside = 1e-4;  // what rounding leaves of a triple root
  for (std::complex<double>& root : roots) {
    const std::complex<double> on = !discrete ? std::complex<double>(0.0, root.imag())
                                    : root.imag() == 0.0
                                        ? std::complex<double>(std::copysign(1.0, root.real()), 0.0)
                                    : std::abs(root) == 0.0 ? std::complex<double>(1.0)
                                                            : root / std::abs(root);
    if (root == on || !(std::abs(root - on) <= beside * std::abs(on))) {
      continue;
    }
    std::complex<double> sum = 0.0;
    double size = 0.0;
    for (Eigen::Index i = 0; i < p.rows(); ++i) {
      sum = sum * on + p.hi(i, 0);
      size = size * std::abs(on) + std::abs(p.hi(i, 0));
    }
    if (std::abs(sum) <= 1e-15 * static_cast<double>(p.rows()) * size) {
      root = on;
    }
  }
}

std::optional<std::vector<double>> positive_roots(const Polynomial& p) {
  const Polynomial q = trimmed(p);
  if (q.hi.isZero(0.0)) {
    return std::vector<double>{};
  }
  const auto all = roots(q);
  if (!all) {
    return std::nullopt;
  }
  std::vector<double> found;
  for (const std::complex<double>& root : *all) {
    // Two that touch are told apart from the axis by half of the 31 digits.
    if (root.real() > 0.0 && root.imag() >= 0.0 && std::abs(root.imag()) <= 1e-9 * root.real()) {
      found.push_back(root.real());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace flyball::classical::detail
