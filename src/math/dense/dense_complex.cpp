#include <cmath>
#include <complex>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/dense/schur_kernel.hpp"

namespace flyball::detail {

using Eigen::MatrixXcd;

MatrixXcd complex_product(const ComplexMatrixRef& A, const ComplexMatrixRef& B) {
  MatrixXcd C(A.rows(), B.cols());
  // Four real products by the kernel of the house take a fraction of the time of a complex one.
  constexpr Eigen::Index small = 32;
  if (A.rows() >= small && A.cols() >= small && B.cols() >= small) {
    const Eigen::MatrixXd re = A.real();
    const Eigen::MatrixXd im = A.imag();
    const Eigen::MatrixXd B_re = B.real();
    const Eigen::MatrixXd B_im = B.imag();
    C.real() = product(re, B_re) - product(im, B_im);
    C.imag() = product(re, B_im) + product(im, B_re);
    return C;
  }
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

namespace {

/// Makes the 2x2 block of a quasi-triangular T at k, which has a pair of eigenvalues, triangular by
/// a unitary rotation whose first row is an eigenvector's.
void split_pair(MatrixXcd& T, MatrixXcd& U, Eigen::Index k) {
  using Complex = std::complex<double>;
  const Complex a = T(k, k);
  const Complex d = T(k + 1, k + 1);
  const Complex half = 0.5 * (a - d);
  // λ - d with (λ - d)² - (a - d)(λ - d) - bc = 0, of the sign that does not cancel.
  const Complex root = std::sqrt(half * half + T(k, k + 1) * T(k + 1, k));
  const Complex mu = half + (std::real(std::conj(half) * root) < 0.0 ? -root : root);
  const Complex c = T(k + 1, k);
  const double r = std::hypot(std::abs(mu), std::abs(c));
  Eigen::Matrix2cd G;
  G << std::conj(mu) / r, std::conj(c) / r, -c / r, mu / r;
  const Eigen::Index n = T.cols();
  T.middleRows(k, 2).rightCols(n - k) = (G * T.middleRows(k, 2).rightCols(n - k)).eval();
  T.topRows(k + 2).middleCols(k, 2) = (T.topRows(k + 2).middleCols(k, 2) * G.adjoint()).eval();
  U.middleCols(k, 2) = (U.middleCols(k, 2) * G.adjoint()).eval();
  T(k + 1, k) = 0.0;
}

/// A = U T Uᵀ, T quasi-triangular, by the kernels of the house.
ComplexSchur real_schur_of(const MatrixRef& A) {
  const auto n = static_cast<int>(A.rows());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(schur_rows(n), n);
  H.topRows(n) = A;
  Eigen::MatrixXd Q(H.rows(), n);
  Eigen::MatrixXd work(H.rows(), 3);
  const bool converged = FLYBALL_RUN_KERNEL(schur_form, n, H.data(), Q.data(), work.data());
  ComplexSchur schur{H.topRows(n).cast<std::complex<double>>(),
                     Q.topRows(n).cast<std::complex<double>>(), converged};
  // Of the columns that were reflected to zero, whole vectors were; what is left there is nothing.
  for (Eigen::Index j = 0; j + 2 < A.rows(); ++j) {
    schur.T.col(j).tail(A.rows() - j - 2).setZero();
  }
  return schur;
}

}  // namespace

ComplexSchur complex_schur_of(const MatrixRef& A) {
  if (const int unit = unit_of(A); unit != 0) {
    ComplexSchur schur = complex_schur_of(times_power(A, -unit));
    schur.T = times_power(schur.T, unit);
    return schur;
  }
  if (!A.allFinite()) {
    return {A.cast<std::complex<double>>(), A.cast<std::complex<double>>(), false};
  }
  // Real arithmetic first: a quarter of the operations. Of few states single shifts, by rotations,
  // keep more of the small entries of a graded matrix.
  constexpr Eigen::Index few = 24;
  ComplexSchur schur = A.rows() < few ? ComplexSchur{} : real_schur_of(A);
  if (!schur.converged) {
    return complex_schur_of_complex(A.cast<std::complex<double>>());
  }
  for (Eigen::Index k = A.rows() - 2; k >= 0; --k) {
    if (schur.T(k + 1, k) != 0.0) {
      split_pair(schur.T, schur.U, k);
    }
  }
  return schur;
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
