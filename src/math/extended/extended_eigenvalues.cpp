#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "math/dense/dense.hpp"
#include "math/extended/extended_eigenvalues.hpp"

// Compiled with -ffp-contract=off: a fused product would be no longer what the next line corrects.

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

struct Real {
  double hi = 0.0;
  double lo = 0.0;
};

Real operator-(Real a) {
  return {-a.hi, -a.lo};
}

Real operator+(Real a, Real b) {
  const double s = a.hi + b.hi;
  const double part = s - a.hi;
  const double rest = ((a.hi - (s - part)) + (b.hi - part)) + (a.lo + b.lo);
  const double high = s + rest;
  return {high, rest - (high - s)};
}

Real operator-(Real a, Real b) {
  return a + -b;
}

Real operator*(Real a, Real b) {
  const double p = a.hi * b.hi;
  const double rest = std::fma(a.hi, b.hi, -p) + (a.hi * b.lo + a.lo * b.hi);
  const double high = p + rest;
  return {high, rest - (high - p)};
}

Real operator/(Real a, Real b) {
  const double first = a.hi / b.hi;
  const Real left = a - Real{first} * b;
  const double second = left.hi / b.hi;
  const Real rest = left - Real{second} * b;
  return Real{first} + Real{second} + Real{rest.hi / b.hi};
}

Real square_root(Real a) {
  if (!(a.hi > 0.0)) {
    return {};
  }
  const double root = std::sqrt(a.hi);
  const Real left = a - Real{root} * Real{root};
  return Real{root} + Real{left.hi / (2.0 * root)};
}

struct Number {
  Real re;
  Real im;

  [[nodiscard]] Complex rounded() const { return {re.hi, im.hi}; }
  [[nodiscard]] double size() const { return std::abs(re.hi) + std::abs(im.hi); }
};

Number operator+(Number a, Number b) {
  return {a.re + b.re, a.im + b.im};
}
Number operator-(Number a, Number b) {
  return {a.re - b.re, a.im - b.im};
}
Number operator*(Number a, Number b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
Number conjugate(Number a) {
  return {a.re, -a.im};
}

template <class Entry>
class Square {
 public:
  explicit Square(Index n) : n_(n), entries_(static_cast<std::size_t>(n * n)) {}
  Entry& operator()(Index i, Index j) { return entries_[static_cast<std::size_t>(i * n_ + j)]; }

 private:
  Index n_;
  std::vector<Entry> entries_;
};

/// Upper Hessenberg form by eliminations, the largest entry of each column as pivot.
void reduce(Square<Real>& H, Index n) {
  for (Index m = 1; m + 1 < n; ++m) {
    Index pivot = m;
    for (Index i = m + 1; i < n; ++i) {
      pivot = std::abs(H(i, m - 1).hi) > std::abs(H(pivot, m - 1).hi) ? i : pivot;
    }
    if (H(pivot, m - 1).hi == 0.0) {
      continue;
    }
    if (pivot != m) {
      for (Index j = m - 1; j < n; ++j) {
        std::swap(H(pivot, j), H(m, j));
      }
      for (Index i = 0; i < n; ++i) {
        std::swap(H(i, pivot), H(i, m));
      }
    }
    for (Index i = m + 1; i < n; ++i) {
      const Real factor = H(i, m - 1) / H(m, m - 1);
      H(i, m - 1) = {};
      if (factor.hi == 0.0) {
        continue;
      }
      for (Index j = m; j < n; ++j) {
        H(i, j) = H(i, j) - factor * H(m, j);
      }
      for (Index k = 0; k < n; ++k) {
        H(k, m) = H(k, m) + factor * H(k, i);
      }
    }
  }
}

/// Of the last two rows' eigenvalues that nearer to the last entry, as a distance from it.
Complex wilkinson(Square<Number>& H, Index last) {
  const Complex half = 0.5 * (H(last - 1, last - 1) - H(last, last)).rounded();
  const Complex across = H(last - 1, last).rounded() * H(last, last - 1).rounded();
  Complex root = std::sqrt(half * half + across);
  if (std::real(half * std::conj(root)) < 0.0) {
    root = -root;
  }
  const Complex sum = half + root;
  return sum == Complex(0.0) ? Complex(0.0) : -across / sum;
}

/// H - σ = G₁ᴴ G₂ᴴ … R by rotations of neighbouring rows, R G₁ᴴ G₂ᴴ … + σ, between two indices.
void step(Square<Number>& H, Index first, Index last, Number shift) {
  std::vector<std::pair<Number, Number>> rotations(static_cast<std::size_t>(last - first));
  for (Index k = first; k <= last; ++k) {
    H(k, k) = H(k, k) - shift;
  }
  for (Index k = first; k < last; ++k) {
    auto& [c, s] = rotations[static_cast<std::size_t>(k - first)];
    const Number a = H(k, k);
    const Number b = H(k + 1, k);
    const Real length = square_root(a.re * a.re + a.im * a.im + b.re * b.re + b.im * b.im);
    if (length.hi == 0.0) {
      c = {{1.0}, {}};
      s = {};
      continue;
    }
    c = {a.re / length, a.im / length};
    s = {b.re / length, b.im / length};
    for (Index j = k; j <= last; ++j) {
      const Number upper = H(k, j);
      const Number lower = H(k + 1, j);
      H(k, j) = conjugate(c) * upper + conjugate(s) * lower;
      H(k + 1, j) = c * lower - s * upper;
    }
  }
  for (Index k = first; k < last; ++k) {
    const auto& [c, s] = rotations[static_cast<std::size_t>(k - first)];
    for (Index i = first; i <= std::min(k + 1, last); ++i) {
      const Number left = H(i, k);
      const Number right = H(i, k + 1);
      H(i, k) = left * c + right * s;
      H(i, k + 1) = right * conjugate(c) - left * conjugate(s);
    }
  }
  for (Index k = first; k <= last; ++k) {
    H(k, k) = H(k, k) + shift;
  }
}

/// Conjugates of each other to the last bit, or real. Each pair's mean: those of a cluster err
/// far more than their sum does, and what is made of all of them again must not.
void pair_up(Eigen::VectorXcd& values) {
  const Index n = values.size();
  std::vector<bool> done(static_cast<std::size_t>(n), false);
  for (Index i = 0; i < n; ++i) {
    if (done[static_cast<std::size_t>(i)]) {
      continue;
    }
    Index nearest = i;
    double distance = 2.0 * std::abs(values(i).imag());
    for (Index j = i + 1; j < n; ++j) {
      const double there = std::abs(values(j) - std::conj(values(i)));
      if (!done[static_cast<std::size_t>(j)] && there < distance) {
        distance = there;
        nearest = j;
      }
    }
    done[static_cast<std::size_t>(i)] = done[static_cast<std::size_t>(nearest)] = true;
    if (nearest == i) {
      values(i).imag(0.0);
    } else {
      values(i) = 0.5 * (values(i) + std::conj(values(nearest)));
      values(nearest) = std::conj(values(i));
    }
  }
}

}  // namespace

std::optional<Eigen::VectorXcd> extended_eigenvalues_of(const DoubleDoubleMatrix& M) {
  constexpr int most_steps = 60;
  constexpr double rounding = 1e-32;
  const Index n = M.rows();
  if (!M.all_finite()) {
    return std::nullopt;
  }
  Square<Real> real(n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      real(i, j) = Real{M.hi(i, j)} + Real{M.lo(i, j)};
    }
  }
  reduce(real, n);
  Square<Number> H(n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = std::max<Index>(0, i - 1); j < n; ++j) {
      H(i, j).re = real(i, j);
    }
  }
  const double size = M.norm();
  Eigen::VectorXcd values(n);
  int steps = 0;
  for (Index last = n - 1; last >= 0;) {
    Index first = last;
    while (first > 0) {
      const double beside = H(first, first).size() + H(first - 1, first - 1).size();
      if (H(first, first - 1).size() <= rounding * (beside > 0.0 ? beside : size)) {
        H(first, first - 1) = {};
        break;
      }
      --first;
    }
    if (first == last) {
      values(last) = H(last, last).rounded();
      --last;
      steps = 0;
      continue;
    }
    if (++steps > most_steps) {
      return std::nullopt;
    }
    const Complex apart =
        steps % 10 == 0 ? Complex(H(last, last - 1).size(), 0.0) : wilkinson(H, last);
    const Number shift = H(last, last) + Number{{apart.real()}, {apart.imag()}};
    step(H, first, last, shift);
  }
  if (!values.allFinite()) {
    return std::nullopt;
  }
  pair_up(values);
  return values;
}

std::optional<Eigen::VectorXcd> balanced_extended_eigenvalues_of(DoubleDoubleMatrix M) {
  const Eigen::VectorXd d = balance_of(M.rounded());
  for (Eigen::MatrixXd* part : {&M.hi, &M.lo}) {
    *part = d.cwiseInverse().asDiagonal() * *part * d.asDiagonal();
  }
  return extended_eigenvalues_of(M);
}

Eigen::VectorXcd wide_eigenvalues_of(WideMatrix M, long rate) {
  const WideMatrix S = balanced(std::move(M));
  const Index n = S.rows();
  const long unit = S.exponent();
  DoubleDoubleMatrix digits(S.rounded(-unit));
  digits.lo = sum(S, -1.0,
                  WideMatrix(digits.hi).times_powers(Eigen::VectorXi::Zero(n),
                                                     Eigen::VectorXi::Zero(n), unit))
                  .rounded(-unit);
  const auto extended = balanced_extended_eigenvalues_of(digits);
  Eigen::VectorXcd values = extended ? *extended : eigenvalues_of(digits.hi);
  for (Complex& value : values) {
    const int power = static_cast<int>(std::clamp(unit + rate, -9999L, 9999L));
    value = {std::ldexp(value.real(), power), std::ldexp(value.imag(), power)};
  }
  return values;
}

}  // namespace flyball::detail
