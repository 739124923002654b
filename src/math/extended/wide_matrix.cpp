#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "math/extended/wide_matrix.hpp"

// Compiled with -ffp-contract=off: a fused product would be no longer what the next line corrects.

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Number = WideNumber;

constexpr long least_exponent = std::numeric_limits<long>::min() / 4;

double ldexp_of(double x, long exponent) {
  return std::ldexp(x, static_cast<int>(std::clamp(exponent, -9999L, 9999L)));
}

/// 2^e of a normal double.
double power_of_two(int e) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(e + 1023) << 52);
}

Number normalized(double hi, double lo, long exponent) {
  if (hi == 0.0) {
    return {};
  }
  if (!std::isfinite(hi)) {
    return {hi - hi, 0.0, 0};
  }
  // By the bits of a normal number, which nearly all are.
  const int own = static_cast<int>((std::bit_cast<std::uint64_t>(hi) >> 52) & 0x7ff) - 1023;
  if (own > -1000 && own < 1000) {
    const double unit = power_of_two(-own);
    return {hi * unit, lo * unit, exponent + own};
  }
  const int slow = std::ilogb(hi);
  return {std::ldexp(hi, -slow), std::ldexp(lo, -slow), exponent + slow};
}

Number from(double x) {
  return normalized(x, 0.0, 0);
}

Number add(Number a, Number b) {
  if (a.hi == 0.0 || b.hi == 0.0) {
    return a.hi == 0.0 ? b : a;
  }
  if (a.exponent < b.exponent) {
    std::swap(a, b);
  }
  const long apart = a.exponent - b.exponent;
  constexpr long nothing = 220;
  if (apart > nothing) {
    return std::isfinite(b.hi) ? a : b;
  }
  const double unit = power_of_two(-static_cast<int>(apart));
  const double b_hi = b.hi * unit;
  const double b_lo = b.lo * unit;
  const double s = a.hi + b_hi;
  const double s_part = s - a.hi;
  double s_rest = (a.hi - (s - s_part)) + (b_hi - s_part);
  const double t = a.lo + b_lo;
  const double t_part = t - a.lo;
  const double t_rest = (a.lo - (t - t_part)) + (b_lo - t_part);
  s_rest += t;
  const double high = s + s_rest;
  const double low = (s_rest - (high - s)) + t_rest;
  const double top = high + low;
  return normalized(top, low - (top - high), a.exponent);
}

Number multiply(Number a, Number b) {
  const double p = a.hi * b.hi;
  const double rest = std::fma(a.hi, b.hi, -p) + (a.hi * b.lo + a.lo * b.hi);
  const double high = p + rest;
  return normalized(high, rest - (high - p), a.exponent + b.exponent);
}

Number negative(Number a) {
  return {-a.hi, -a.lo, a.exponent};
}

Number divide(Number a, Number b) {
  const auto quotient = [&](Number x) {
    return normalized(x.hi / b.hi, 0.0, x.exponent - b.exponent);
  };
  const Number first = quotient(a);
  const Number left = add(a, negative(multiply(first, b)));
  const Number second = quotient(left);
  const Number rest = add(left, negative(multiply(second, b)));
  return add(add(first, second), quotient(rest));
}

/// Whether |a| > |b|.
bool is_larger(Number a, Number b) {
  if (a.hi == 0.0 || b.hi == 0.0) {
    return a.hi != 0.0;
  }
  return a.exponent != b.exponent ? a.exponent > b.exponent : std::abs(a.hi) > std::abs(b.hi);
}

Number largest_of(const WideMatrix& M) {
  Number largest;
  for (Index j = 0; j < M.cols(); ++j) {
    for (Index i = 0; i < M.rows(); ++i) {
      if (is_larger(M(i, j), largest)) {
        largest = M(i, j);
      }
    }
  }
  return largest;
}

}  // namespace

WideMatrix::WideMatrix(const MatrixXd& value) : WideMatrix(value.rows(), value.cols()) {
  std::transform(value.data(), value.data() + value.size(), entries_.begin(), from);
}

WideMatrix WideMatrix::zero(Index rows, Index columns) {
  return WideMatrix(rows, columns);
}

WideMatrix WideMatrix::identity(Index size) {
  return WideMatrix(MatrixXd(MatrixXd::Identity(size, size)));
}

MatrixXd WideMatrix::rounded(long exponent) const {
  MatrixXd M(rows_, columns_);
  for (Index k = 0; k < M.size(); ++k) {
    const Number& x = entries_[static_cast<std::size_t>(k)];
    M.data()[k] = ldexp_of(x.hi + x.lo, x.exponent + exponent);
  }
  return M;
}

double WideMatrix::norm() const {
  const Number largest = largest_of(*this);
  return largest.hi == 0.0 ? 0.0 : ldexp_of(rounded(-largest.exponent).norm(), largest.exponent);
}

bool WideMatrix::all_finite() const {
  return std::all_of(entries_.begin(), entries_.end(),
                     [](const Number& x) { return std::isfinite(x.hi); });
}

WideMatrix WideMatrix::transpose() const {
  WideMatrix M(columns_, rows_);
  for (Index j = 0; j < columns_; ++j) {
    for (Index i = 0; i < rows_; ++i) {
      M(j, i) = (*this)(i, j);
    }
  }
  return M;
}

WideMatrix WideMatrix::columns_from(Index first, Index count) const {
  WideMatrix M(rows_, count);
  std::copy_n(entries_.begin() + first * rows_, count * rows_, M.entries_.begin());
  return M;
}

WideMatrix WideMatrix::left(Index columns) const {
  return columns_from(0, columns);
}

WideMatrix WideMatrix::right(Index columns) const {
  return columns_from(columns_ - columns, columns);
}

WideMatrix WideMatrix::magnitudes() const {
  WideMatrix M = *this;
  for (Number& x : M.entries_) {
    x = x.hi < 0.0 ? negative(x) : x;
  }
  return M;
}

WideMatrix WideMatrix::times_powers(const Eigen::VectorXi& row, const Eigen::VectorXi& column,
                                    long all) const {
  WideMatrix M = *this;
  for (Index j = 0; j < columns_; ++j) {
    for (Index i = 0; i < rows_; ++i) {
      M(i, j).exponent += M(i, j).hi != 0.0 ? row(i) + column(j) + all : 0;
    }
  }
  return M;
}

long WideMatrix::exponent() const {
  const Number largest = largest_of(*this);
  return largest.hi == 0.0 ? least_exponent : largest.exponent;
}

WideMatrix add_product(WideMatrix C, double sign, const WideMatrix& A, const WideMatrix& B) {
  for (Index j = 0; j < B.cols(); ++j) {
    for (Index k = 0; k < B.rows(); ++k) {
      const Number b = multiply(from(sign), B(k, j));
      for (Index i = 0; b.hi != 0.0 && i < C.rows(); ++i) {
        C(i, j) = add(C(i, j), multiply(A(i, k), b));
      }
    }
  }
  return C;
}

WideMatrix product(const WideMatrix& A, const WideMatrix& B) {
  return add_product(WideMatrix::zero(A.rows(), B.cols()), 1.0, A, B);
}

WideMatrix sum(WideMatrix A, double sign, const WideMatrix& B) {
  for (Index j = 0; j < A.cols(); ++j) {
    for (Index i = 0; i < A.rows(); ++i) {
      A(i, j) = add(A(i, j), multiply(from(sign), B(i, j)));
    }
  }
  return A;
}

WideMatrix shifted_diagonal(WideMatrix A, double scalar) {
  for (Index i = 0; i < A.rows(); ++i) {
    A(i, i) = add(A(i, i), from(scalar));
  }
  return A;
}

WideMatrix scaled(WideMatrix A, double f) {
  for (Index j = 0; j < A.cols(); ++j) {
    for (Index i = 0; i < A.rows(); ++i) {
      A(i, j) = multiply(A(i, j), from(f));
    }
  }
  return A;
}

WideMatrix symmetrized(const WideMatrix& A) {
  return scaled(sum(A, 1.0, A.transpose()), 0.5);
}

WideMatrix beside(const WideMatrix& A, const WideMatrix& B) {
  WideMatrix both = WideMatrix::zero(A.rows(), A.cols() + B.cols());
  for (Index i = 0; i < A.rows(); ++i) {
    for (Index j = 0; j < both.cols(); ++j) {
      both(i, j) = j < A.cols() ? A(i, j) : B(i, j - A.cols());
    }
  }
  return both;
}

std::optional<WideMatrix> solve(WideMatrix A, WideMatrix B) {
  const Index n = A.rows();
  for (Index i = 0; i < n; ++i) {
    long most = least_exponent;
    for (Index j = 0; j < n; ++j) {
      most = A(i, j).hi != 0.0 ? std::max(most, A(i, j).exponent) : most;
    }
    if (most == least_exponent) {
      return std::nullopt;
    }
    for (Index j = 0; j < n; ++j) {
      A(i, j).exponent -= A(i, j).hi != 0.0 ? most : 0;
    }
    for (Index j = 0; j < B.cols(); ++j) {
      B(i, j).exponent -= B(i, j).hi != 0.0 ? most : 0;
    }
  }
  if (!A.all_finite() || !B.all_finite()) {
    return std::nullopt;
  }
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i) {
      pivot = is_larger(A(i, k), A(pivot, k)) ? i : pivot;
    }
    if (A(pivot, k).hi == 0.0) {
      return std::nullopt;
    }
    for (Index j = 0; pivot != k && j < n; ++j) {
      std::swap(A(k, j), A(pivot, j));
    }
    for (Index j = 0; pivot != k && j < B.cols(); ++j) {
      std::swap(B(k, j), B(pivot, j));
    }
    for (Index i = k + 1; i < n; ++i) {
      if (A(i, k).hi == 0.0) {
        continue;
      }
      const Number factor = negative(divide(A(i, k), A(k, k)));
      for (Index j = k + 1; j < n; ++j) {
        A(i, j) = add(A(i, j), multiply(factor, A(k, j)));
      }
      for (Index j = 0; j < B.cols(); ++j) {
        B(i, j) = add(B(i, j), multiply(factor, B(k, j)));
      }
    }
  }
  for (Index k = n - 1; k >= 0; --k) {
    for (Index j = 0; j < B.cols(); ++j) {
      B(k, j) = divide(B(k, j), A(k, k));
      const Number x = negative(B(k, j));
      for (Index i = 0; x.hi != 0.0 && i < k; ++i) {
        B(i, j) = add(B(i, j), multiply(A(i, k), x));
      }
    }
  }
  return B;
}

double share_of(const WideMatrix& left, const WideMatrix& terms) {
  if (!left.all_finite() || !terms.all_finite()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Number rest = largest_of(left);
  const Number whole = largest_of(terms);
  return rest.hi == 0.0 ? 0.0
                        : ldexp_of(std::abs(rest.hi / whole.hi), rest.exponent - whole.exponent);
}

WideMatrix balanced(WideMatrix M) {
  constexpr int most_sweeps = 100;
  const Index n = M.rows();
  const auto larger = [](std::optional<long>& largest, const WideNumber& entry) {
    if (entry.hi != 0.0 && (!largest || *largest < entry.exponent)) {
      largest = entry.exponent;
    }
  };
  bool changed = true;
  for (int sweep = 0; changed && sweep < most_sweeps; ++sweep) {
    changed = false;
    for (Index i = 0; i < n; ++i) {
      std::optional<long> row;
      std::optional<long> column;
      for (Index j = 0; j < n; ++j) {
        if (j != i) {
          larger(row, M(i, j));
          larger(column, M(j, i));
        }
      }
      if (!row && !column) {
        continue;
      }
      const long power = row && column ? (*row - *column) / 2 : 0;
      for (Index j = 0; j < n; ++j) {
        if (j != i && row && column) {
          M(i, j).exponent -= power;
          M(j, i).exponent += power;
        } else if (j != i) {
          M(i, j) = M(j, i) = {};
        }
      }
      changed = changed || power != 0 || !row || !column;
    }
  }
  return M;
}

}  // namespace flyball::detail
