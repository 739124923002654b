#include <algorithm>
#include <cmath>
#include <vector>

#include "control/placement.hpp"

namespace flyball::detail {

namespace {

/// An unevaluated sum of two doubles as a number, about 31 digits. Source: Dekker, Numerische
/// Mathematik 18 (1971).
struct Sum {
  double hi = 0.0;
  double lo = 0.0;
};

Sum quick(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

Sum operator+(Sum a, Sum b) {
  const double sum = a.hi + b.hi;
  const double part = sum - a.hi;
  const double rest = (a.hi - (sum - part)) + (b.hi - part);
  return quick(sum, rest + a.lo + b.lo);
}

Sum operator-(Sum a) {
  return {-a.hi, -a.lo};
}

Sum operator*(Sum a, Sum b) {
  const double product = a.hi * b.hi;
  return quick(product, std::fma(a.hi, b.hi, -product) + (a.hi * b.lo + a.lo * b.hi));
}

Sum operator/(Sum a, Sum b) {
  const double first = a.hi / b.hi;
  const Sum rest = a + -(b * Sum{first, 0.0});
  const double second = rest.hi / b.hi;
  const Sum rest_2 = rest + -(b * Sum{second, 0.0});
  return quick(first, second) + Sum{rest_2.hi / b.hi, 0.0};
}

using SumVector = std::vector<Sum>;

/// A v.
SumVector image_of(const MatrixRef& A, const SumVector& v) {
  SumVector result(v.size());
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    Sum sum;
    for (Eigen::Index k = 0; k < A.cols(); ++k) {
      sum = sum + Sum{A(i, k), 0.0} * v[static_cast<std::size_t>(k)];
    }
    result[static_cast<std::size_t>(i)] = sum;
  }
  return result;
}

/// The x with rows x = right by elimination with row pivoting; nothing where the pivots fall so far
/// that even twice the working precision has no digit left.
std::optional<SumVector> solve(std::vector<SumVector> rows, SumVector right) {
  constexpr double lost = 1e-26;
  const std::size_t n = right.size();
  double largest_pivot = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; ++i) {
      if (std::abs(rows[i][k].hi) > std::abs(rows[pivot][k].hi)) {
        pivot = i;
      }
    }
    std::swap(rows[k], rows[pivot]);
    std::swap(right[k], right[pivot]);
    const double size = std::abs(rows[k][k].hi);
    largest_pivot = std::max(largest_pivot, size);
    if (!(size > lost * largest_pivot)) {
      return std::nullopt;
    }
    for (std::size_t i = k + 1; i < n; ++i) {
      const Sum factor = -(rows[i][k] / rows[k][k]);
      for (std::size_t j = k + 1; j < n; ++j) {
        rows[i][j] = rows[i][j] + factor * rows[k][j];
      }
      right[i] = right[i] + factor * right[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) {
      right[k] = right[k] + -(rows[k][j] * right[j]);
    }
    right[k] = right[k] / rows[k][k];
  }
  return right;
}

}  // namespace

std::optional<Eigen::RowVectorXd> ackermann(const MatrixRef& A, const MatrixRef& b,
                                            const Eigen::VectorXcd& poles) {
  // K = e_nᵀ [b Ab … Aⁿ⁻¹b]⁻¹ p(A), p the wanted characteristic polynomial.
  constexpr Eigen::Index largest_order = 30;
  const Eigen::Index n = A.rows();
  if (n > largest_order) {
    return std::nullopt;
  }
  const auto size = static_cast<std::size_t>(n);
  SumVector column(size);
  for (Eigen::Index i = 0; i < n; ++i) {
    column[static_cast<std::size_t>(i)] = {b(i, 0), 0.0};
  }
  std::vector<SumVector> rows;
  SumVector right(size);
  for (Eigen::Index k = 0; k < n; ++k) {
    double largest = 0.0;
    for (const Sum& entry : column) {
      largest = std::max(largest, std::abs(entry.hi));
    }
    if (!(largest > 0.0) || !std::isfinite(largest)) {
      return std::nullopt;
    }
    // Each equation of its own size, by a power of two; the right side is the last one's.
    int exponent = 0;
    std::frexp(largest, &exponent);
    SumVector scaled = column;
    for (Sum& entry : scaled) {
      entry = {std::ldexp(entry.hi, -exponent), std::ldexp(entry.lo, -exponent)};
    }
    rows.push_back(std::move(scaled));
    if (k == n - 1) {
      right[size - 1] = {std::ldexp(1.0, -exponent), 0.0};
    }
    column = image_of(A, column);
  }
  std::optional<SumVector> row = solve(std::move(rows), std::move(right));
  if (!row) {
    return std::nullopt;
  }
  const Eigen::MatrixXd transposed = A.transpose();
  for (Eigen::Index j = 0; j < n; ++j) {
    const double alpha = poles(j).real();
    const double beta = poles(j).imag();
    const SumVector once = image_of(transposed, *row);
    if (beta == 0.0) {
      for (std::size_t i = 0; i < size; ++i) {
        (*row)[i] = once[i] + -(Sum{alpha, 0.0} * (*row)[i]);
      }
      continue;
    }
    // (A - p)(A - p̄) = A² - 2α A + |p|².
    const SumVector twice = image_of(transposed, once);
    const Sum square = Sum{alpha, 0.0} * Sum{alpha, 0.0} + Sum{beta, 0.0} * Sum{beta, 0.0};
    for (std::size_t i = 0; i < size; ++i) {
      (*row)[i] = twice[i] + -(Sum{2.0 * alpha, 0.0} * once[i]) + square * (*row)[i];
    }
    ++j;
  }
  Eigen::RowVectorXd K(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Sum& entry = (*row)[static_cast<std::size_t>(i)];
    K(i) = entry.hi + entry.lo;
  }
  if (!K.allFinite()) {
    return std::nullopt;
  }
  return K;
}

}  // namespace flyball::detail
