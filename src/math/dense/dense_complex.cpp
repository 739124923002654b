#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"

namespace flyball::detail {

using Eigen::MatrixXcd;

MatrixXcd complex_product(const ComplexMatrixRef& A, const ComplexMatrixRef& B) {
  MatrixXcd C(A.rows(), B.cols());
  C.noalias() = A * B;
  return C;
}

MatrixXcd solve_complex(const ComplexMatrixRef& A, const ComplexMatrixRef& B, double* rcond) {
  if (const int unit = unit_of(A); unit != 0) {
    return times_power(solve_complex(times_power(A, -unit), B, rcond), -unit);
  }
  const Eigen::PartialPivLU<MatrixXcd> lu(A);
  if (rcond != nullptr) {
    const double smallest = lu.matrixLU().diagonal().cwiseAbs().minCoeff();
    *rcond = smallest > 0.0 ? lu.rcond() : 0.0;
  }
  return lu.solve(B);
}

namespace {

/// diag(0, A). In the first two rows Eigen 3.4's ComplexSchur reads before the matrix if they take
/// ten iterations (computeShift, T(iu - 1, iu - 2) of iu = 1); below a row of zeros it reads that.
MatrixXcd below_zero(const ComplexMatrixRef& A) {
  MatrixXcd padded = MatrixXcd::Zero(A.rows() + 1, A.cols() + 1);
  padded.bottomRightCorner(A.rows(), A.cols()) = A;
  return padded;
}

}  // namespace

ComplexSchur complex_schur_of_complex(const ComplexMatrixRef& A) {
  if (const int unit = unit_of(A); unit != 0) {
    ComplexSchur schur = complex_schur_of_complex(times_power(A, -unit));
    schur.T = times_power(schur.T, unit);
    return schur;
  }
  if (!A.allFinite()) {
    return {A, A, false};
  }
  const Eigen::Index n = A.rows();
  const Eigen::ComplexSchur<MatrixXcd> schur(below_zero(A));
  return {schur.matrixT().bottomRightCorner(n, n), schur.matrixU().bottomRightCorner(n, n),
          schur.info() == Eigen::Success};
}

ComplexSchur complex_schur_of(const MatrixRef& A) {
  return complex_schur_of_complex(A.cast<std::complex<double>>());
}

Eigen::VectorXcd eigenvalues_of_complex(const ComplexMatrixRef& A) {
  if (const int unit = unit_of(A); unit != 0) {
    return times_power(eigenvalues_of_complex(times_power(A, -unit)), unit);
  }
  const Eigen::Index n = A.rows();
  Eigen::ComplexSchur<MatrixXcd> schur(n + 1);
  if (!A.allFinite() || schur.compute(below_zero(A), false).info() != Eigen::Success) {
    return Eigen::VectorXcd::Constant(n, std::numeric_limits<double>::quiet_NaN());
  }
  return schur.matrixT().diagonal().tail(n);
}

}  // namespace flyball::detail
