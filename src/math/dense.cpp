#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

#include "math/dense.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd product(const MatrixRef& A, const MatrixRef& B) {
  MatrixXd C(A.rows(), B.cols());
  C.noalias() = A * B;
  return C;
}

MatrixXd transposed_product(const MatrixRef& A, const MatrixRef& B) {
  MatrixXd C(A.cols(), B.cols());
  C.noalias() = A.transpose() * B;
  return C;
}

MatrixXd product_transposed(const MatrixRef& A, const MatrixRef& B) {
  MatrixXd C(A.rows(), B.rows());
  C.noalias() = A * B.transpose();
  return C;
}

MatrixXd symmetrized(const MatrixRef& M) {
  return 0.5 * (M + M.transpose());
}

MatrixXd solve_linear(const MatrixRef& A, const MatrixRef& B, double* rcond) {
  const Eigen::PartialPivLU<MatrixXd> lu(A);
  if (rcond != nullptr) {
    const double smallest = lu.matrixLU().diagonal().cwiseAbs().minCoeff();
    *rcond = smallest > 0.0 ? lu.rcond() : 0.0;
  }
  return lu.solve(B);
}

MatrixXd solve_symmetric(const MatrixRef& A, const MatrixRef& B) {
  return A.ldlt().solve(B);
}

MatrixXd solve_least_squares(const MatrixRef& A, const MatrixRef& B) {
  return A.completeOrthogonalDecomposition().solve(B);
}

std::optional<MatrixXd> cholesky_of(const MatrixRef& S) {
  const Eigen::LLT<MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) {
    return std::nullopt;
  }
  return MatrixXd(llt.matrixL());
}

OrthogonalTriangular full_qr(const MatrixRef& A) {
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  return {qr.householderQ(), qr.matrixQR().triangularView<Eigen::Upper>()};
}

OrthogonalTriangular pivoted_qr(const MatrixRef& A) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  return {qr.householderQ(), qr.matrixQR().triangularView<Eigen::Upper>()};
}

Eigen::VectorXd balance_of(const MatrixRef& A) {
  const Index n = A.rows();
  Eigen::VectorXd d = Eigen::VectorXd::Ones(n);
  // Without the diagonal, which does not change: in its sums small entries would be lost.
  MatrixXd M = A.cwiseAbs();
  M.diagonal().setZero();
  const double diagonal = n == 0 ? 0.0 : A.diagonal().cwiseAbs().maxCoeff();
  for (int sweep = 0; sweep < 20; ++sweep) {
    bool changed = false;
    for (Index i = 0; i < n; ++i) {
      double column = M.col(i).sum();
      double row = M.row(i).sum();
      if (!std::isfinite(column + row)) {
        continue;
      }
      // A state that only drives others, or is only driven, can be scaled until what connects it is
      // no larger than the diagonal.
      if (column <= 0.0 || row <= 0.0) {
        if (column + row <= diagonal || !(diagonal > 0.0)) {
          continue;
        }
        const double least = std::max(diagonal * (diagonal / (column + row)), 1e-300);
        column = std::max(column, least);
        row = std::max(row, least);
      }
      const int exponent =
          static_cast<int>(std::lround(0.5 * (std::log2(row) - std::log2(column))));
      const double f = std::ldexp(1.0, exponent);
      if (exponent == 0 || column * f + row / f > 0.95 * (column + row)) {
        continue;
      }
      d(i) *= f;
      M.col(i) *= f;
      M.row(i) /= f;
      changed = true;
    }
    if (!changed) {
      break;
    }
  }
  const MatrixXd balanced = d.cwiseInverse().asDiagonal() * A * d.asDiagonal();
  return norm1(balanced) < norm1(A) ? d : Eigen::VectorXd::Ones(n);
}

double norm1(const MatrixRef& A) {
  return A.size() == 0 ? 0.0 : A.cwiseAbs().colwise().sum().maxCoeff();
}

}  // namespace flyball::detail
