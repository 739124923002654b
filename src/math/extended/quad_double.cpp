#include <cmath>
#include <vector>

#include "math/extended/quad_double.hpp"

// Compiled with -ffp-contract=off: a fused product would be no longer what the next line corrects.

namespace flyball::detail {

namespace {

using Eigen::Index;

inline __attribute__((always_inline)) double two_sum(double& a, double b) {
  const double s = a + b;
  const double part = s - a;
  const double rest = (a - (s - part)) + (b - part);
  a = s;
  return rest;
}

/// A sum of five doubles, the last of which takes what the first four cannot hold.
struct Sum {
  double v[5] = {};

  /// Adds x, of the size of the part `level`.
  template <int level>
  inline __attribute__((always_inline)) void add(double x) {
    for (int k = level; k < 4; ++k) {
      x = two_sum(v[k], x);
    }
    v[4] += x;
  }
  template <int level>
  inline __attribute__((always_inline)) void add_product(double a, double b) {
    const double p = a * b;
    add<level>(p);
    add<level + 1>(__builtin_fma(a, b, -p));
  }
  /// += sign·a b but for products beyond the last part.
  inline __attribute__((always_inline)) void add_product(const double* a, const double* b,
                                                         double sign) {
    const double b0 = sign * b[0];
    const double b1 = sign * b[1];
    const double b2 = sign * b[2];
    const double b3 = sign * b[3];
    add_product<0>(a[0], b0);
    add_product<1>(a[0], b1);
    add_product<1>(a[1], b0);
    add_product<2>(a[0], b2);
    add_product<2>(a[1], b1);
    add_product<2>(a[2], b0);
    add<3>(a[0] * b3 + a[1] * b2 + (a[2] * b1 + a[3] * b0));
  }
  /// The parts fall in size and overlap by a bit at most.
  void normalize() {
    for (int pass = 0; pass < 3; ++pass) {
      for (int k = 3; k >= 0; --k) {
        v[k + 1] = two_sum(v[k], v[k + 1]);
      }
    }
    v[3] += v[4];
    v[4] = 0.0;
  }
};

/// A matrix, entry by entry, columns side by side.
struct Entries {
  Index rows = 0;
  std::vector<double> values;

  Entries() = default;
  explicit Entries(const QuadDoubleMatrix& M)
      : rows(M.rows()), values(static_cast<std::size_t>(4 * M.rows() * M.cols())) {
    double* to = values.data();
    for (Index k = 0; k < M.rows() * M.cols(); ++k) {
      for (const Eigen::MatrixXd& part : M.part) {
        *to++ = part.data()[k];
      }
    }
  }
  [[nodiscard]] double* at(Index i, Index j) { return values.data() + 4 * (i + j * rows); }
  [[nodiscard]] const double* at(Index i, Index j) const {
    return values.data() + 4 * (i + j * rows);
  }
  [[nodiscard]] Sum sum(Index i, Index j) const {
    const double* from = at(i, j);
    return {{from[0], from[1], from[2], from[3], 0.0}};
  }
  void put(Index i, Index j, Sum s) {
    s.normalize();
    std::copy_n(s.v, 4, at(i, j));
  }
  /// (i, j) += sign·a b.
  void add(Index i, Index j, const double* a, const double* b, double sign) {
    Sum s = sum(i, j);
    s.add_product(a, b, sign);
    put(i, j, s);
  }
  void swap_rows(Index a, Index b) {
    for (Index j = 0; 4 * j * rows < static_cast<Index>(values.size()); ++j) {
      std::swap_ranges(at(a, j), at(a, j) + 4, at(b, j));
    }
  }
};

QuadDoubleMatrix matrix_of(const Entries& entries, Index columns) {
  QuadDoubleMatrix M = QuadDoubleMatrix::zero(entries.rows, columns);
  const double* from = entries.values.data();
  for (Index k = 0; k < entries.rows * columns; ++k) {
    for (Eigen::MatrixXd& part : M.part) {
      part.data()[k] = *from++;
    }
  }
  return M;
}

/// 1/a by Newton's method: each step doubles the digits.
Sum reciprocal(const double* a) {
  Sum x{{1.0 / a[0]}};
  for (int k = 0; k < 3; ++k) {
    Sum rest{{1.0}};
    rest.add_product(a, x.v, -1.0);
    rest.normalize();
    Sum next = x;
    next.add_product(x.v, rest.v, 1.0);
    next.normalize();
    x = next;
  }
  return x;
}

template <class Function>
QuadDoubleMatrix each_part(const QuadDoubleMatrix& M, const Function& function) {
  QuadDoubleMatrix result;
  for (std::size_t k = 0; k < M.part.size(); ++k) {
    result.part[k] = function(M.part[k]);
  }
  return result;
}

}  // namespace

QuadDoubleMatrix QuadDoubleMatrix::transpose() const {
  return each_part(*this, [](const Eigen::MatrixXd& M) { return M.transpose(); });
}

QuadDoubleMatrix QuadDoubleMatrix::left(Index columns) const {
  return each_part(*this, [&](const Eigen::MatrixXd& M) { return M.leftCols(columns); });
}

QuadDoubleMatrix QuadDoubleMatrix::right(Index columns) const {
  return each_part(*this, [&](const Eigen::MatrixXd& M) { return M.rightCols(columns); });
}

QuadDoubleMatrix add_product(QuadDoubleMatrix C, double sign, const QuadDoubleMatrix& A,
                             const QuadDoubleMatrix& B) {
  Entries c(C);
  const Entries a(A.transpose());
  const Entries b(B);
  for (Index j = 0; j < C.cols(); ++j) {
    for (Index i = 0; i < C.rows(); ++i) {
      Sum s = c.sum(i, j);
      for (Index k = 0; k < B.rows(); ++k) {
        s.add_product(a.at(k, i), b.at(k, j), sign);
      }
      c.put(i, j, s);
    }
  }
  return matrix_of(c, C.cols());
}

QuadDoubleMatrix product(const QuadDoubleMatrix& A, const QuadDoubleMatrix& B) {
  return add_product(QuadDoubleMatrix::zero(A.rows(), B.cols()), 1.0, A, B);
}

QuadDoubleMatrix sum(QuadDoubleMatrix A, double sign, const QuadDoubleMatrix& B) {
  Entries a(A);
  const Entries b(B);
  constexpr double one[4] = {1.0, 0.0, 0.0, 0.0};
  for (Index j = 0; j < A.cols(); ++j) {
    for (Index i = 0; i < A.rows(); ++i) {
      a.add(i, j, b.at(i, j), one, sign);
    }
  }
  return matrix_of(a, A.cols());
}

QuadDoubleMatrix shifted_diagonal(QuadDoubleMatrix A, double scalar) {
  // Before A is moved: compilers differ in which argument they make first.
  const QuadDoubleMatrix diagonal(scalar * Eigen::MatrixXd::Identity(A.rows(), A.rows()));
  return sum(std::move(A), 1.0, diagonal);
}

QuadDoubleMatrix scaled(QuadDoubleMatrix A, double f) {
  for (Eigen::MatrixXd& part : A.part) {
    part *= f;
  }
  return A;
}

QuadDoubleMatrix symmetrized(const QuadDoubleMatrix& A) {
  return scaled(sum(A, 1.0, A.transpose()), 0.5);
}

QuadDoubleMatrix beside(const QuadDoubleMatrix& A, const QuadDoubleMatrix& B) {
  QuadDoubleMatrix both = QuadDoubleMatrix::zero(A.rows(), A.cols() + B.cols());
  for (std::size_t k = 0; k < both.part.size(); ++k) {
    both.part[k] << A.part[k], B.part[k];
  }
  return both;
}

std::optional<QuadDoubleMatrix> solve(QuadDoubleMatrix A, QuadDoubleMatrix B) {
  const Index n = A.rows();
  const Index columns = B.cols();
  for (Index i = 0; i < n; ++i) {
    const double largest = A.part[0].row(i).cwiseAbs().maxCoeff();
    if (!(largest > 0.0) || !std::isfinite(largest)) {
      return std::nullopt;
    }
    const double f = std::exp2(-std::round(std::log2(largest)));
    for (std::size_t k = 0; k < A.part.size(); ++k) {
      A.part[k].row(i) *= f;
      B.part[k].row(i) *= f;
    }
  }
  Entries a(A);
  Entries b(B);
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i) {
      if (std::abs(*a.at(i, k)) > std::abs(*a.at(pivot, k))) {
        pivot = i;
      }
    }
    const double largest = std::abs(*a.at(pivot, k));
    if (!(largest > 0.0) || !std::isfinite(largest)) {
      return std::nullopt;
    }
    if (pivot != k) {
      a.swap_rows(k, pivot);
      b.swap_rows(k, pivot);
    }
    const Sum inverse = reciprocal(a.at(k, k));
    for (Index i = k + 1; i < n; ++i) {
      Sum factor;
      factor.add_product(a.at(i, k), inverse.v, 1.0);
      factor.normalize();
      for (Index j = k + 1; j < n; ++j) {
        a.add(i, j, factor.v, a.at(k, j), -1.0);
      }
      for (Index j = 0; j < columns; ++j) {
        b.add(i, j, factor.v, b.at(k, j), -1.0);
      }
    }
  }
  for (Index k = n - 1; k >= 0; --k) {
    const Sum inverse = reciprocal(a.at(k, k));
    for (Index j = 0; j < columns; ++j) {
      Sum x;
      x.add_product(b.at(k, j), inverse.v, 1.0);
      b.put(k, j, x);
      for (Index i = 0; i < k; ++i) {
        b.add(i, j, a.at(i, k), b.at(k, j), -1.0);
      }
    }
  }
  return matrix_of(b, columns);
}

}  // namespace flyball::detail
