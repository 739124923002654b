#include <cmath>

#include "math/extended/double_double.hpp"

// Compiled with -ffp-contract=off: a fused product would be no longer what the next line corrects.

namespace flyball::detail {

namespace {

using Eigen::Index;

struct Value {
  double hi;
  double lo;
};

/// (y_hi + y_lo) += (a_hi + a_lo)(x_hi + x_lo), count times.
inline __attribute__((always_inline)) void axpy_body(Index count, Value a, const double* x_hi,
                                                     const double* x_lo, double* y_hi,
                                                     double* y_lo) {
#ifdef __clang__
#pragma clang loop vectorize(assume_safety)
#else
#pragma GCC ivdep
#endif
  for (Index i = 0; i < count; ++i) {
    const double p = a.hi * x_hi[i];
    const double e = __builtin_fma(a.hi, x_hi[i], -p) + (a.hi * x_lo[i] + a.lo * x_hi[i]);
    const double s = y_hi[i] + p;
    const double part = s - y_hi[i];
    const double rest = ((y_hi[i] - (s - part)) + (p - part)) + (y_lo[i] + e);
    const double high = s + rest;
    y_lo[i] = rest - (high - s);
    y_hi[i] = high;
  }
}

void axpy_baseline(Index count, Value a, const double* x_hi, const double* x_lo, double* y_hi,
                   double* y_lo) {
  axpy_body(count, a, x_hi, x_lo, y_hi, y_lo);
}

#if defined(__x86_64__) && !defined(__FMA__)
__attribute__((target("avx2,fma"))) void axpy_wide(Index count, Value a, const double* x_hi,
                                                   const double* x_lo, double* y_hi, double* y_lo) {
  axpy_body(count, a, x_hi, x_lo, y_hi, y_lo);
}

void axpy(Index count, Value a, const double* x_hi, const double* x_lo, double* y_hi,
          double* y_lo) {
  static const bool wide =
      __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  (wide ? axpy_wide : axpy_baseline)(count, a, x_hi, x_lo, y_hi, y_lo);
}
#else
void axpy(Index count, Value a, const double* x_hi, const double* x_lo, double* y_hi,
          double* y_lo) {
  axpy_baseline(count, a, x_hi, x_lo, y_hi, y_lo);
}
#endif

Value add(Value a, Value b) {
  const double s = a.hi + b.hi;
  const double part = s - a.hi;
  const double rest = ((a.hi - (s - part)) + (b.hi - part)) + (a.lo + b.lo);
  const double high = s + rest;
  return {high, rest - (high - s)};
}

Value multiply(Value a, Value b) {
  const double p = a.hi * b.hi;
  const double rest = std::fma(a.hi, b.hi, -p) + (a.hi * b.lo + a.lo * b.hi);
  const double high = p + rest;
  return {high, rest - (high - p)};
}

Value divide(Value a, Value b) {
  const double first = a.hi / b.hi;
  const Value left = add(a, multiply({-first, 0.0}, b));
  const double second = left.hi / b.hi;
  const Value rest = add(left, multiply({-second, 0.0}, b));
  return add(add({first, 0.0}, {second, 0.0}), {rest.hi / b.hi, 0.0});
}

Value at(const DoubleDoubleMatrix& M, Index i, Index j) {
  return {M.hi(i, j), M.lo(i, j)};
}

void put(DoubleDoubleMatrix& M, Index i, Index j, Value v) {
  M.hi(i, j) = v.hi;
  M.lo(i, j) = v.lo;
}

}  // namespace

DoubleDoubleMatrix add_product(DoubleDoubleMatrix C, double sign, const DoubleDoubleMatrix& A,
                               const DoubleDoubleMatrix& B) {
  const Index rows = C.rows();
  for (Index j = 0; j < B.cols(); ++j) {
    for (Index k = 0; k < B.rows(); ++k) {
      const Value b = at(B, k, j);
      if (b.hi != 0.0) {
        axpy(rows, {sign * b.hi, sign * b.lo}, A.hi.data() + k * rows, A.lo.data() + k * rows,
             C.hi.data() + j * rows, C.lo.data() + j * rows);
      }
    }
  }
  return C;
}

DoubleDoubleMatrix product(const DoubleDoubleMatrix& A, const DoubleDoubleMatrix& B) {
  return add_product(DoubleDoubleMatrix::zero(A.rows(), B.cols()), 1.0, A, B);
}

DoubleDoubleMatrix sum(DoubleDoubleMatrix A, double sign, const DoubleDoubleMatrix& B) {
  axpy(A.hi.size(), {sign, 0.0}, B.hi.data(), B.lo.data(), A.hi.data(), A.lo.data());
  return A;
}

DoubleDoubleMatrix shifted_diagonal(DoubleDoubleMatrix A, double scalar) {
  for (Index i = 0; i < A.rows(); ++i) {
    put(A, i, i, add(at(A, i, i), {scalar, 0.0}));
  }
  return A;
}

DoubleDoubleMatrix scaled(DoubleDoubleMatrix A, double f) {
  A.hi *= f;
  A.lo *= f;
  return A;
}

DoubleDoubleMatrix symmetrized(const DoubleDoubleMatrix& A) {
  return scaled(sum(A, 1.0, A.transpose()), 0.5);
}

DoubleDoubleMatrix beside(const DoubleDoubleMatrix& A, const DoubleDoubleMatrix& B) {
  DoubleDoubleMatrix both = DoubleDoubleMatrix::zero(A.rows(), A.cols() + B.cols());
  both.hi << A.hi, B.hi;
  both.lo << A.lo, B.lo;
  return both;
}

std::optional<DoubleDoubleMatrix> solve(DoubleDoubleMatrix A, DoubleDoubleMatrix B) {
  const Index n = A.rows();
  for (Index i = 0; i < n; ++i) {
    const double largest = A.hi.row(i).cwiseAbs().maxCoeff();
    if (!(largest > 0.0) || !std::isfinite(largest)) {
      return std::nullopt;
    }
    const double f = std::exp2(-std::round(std::log2(largest)));
    A.hi.row(i) *= f;
    A.lo.row(i) *= f;
    B.hi.row(i) *= f;
    B.lo.row(i) *= f;
  }
  for (Index k = 0; k < n; ++k) {
    Index pivot = 0;
    const double largest = A.hi.col(k).tail(n - k).cwiseAbs().maxCoeff(&pivot);
    if (!(largest > 0.0) || !std::isfinite(largest)) {
      return std::nullopt;
    }
    pivot += k;
    if (pivot != k) {
      A.hi.row(k).swap(A.hi.row(pivot));
      A.lo.row(k).swap(A.lo.row(pivot));
      B.hi.row(k).swap(B.hi.row(pivot));
      B.lo.row(k).swap(B.lo.row(pivot));
    }
    const Value diagonal = at(A, k, k);
    for (Index i = k + 1; i < n; ++i) {
      put(A, i, k, divide(at(A, i, k), diagonal));
    }
    const Index below = n - k - 1;
    const double* factor_hi = A.hi.data() + k * n + k + 1;
    const double* factor_lo = A.lo.data() + k * n + k + 1;
    const auto eliminate = [&](DoubleDoubleMatrix& M, Index j) {
      const Value head = at(M, k, j);
      axpy(below, {-head.hi, -head.lo}, factor_hi, factor_lo, M.hi.data() + j * n + k + 1,
           M.lo.data() + j * n + k + 1);
    };
    for (Index j = k + 1; j < n; ++j) {
      eliminate(A, j);
    }
    for (Index j = 0; j < B.cols(); ++j) {
      eliminate(B, j);
    }
  }
  for (Index k = n - 1; k >= 0; --k) {
    const Value diagonal = at(A, k, k);
    for (Index j = 0; j < B.cols(); ++j) {
      const Value x = divide(at(B, k, j), diagonal);
      put(B, k, j, x);
      axpy(k, {-x.hi, -x.lo}, A.hi.data() + k * n, A.lo.data() + k * n, B.hi.data() + j * n,
           B.lo.data() + j * n);
    }
  }
  return B;
}

}  // namespace flyball::detail
