#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "math/dense/balance_columns.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/gemm_kernel.hpp"
#include "math/dense/ordinary_units.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// C = A B by the kernel of the house, which the products of some ten rows do not pay for; steps of
/// A's rows and depth, and of B's depth and columns. False where Eigen's does.
bool multiply_quickly(const MatrixRef& A, bool A_turned, const MatrixRef& B, bool B_turned,
                      MatrixXd& C) {
  constexpr Index small = 16;
  constexpr Index most = 1 << 15;  // steps are ints
  const Index depth = A_turned ? A.rows() : A.cols();
  if (C.rows() < small || C.cols() < small || depth < small || A.outerStride() > most ||
      B.outerStride() > most || C.rows() > most || C.cols() > most || depth > most) {
    return false;
  }
  const auto A_step = static_cast<int>(A.outerStride());
  const auto B_step = static_cast<int>(B.outerStride());
  gemm({static_cast<int>(C.rows()),
        static_cast<int>(C.cols()),
        static_cast<int>(depth),
        {A.data(), A_turned ? A_step : 1, A_turned ? 1 : A_step},
        {B.data(), B_turned ? B_step : 1, B_turned ? 1 : B_step},
        C.data(),
        static_cast<int>(C.rows()),
        GemmKind::assign,
        false});
  return true;
}

}  // namespace

MatrixXd product(const MatrixRef& A, const MatrixRef& B) {
  MatrixXd C(A.rows(), B.cols());
  if (!multiply_quickly(A, false, B, false, C)) {
    C.noalias() = A * B;
  }
  return C;
}

MatrixXd transposed_product(const MatrixRef& A, const MatrixRef& B) {
  MatrixXd C(A.cols(), B.cols());
  if (!multiply_quickly(A, true, B, false, C)) {
    C.noalias() = A.transpose() * B;
  }
  return C;
}

MatrixXd product_transposed(const MatrixRef& A, const MatrixRef& B) {
  MatrixXd C(A.rows(), B.rows());
  if (!multiply_quickly(A, false, B, true, C)) {
    C.noalias() = A * B.transpose();
  }
  return C;
}

MatrixXd symmetrized(const MatrixRef& M) {
  return 0.5 * (M + M.transpose());
}

MatrixXd solve_linear(const MatrixRef& A, const MatrixRef& B, double* rcond) {
  if (const int unit = unit_of(A); unit != 0) {
    return times_power(solve_linear(times_power(A, -unit), B, rcond), -unit);
  }
  const Eigen::PartialPivLU<MatrixXd> lu(A);
  if (rcond != nullptr) {
    const double smallest = lu.matrixLU().diagonal().cwiseAbs().minCoeff();
    *rcond = smallest > 0.0 ? lu.rcond() : 0.0;
  }
  return B.size() == 0 ? MatrixXd(B) : MatrixXd(lu.solve(B));
}

MatrixXd solve_symmetric(const MatrixRef& A, const MatrixRef& B) {
  return B.size() == 0 ? MatrixXd(B) : MatrixXd(A.ldlt().solve(B));
}

std::optional<MatrixXd> cholesky_of(const MatrixRef& S) {
  const Eigen::LLT<MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) {
    return std::nullopt;
  }
  return MatrixXd(llt.matrixL());
}

Eigen::VectorXd balance_of(const MatrixRef& A) {
  // The sums of rows and columns must be finite; more would take the smallest entries away.
  if (A.size() > 0 && A.cwiseAbs().maxCoeff() > 0x1p1000 && A.allFinite()) {
    return balance_of(times_power(A, -24));
  }
  const Index n = A.rows();
  Eigen::VectorXd d = Eigen::VectorXd::Ones(n);
  MatrixXd balanced = A;
  balance_columns(static_cast<int>(n), balanced.data(), static_cast<int>(n), d.data());
  return norm1(balanced) < norm1(A) ? d : Eigen::VectorXd::Ones(n);
}

double norm1(const MatrixRef& A) {
  return A.size() == 0 ? 0.0 : A.cwiseAbs().colwise().sum().maxCoeff();
}

}  // namespace flyball::detail
