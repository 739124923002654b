#include <algorithm>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

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

}  // namespace flyball::detail
