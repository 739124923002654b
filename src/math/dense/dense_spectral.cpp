#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "core/constants.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/dense/schur_kernel.hpp"
#include "math/dense/spectral_blocks.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// Of square matrices only: what JacobiSVD prepares others by is made anew in place, and destroyed
/// twice where memory is too short for it.
using SquareSvd = Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner>;

/// R of a decomposition of a matrix that is not wide.
MatrixXd triangle(const MatrixXd& qr) {
  return qr.topRows(qr.cols()).triangularView<Eigen::Upper>();
}

/// The largest entry, by which squares neither overflow nor vanish.
double scale_of(const MatrixRef& A) {
  const double largest = A.size() > 0 ? A.cwiseAbs().maxCoeff() : 0.0;
  return largest > 0.0 ? largest : 1.0;
}

/// Each column of D V times a power of two that leaves its largest entry near one.
void give_units(Eigen::MatrixXcd& V, const Eigen::VectorXi& d) {
  for (Index j = 0; j < V.cols(); ++j) {
    int largest = std::numeric_limits<int>::min();
    for (Index i = 0; i < V.rows(); ++i) {
      const double size = std::abs(V(i, j));
      largest = size > 0.0 ? std::max(largest, std::ilogb(size) + d(i)) : largest;
    }
    for (Index i = 0; i < V.rows(); ++i) {
      if (V(i, j) != 0.0) {
        V(i, j) = {std::ldexp(V(i, j).real(), d(i) - largest),
                   std::ldexp(V(i, j).imag(), d(i) - largest)};
      }
    }
  }
}

}  // namespace

Eigensystem eigensystem_of(const MatrixRef& A) {
  const BalancedMatrix balanced = balanced_of(A);
  Eigen::EigenSolver<MatrixXd> solver(A.rows());
  if (!balanced.M.allFinite() || solver.compute(balanced.M).info() != Eigen::Success) {
    return {Eigen::VectorXcd::Constant(A.rows(), nan),
            Eigen::MatrixXcd::Constant(A.rows(), A.cols(), nan)};
  }
  Eigensystem system{times_power(solver.eigenvalues(), balanced.unit), solver.eigenvectors()};
  if (balanced.far) {
    give_units(system.vectors, balanced.d);
  } else {
    for (Index i = 0; i < A.rows(); ++i) {
      system.vectors.row(i) *= std::ldexp(1.0, balanced.d(i));
    }
  }
  system.vectors.colwise().normalize();
  return system;
}

namespace {

/// Of a balanced matrix of ordinary size by the kernels of the house, which small ones do not pay
/// for; false where they do not converge.
bool eigenvalues_quickly(const MatrixXd& M, Eigen::Ref<Eigen::VectorXcd> values) {
  constexpr Index small = 64;
  const Index n = M.rows();
  if (n < small || n > std::numeric_limits<int>::max() / 4) {
    return false;
  }
  MatrixXd H = MatrixXd::Zero(schur_rows(static_cast<int>(n)), n);
  H.topRows(n) = M;
  MatrixXd work(H.rows(), 3);
  return FLYBALL_RUN_KERNEL(schur_values, static_cast<int>(n), H.data(), work.data(),
                            values.data());
}

}  // namespace

Eigen::VectorXcd eigenvalues_of(const MatrixRef& A) {
  Eigen::VectorXcd values(A.rows());
  Eigen::Index done = 0;
  for (const MatrixXd& block : spectral_blocks(A)) {
    const Eigen::Index n = block.rows();
    if (n == 0) {
      continue;
    }
    const BalancedMatrix balanced = balanced_of(block);
    if (balanced.M.allFinite() && eigenvalues_quickly(balanced.M, values.segment(done, n))) {
      values.segment(done, n) = times_power(values.segment(done, n), balanced.unit);
      done += n;
      continue;
    }
    Eigen::EigenSolver<MatrixXd> solver(n);
    if (!balanced.M.allFinite() || solver.compute(balanced.M, false).info() != Eigen::Success) {
      return Eigen::VectorXcd::Constant(A.rows(), std::numeric_limits<double>::quiet_NaN());
    }
    values.segment(done, n) = times_power(solver.eigenvalues(), balanced.unit);
    done += n;
  }
  return values;
}

SymmetricEigensystem symmetric_eigensystem_of(const MatrixRef& S) {
  if (const int unit = unit_of(S); unit != 0) {
    SymmetricEigensystem system = symmetric_eigensystem_of(times_power(S, -unit));
    system.values = times_power(system.values, unit);
    return system;
  }
  if (!S.allFinite()) {
    const MatrixXd none = MatrixXd::Constant(S.rows(), S.cols(), std::nan(""));
    return {none.col(0), none};
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(S);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SingularValues svd_of(const MatrixRef& A) {
  const Index m = A.rows();
  const Index n = A.cols();
  if (m < n) {
    SingularValues turned = svd_of(A.transpose());
    return {std::move(turned.V), std::move(turned.values), std::move(turned.U)};
  }
  if (m == n) {
    const SquareSvd svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
  }
  // A P = Q R and R = U S Vᵀ.
  const double scale = scale_of(A);
  const Eigen::FullPivHouseholderQR<MatrixXd> qr(A / scale);
  const SquareSvd svd(triangle(qr.matrixQR()), Eigen::ComputeFullU | Eigen::ComputeFullV);
  MatrixXd U = qr.matrixQ();
  U.leftCols(n) *= svd.matrixU();
  return {std::move(U), svd.singularValues() * scale, qr.colsPermutation() * svd.matrixV()};
}

Eigen::VectorXd singular_values_of(const MatrixRef& A) {
  if (A.rows() < A.cols()) {
    return singular_values_of(A.transpose());
  }
  if (A.rows() == A.cols()) {
    return SquareSvd(A).singularValues();
  }
  const double scale = scale_of(A);
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A / scale);
  return SquareSvd(triangle(qr.matrixQR())).singularValues() * scale;
}

Eigen::VectorXd singular_values_of_complex(const ComplexMatrixRef& A) {
  // [Re -Im; Im Re] has the same singular values, each twice.
  const Eigen::Index m = A.rows();
  const Eigen::Index n = A.cols();
  MatrixXd doubled(2 * m, 2 * n);
  doubled << A.real(), -A.imag(), A.imag(), A.real();
  const Eigen::VectorXd twice = singular_values_of(doubled);
  Eigen::VectorXd values(twice.size() / 2);
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    values(k) = twice(2 * k);
  }
  return values;
}

}  // namespace flyball::detail
