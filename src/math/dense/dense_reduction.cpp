#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include "core/constants.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/dense/ordinary_units.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// Diagonal and superdiagonal of the bidiagonal form of a square M, by turns.
Eigen::VectorXd bidiagonal_of(MatrixXd M) {
  const Index n = M.rows();
  Eigen::VectorXd entries(2 * n - 1);
  Eigen::VectorXd v;
  Eigen::VectorXd products;
  // x becomes -sign(x₁)‖x‖e₁ by I - τvvᵀ.
  const auto reflection = [&v](double& entry) {
    const double size = v.norm();
    entry = v(0) > 0.0 ? -size : size;
    v(0) -= entry;
    return size > 0.0 ? 2.0 / v.squaredNorm() : 0.0;
  };
  for (Index k = 0; k < n; ++k) {
    v = M.col(k).tail(n - k);
    double tau = reflection(entries(2 * k));
    auto right = M.bottomRightCorner(n - k, n - k - 1);
    products.noalias() = tau * right.transpose() * v;
    right.noalias() -= v * products.transpose();
    if (k + 1 == n) {
      break;
    }
    v = M.row(k).tail(n - k - 1);
    tau = reflection(entries(2 * k + 1));
    auto below = M.bottomRightCorner(n - k - 1, n - k - 1);
    products.noalias() = tau * below * v;
    below.noalias() -= products * v.transpose();
  }
  return entries;
}

/// How many singular values of a bidiagonal matrix are below x > 0: of the tridiagonal [0 J; Jᵀ 0]
/// in shuffled rows, as many eigenvalues as it has rows, and these.
Index count_below(const Eigen::VectorXd& entries, double x) {
  Index negative = 0;
  double pivot = -x;
  for (Index i = 0;; ++i) {
    negative += pivot < 0.0 ? 1 : 0;
    if (i == entries.size()) {
      break;
    }
    constexpr double least = std::numeric_limits<double>::min();
    const double divisor = std::abs(pivot) < least ? -least : pivot;
    pivot = -x - entries(i) / divisor * entries(i);
  }
  return negative - (entries.size() + 1) / 2;
}

}  // namespace

MatrixXd triangle_of(const MatrixRef& A) {
  if (const int unit = unit_of(A); unit != 0) {
    return times_power(triangle_of(times_power(A, -unit)), unit);
  }
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  const Index rows = std::min(A.rows(), A.cols());
  return qr.matrixQR().topRows(rows).triangularView<Eigen::Upper>();
}

Hessenberg hessenberg_of(const MatrixRef& A) {
  if (const int unit = unit_of(A); unit != 0) {
    Hessenberg form = hessenberg_of(times_power(A, -unit));
    form.H = times_power(form.H, unit);
    return form;
  }
  const Eigen::HessenbergDecomposition<MatrixXd> decomposition(A);
  return {decomposition.matrixH(), decomposition.matrixQ()};
}

Eigen::VectorXd coarse_singular_values_of(const MatrixRef& A) {
  const Index n = std::min(A.rows(), A.cols());
  constexpr Index few = 40;
  if (n < few) {
    return singular_values_of(A);
  }
  const MatrixXd R = A.rows() >= A.cols() ? triangle_of(A) : triangle_of(A.transpose());
  const double size = R.cwiseAbs().maxCoeff();
  if (!(size > 0.0) || !R.allFinite()) {
    return Eigen::VectorXd::Constant(n, size);
  }
  // [0 J; Jᵀ 0] in shuffled rows is tridiagonal, with the entries of J beside a diagonal of zeros.
  const Eigen::VectorXd beside = bidiagonal_of(R / size);
  Eigen::SelfAdjointEigenSolver<MatrixXd> solver;
  solver.computeFromTridiagonal(Eigen::VectorXd::Zero(2 * n), beside, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().tail(n).reverse().cwiseMax(0.0) * size;
}

SingularExtent singular_extent_of(const MatrixRef& A, double share) {
  const Index n = std::min(A.rows(), A.cols());
  constexpr Index few = 40;
  const auto extent_of = [share](const Eigen::VectorXd& values) {
    return SingularExtent{values(0), values(values.size() - 1),
                          (values.array() > share * values(0)).count()};
  };
  if (n < few) {
    return extent_of(singular_values_of(A));
  }
  const MatrixXd R = A.rows() >= A.cols() ? triangle_of(A) : triangle_of(A.transpose());
  const double size = R.cwiseAbs().maxCoeff();
  if (!(size > 0.0) || !R.allFinite()) {
    return extent_of(Eigen::VectorXd::Constant(n, size));
  }
  const Eigen::VectorXd entries = bidiagonal_of(R / size);
  double high = 1.01 * entries.norm();
  double low = 0.0;
  for (int k = 0; k < 60 && high - low > epsilon * high; ++k) {
    const double middle = 0.5 * (low + high);
    (count_below(entries, middle) == n ? high : low) = middle;
  }
  SingularExtent extent{high * size, 0.0, n - count_below(entries, share * high)};
  // By exponents first; what is below 1e-300 of the largest is zero.
  double bottom = -1000.0;
  double top = std::log2(high);
  if (count_below(entries, std::exp2(bottom)) > 0) {
    return extent;
  }
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (bottom + top);
    (count_below(entries, std::exp2(middle)) > 0 ? top : bottom) = middle;
  }
  extent.smallest = std::exp2(top) * size;
  return extent;
}

}  // namespace flyball::detail
